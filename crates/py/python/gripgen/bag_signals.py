"""What the topics of a bag say over time. The well-kept library `rosbags` reads ROS 1 bags, and MCAP and sqlite3 of ROS 2."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import DataError, GripgenError
from .bag_mapping import ROSBAG_FILE, SUFFIXES, BagMapping, plain
from .checks import unreadable

if TYPE_CHECKING:
    from numpy.typing import NDArray

WRENCH, FLOAT = "geometry_msgs/msg/WrenchStamped", "std_msgs/msg/Float64"
POSE, JOINTS = "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/JointState"
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
#: Types that are read, and what to do about others, by key of `[topics]`.
_KINDS = {
    "wrench": ((WRENCH,), "topics.wrench names the wrench of the force sensor"),
    "command": ((FLOAT, WRENCH), "topics.command names the commanded force, or is left out"),
    "pose": ((POSE,), "topics.pose names the pose of the tool, or is left out"),
    "joint_states": (
        (JOINTS,),
        "topics.joint_states names the joints of the arm, motion.joints their names from base to tool",
    ),
    "image_left": ((IMAGE, COMPRESSED), "topics.image_left and image_right name the cameras of the jaws"),
    "image_right": ((IMAGE, COMPRESSED), "topics.image_left and image_right name the cameras of the jaws"),
}
_LOG = '`clock = "log"` counts when messages were recorded'
_REBUILD = {
    ".mcap": "`mcap recover FILE.mcap -o WHOLE.mcap` saves what can be read",
    ".bag": "`rosbag reindex` rebuilds the index of a bag of ROS 1",
    "": "`ros2 bag reindex` writes the metadata.yaml of a folder again, `mcap recover` saves what can be read of an .mcap",
}
#: Ends of the names of recordings that have to be unpacked, or were never closed.
PACKED = (".zstd", ".lz4", ".active")
#: A clock that steps back by more was set, or is another one: messages are late by less.
_STEP_BACK_NS = 100_000_000
#: Largest image that is read.
_LARGEST_PX = 1 << 26


@dataclass
class Series:
    """Values of a topic in the order of their times, which differ."""

    #: Times, ns of the clock that counts.
    ns: NDArray[np.int64]
    #: One row for each time: forces, places, angles. Of images when they were recorded, ns.
    values: NDArray[Any]

    def at(self, ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """The values on the lines between their neighbours; those of the nearest beyond the ends."""
        since = (self.ns - self.ns[0]).astype(np.float64)
        when = (ns - self.ns[0]).astype(np.float64)
        return np.stack([np.interp(when, since, column) for column in self.values.T], axis=-1)

    def last(self, ns: int) -> int | None:
        """The row of the last value at or before a time."""
        row = int(np.searchsorted(self.ns, ns, side="right")) - 1
        return row if row >= 0 else None


@dataclass
class Signals:
    """The signals of a bag by key of `[topics]`."""

    bag: Path
    mapping: BagMapping
    series: dict[str, Series]

    @property
    def origin(self) -> int:
        """Time of the first wrench, from which the marks count."""
        return int(self.series["wrench"].ns[0])

    def ns(self, seconds: float) -> int:
        """The time of a mark."""
        return self.origin + round(seconds * 1e9)

    def seconds(self, ns: int) -> float:
        """The time in seconds after the first wrench."""
        return (int(ns) - self.origin) / 1e9


def recording(bag: Path) -> Path:
    """The one recording that a path names: a file, or a folder with metadata.yaml. Several are a question."""
    if not bag.exists():
        raise unreadable(f"{bag}: there is no such bag", f"`bag` of {ROSBAG_FILE} is relative to that file")
    if not bag.is_dir() or (bag / "metadata.yaml").is_file():
        return bag
    inside = sorted(bag.iterdir())
    found = [p for p in inside if p.suffix in SUFFIXES or (p / "metadata.yaml").is_file()]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(p.name for p in found)
        hint = (
            f'one `[[pulls]]` with `bag = "{found[0].name}"` for each; the files of one recording that was split need its '
            "metadata.yaml (`ros2 bag reindex`)"
        )
        raise unreadable(f"{bag}: there are {len(found)} recordings and none is named: {names}", hint)
    packed = sorted({p.suffix for p in inside if p.suffix in PACKED})
    there = f", but {', '.join(packed)}" if packed else ""
    raise unreadable(f"{bag}: there is no recording ({', '.join(SUFFIXES)}){there}", "`zstd -d` unpacks .mcap.zstd")


def unused(folder: Path, bags: list[Path]) -> list[str]:
    """What lies in a folder of bags and is not read: recordings that no pull names, and files that no metadata.yaml names."""
    used = {Path(os.path.realpath(bag)) for bag in bags}

    def is_bag(p: Path) -> bool:
        return p.suffix in SUFFIXES + PACKED or p.is_dir() and any(q.suffix in SUFFIXES + PACKED for q in p.iterdir())

    def is_used(p: Path) -> bool:
        real = Path(os.path.realpath(p))
        return any(real == bag or real in bag.parents or bag in real.parents for bag in used)

    notes = []
    other = [p.name for p in sorted(folder.iterdir()) if is_bag(p) and not is_used(p)]
    if other:
        hint = "`[[pulls]]` with their names as `bag` read them"
        notes.append(f"{folder}: {', '.join(other)}: named by no pull, not read; {hint}")
    for bag in sorted(bag for bag in used if (bag / "metadata.yaml").is_file()):
        text = (bag / "metadata.yaml").read_text(encoding="utf-8", errors="replace")
        left = [p.name for p in sorted(bag.iterdir()) if p.suffix in SUFFIXES + PACKED and p.name not in text]
        if left:
            hint = "`ros2 bag reindex` writes it again with all files"
            notes.append(f"{bag}: {', '.join(left)}: not in its metadata.yaml, not read; {hint}")
    return notes


def topics_of(bag: Path) -> dict[str, str]:
    """Names of the topics of a bag, with their types."""
    with _reader(recording(bag)) as (reader, _):
        return {c.topic: c.msgtype for c in sorted(reader.connections, key=lambda c: c.topic)}


@contextmanager
def _reader(path: Path) -> Iterator[tuple[Any, Any]]:
    """The opened recording, and what turns the bytes of a message into an object."""
    try:
        from rosbags import rosbag1, rosbag2
        from rosbags.typesys import Stores, get_typestore
    except ImportError as e:
        raise unreadable(f"{path}: reading bags needs rosbags", "pip install 'gripgen[bags]'") from e
    is1 = path.suffix == ".bag"
    # The types that are read are the same in all versions of ROS 2, so the definitions in a bag are not needed.
    store = get_typestore(Stores.ROS1_NOETIC if is1 else Stores.ROS2_HUMBLE)
    try:
        with (rosbag1.Reader if is1 else rosbag2.Reader)(path) as reader:
            yield reader, store.deserialize_ros1 if is1 else store.deserialize_cdr
    except GripgenError:
        raise
    except Exception as e:
        # What the library says of a damaged file is of any kind.
        size = f"; the file has {path.stat().st_size} bytes" if path.is_file() else ""
        raise unreadable(f"{path}: {e or type(e).__name__}{size}", _REBUILD.get(path.suffix, _REBUILD[""])) from e


def read_signals(bag: Path, mapping: BagMapping) -> Signals:
    """Read the topics that a mapping names."""
    path = recording(bag)
    keys = {name: key for key, name in mapping.topics.named().items()}
    topics = {key: _Topic(key, name, mapping) for name, key in keys.items()}
    with _reader(path) as (reader, deserialize):
        connections = [c for c in reader.connections if c.topic in keys]
        for c in connections:
            topics[keys[c.topic]].check(c, path)
        for c, log_ns, raw in reader.messages(connections) if connections else ():
            topics[keys[c.topic]].take(c.msgtype, log_ns, raw, deserialize, path)
    said = {c.topic: 0 for c in connections}
    for c in connections:
        said[c.topic] += c.msgcount
    for key, topic in topics.items():
        if topic.count == 0:
            there = ", ".join(f"{name} ({kind})" for name, kind in topics_of(bag).items())
            hint = f"`topics.{key}` of {ROSBAG_FILE} names it"
            raise unreadable(f"{path}: no message on `{topic.name}`; topics: {there}", hint)
        if topic.count < said[topic.name]:
            problem = f"{path}: {topic.count} messages on `{topic.name}`, the recording says that there are {said[topic.name]}"
            raise unreadable(problem, _REBUILD.get(path.suffix, _REBUILD[""]))
    return Signals(bag, mapping, {key: topic.series(path) for key, topic in topics.items()})


class _Topic:
    """Messages of a topic while they are read."""

    def __init__(self, key: str, name: str, mapping: BagMapping) -> None:
        self.key, self.name, self.mapping = key, name, mapping
        self.kinds, self.hint = _KINDS[key]
        self.count = 0
        self.ns: list[int] = []
        self.values: list[Any] = []
        self.stamped = True
        self.joints: set[str] = set()

    def bad(self, path: Path, problem: str, hint: str | None = None) -> DataError:
        return unreadable(f"{path}: `{self.name}`: {problem}", hint or self.hint)

    def check(self, connection: Any, path: Path) -> None:
        encoding = getattr(connection.ext, "serialization_format", "cdr")
        if encoding != "cdr":
            raise self.bad(path, f"its messages are encoded as `{encoding}`, `cdr` is read")
        if connection.msgtype not in self.kinds:
            raise self.bad(path, f"it is a `{connection.msgtype}`, `{'` or `'.join(self.kinds)}` is read")

    def take(self, kind: str, log_ns: int, raw: bytes, deserialize: Any, path: Path) -> None:
        self.count += 1
        if path.suffix != ".bag" and raw[:2] not in (b"\0\0", b"\0\1"):
            packed = raw[:4] == b"\x28\xb5\x2f\xfd"
            problem = f"the encapsulation of message {self.count} is {list(raw[:2])}, plain CDR has [0, 0] or [0, 1]"
            hint = "messages are compressed one by one, which only metadata.yaml says: name its folder; or `ros2 bag convert`"
            raise self.bad(path, problem, hint if packed else None)
        try:
            message = deserialize(raw, kind)
            value = self.value(message, kind)
            self.stamped = self.mapping.clock == "header" and kind != FLOAT
            ns = _stamp_ns(message) if self.stamped else log_ns
        except Exception as e:
            problem = f"message {self.count} of {len(raw)} bytes is no `{kind}`: {e or type(e).__name__}"
            raise self.bad(path, problem, _REBUILD.get(path.suffix, _REBUILD[""])) from e
        if value is not None:
            self.ns.append(ns)
            self.values.append(log_ns if self.key.startswith("image") else value)

    def value(self, message: Any, kind: str) -> Any:
        if kind == WRENCH:
            force = message.wrench.force
            force = (force.x, force.y, force.z)
            return force if self.key == "wrench" else (float(np.dot(self.mapping.force.along, force)),)
        if kind == FLOAT:
            return (message.data,)
        if kind == POSE:
            at = message.pose.position
            return (at.x, at.y, at.z)
        if kind == JOINTS:
            if len(message.position) not in (0, len(message.name)):
                raise ValueError(f"it names {len(message.name)} joints and has {len(message.position)} positions")
            self.joints.update(message.name)
            angles = dict(zip(message.name, message.position, strict=False))
            # Grippers publish theirs on the same topic.
            known = all(name in angles for name in self.mapping.motion.joints)
            return tuple(angles[name] for name in self.mapping.motion.joints) if known else None
        return ()

    def series(self, path: Path) -> Series:
        """All of it in the order of time. Of equal times the first reading counts, and the last command."""
        if not self.ns:
            wanted, there = ", ".join(self.mapping.motion.joints), ", ".join(sorted(self.joints))
            raise self.bad(path, f"no message has the joints {wanted}; there are {there}")
        ns, values = np.array(self.ns, dtype=np.int64), np.array(self.values)
        strange = np.flatnonzero(~np.isfinite(values.astype(np.float64)).reshape(len(ns), -1).all(axis=1))
        if strange.size:
            row = int(strange[0])
            raise self.bad(path, f"the values of message {row + 1} are {values[row].tolist()}, all must be numbers")
        if self.stamped:
            self.check_stamps(ns, path)
        last = self.key == "command"
        order = np.argsort(ns[::-1] if last else ns, kind="stable")
        order = len(ns) - 1 - order if last else order
        ns, values = ns[order], values[order]
        first = np.concatenate([[True], ns[1:] != ns[:-1]])
        return Series(ns[first], values[first])

    def check_stamps(self, ns: NDArray[np.int64], path: Path) -> None:
        """A clock that was not set, or set while it was recorded, gives no order."""
        each, counts = np.unique(ns, return_counts=True)
        unset = each[0] == 0 and counts[0] > 1
        most = 0 if unset else int(np.argmax(counts))
        if unset or counts[most] > max(1, len(ns) // 2):
            same = f"{counts[most]} of {len(ns)} messages have the same stamp, {plain(int(each[most]) / 1e9)} s"
            raise self.bad(path, same, _LOG)
        before = np.maximum.accumulate(ns)
        back = int(np.argmax(before - ns))
        if before[back] - ns[back] > _STEP_BACK_NS:
            by = plain(int(before[back] - ns[back]) / 1e9)
            raise self.bad(path, f"its clock goes back by {by} s at message {back + 1} of {len(ns)}", _LOG)


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp
    if stamp.nanosec >= 1_000_000_000:
        raise ValueError(f"its stamp has {stamp.nanosec} ns, a second has 1000000000")
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def read_images(signals: Signals, wanted: dict[Path, tuple[str, int]]) -> None:
    """Write images as PNG: for each file the key of its topic and the row of its series."""
    try:
        from PIL import Image
    except ImportError as e:
        raise unreadable(f"{signals.bag}: images of bags need Pillow", "pip install 'gripgen[bags]'") from e
    path, topics = recording(signals.bag), signals.mapping.topics
    with _reader(path) as (reader, deserialize):
        for file, (key, row) in wanted.items():
            name, series = getattr(topics, key), signals.series[key]
            log_ns = int(series.values[row])
            connections = [c for c in reader.connections if c.topic == name]
            for c, _, raw in reader.messages(connections, start=log_ns, stop=log_ns + 1):
                message = deserialize(raw, c.msgtype)
                if signals.mapping.clock == "header" and _stamp_ns(message) != series.ns[row]:
                    continue
                try:
                    image = _compressed(message, Image) if c.msgtype == COMPRESSED else Image.fromarray(_pixels(message))
                except Exception as e:
                    hint = "images are rgb8, bgr8, rgba8 or bgra8, or PNG and JPEG"
                    at = plain(signals.seconds(int(series.ns[row])))
                    raise unreadable(f"{path}: `{name}`: the image at {at} s: {e}", hint) from e
                image.save(file, format="PNG")
                break


def _compressed(message: Any, image: Any) -> Any:
    return image.open(io.BytesIO(message.data.tobytes()), formats=("PNG", "JPEG")).convert("RGB")


def _pixels(message: Any) -> NDArray[np.uint8]:
    """The pixels of a `sensor_msgs/msg/Image`, uint8[H, W, 3]."""
    orders = {"rgb8": (3, (0, 1, 2)), "bgr8": (3, (2, 1, 0)), "rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0))}
    if message.encoding not in orders:
        raise ValueError(f"its encoding is `{message.encoding}`")
    channels, order = orders[message.encoding]
    width, height, step, data = message.width, message.height, message.step, message.data
    if not 0 < width * height <= _LARGEST_PX:
        raise ValueError(f"it is {width}x{height} pixels, at most {_LARGEST_PX} are read")
    if step < width * channels or step * height > len(data):
        size = f"{width}x{height} pixels of {channels} bytes in rows of {step} bytes"
        raise ValueError(f"{size}, and {len(data)} bytes")
    rows = data[: step * height].reshape(height, step)[:, : width * channels]
    return np.ascontiguousarray(rows.reshape(height, width, channels)[:, :, list(order)])
