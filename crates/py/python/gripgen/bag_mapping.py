"""`rosbag.toml`: what the topics of a bag are to a pull, and when the pulls were made. docs/interop.md has an example."""

from __future__ import annotations

import math
import os
import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from .checks import refusal

ROSBAG_FILE = "rosbag.toml"
#: Ends of the names of recordings that are one file: MCAP and sqlite3 of ROS 2, ROS 1.
SUFFIXES = (".mcap", ".db3", ".bag")

_SCHEMA = "`gripgen schema rosbag` has every key, docs/interop.md an example"
_ARM = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")

Vector = tuple[float, float, float]
Names = tuple[str, str, str, str, str, str]
Cell = bool | int | float | str
_Section = TypeVar("_Section")


@dataclass(frozen=True)
class Campaign:
    """What holds for all pulls, as in `campaign.toml`."""

    force_convention: Literal["per_jaw", "total"] = "per_jaw"
    label_tolerance_n: float = 3.0
    stop_mm: float = 5.0
    feedback: Literal["measured", "independent"] | None = None
    label_evidence: Literal["trace", "none"] = "trace"


@dataclass(frozen=True)
class Topics:
    """Names of topics."""

    #: The force sensor.
    wrench: str
    #: The commanded pull force, in N along the pull or in the frame of the wrench.
    command: str | None = None
    #: Pose of the tool.
    pose: str | None = None
    #: Joints of the arm, a UR5e; taken where there is no pose.
    joint_states: str | None = None
    image_left: str | None = None
    image_right: str | None = None

    def named(self) -> dict[str, str]:
        """The topics that the mapping names, by key."""
        return {f.name: name for f in fields(self) if (name := getattr(self, f.name)) is not None}


@dataclass(frozen=True)
class Force:
    """How the wrench becomes a force along the pull."""

    #: The force that the part resists with is the wrench's force times this, summed over x, y and z.
    along: Vector = (0.0, 0.0, -1.0)
    #: Take the mean of the readings without a load off all readings.
    tare: bool = False


@dataclass(frozen=True)
class Motion:
    """How pose or joints become a displacement along the pull."""

    #: The pull's direction in the frame of the pose; of joints in the base of the arm.
    along: Vector = (0.0, 0.0, 1.0)
    #: Names of the joints from base to tool.
    joints: Names = tuple(f"{name}_joint" for name in _ARM)  # type: ignore[assignment]


@dataclass(frozen=True)
class Marks:
    """When a pull is, in seconds after the first wrench of its bag, and its columns of `pulls.csv`."""

    bag: str | None = None
    pull_id: str | None = None
    begin_s: float | None = None
    end_s: float | None = None
    from_s: float | None = None
    no_load_s: tuple[float, float] | None = None
    no_load_after_s: tuple[float, float] | None = None
    image_s: float | None = None
    rest_s: float | None = None
    columns: Mapping[str, Cell] = field(default_factory=dict)

    def text(self, column: str) -> str:
        """A column as it stands in the table; empty where there is none."""
        cell = self.columns.get(column, "")
        return str(cell).lower() if isinstance(cell, bool) else plain(cell) if isinstance(cell, float) else str(cell)


@dataclass(frozen=True)
class MarkedPull:
    """A pull of the mapping: its name, its bag, its marks."""

    id: str
    bag: Path
    marks: Marks


@dataclass(frozen=True)
class BagMapping:
    """A mapping that was read."""

    path: Path
    clock: Literal["header", "log"]
    campaign: Campaign
    topics: Topics
    force: Force
    motion: Motion
    pulls: tuple[MarkedPull, ...]


def plain(x: float) -> str:
    """A number as people write it: 7 and not 7.0."""
    return repr(x).removesuffix(".0")


def mapping_of(path: Path) -> Path | None:
    """Where the mapping of a bag or of a folder of bags is, or ought to be; None for what is no bag."""
    of_run = (path / "run.json" if path.is_dir() else path.parent / "run.json").is_file()
    if path.is_dir():
        inside, above = path / ROSBAG_FILE, path.parent / ROSBAG_FILE
        is_bag = (path / "metadata.yaml").is_file()
        if inside.is_file() or not is_bag:
            loose = not of_run and any(p.suffix in SUFFIXES for p in path.iterdir())
            return inside if inside.is_file() or loose else None
        return above if above.is_file() else inside
    if path.name == ROSBAG_FILE:
        return path
    return path.parent / ROSBAG_FILE if path.suffix in SUFFIXES and not of_run else None


def read_mapping(path: Path, bag: Path) -> BagMapping:
    """Read a mapping; `bag` is the recording of pulls that name none."""
    try:
        return _parsed(path, path.read_bytes().decode("utf-8-sig"), bag)
    except UnicodeDecodeError as e:
        raise refusal(f"{path}: not text, save it as UTF-8: {e}") from e
    except (tomllib.TOMLDecodeError, _Fault, RecursionError) as e:
        raise refusal(f"{path}: {e}", _SCHEMA) from e


class _Fault(ValueError):
    """A key that is not what it must be."""


def _parsed(path: Path, text: str, bag: Path) -> BagMapping:
    file = tomllib.loads(text)
    _known(file, ("clock", "campaign", "topics", "force", "motion", "defaults", "pulls"), "")
    campaign, topics = _section(Campaign, file, "campaign"), _section(Topics, file, "topics")
    force, motion = _section(Force, file, "force"), _section(Motion, file, "motion")
    clock = _checked(Literal["header", "log"], file.get("clock", "header"), "clock")
    for key, value in (("label_tolerance_n", campaign.label_tolerance_n), ("stop_mm", campaign.stop_mm)):
        if not (math.isfinite(value) and value > 0.0):
            raise _Fault(f"`{key}` is {plain(value)}, it must be a number above 0")
    for key, along in (("force.along", force.along), ("motion.along", motion.along)):
        length = math.hypot(*along)
        if not abs(length - 1.0) <= 1e-3:
            raise _Fault(f"`{key}` is {list(along)} of length {plain(length)}, it must be 1")
    keys: dict[str, str] = {}
    for key, name in topics.named().items():
        if name in keys:
            raise _Fault(f"`topics.{keys[name]}` and `topics.{key}` are both `{name}`")
        keys[name] = key
    defaults, entries = file.get("defaults", {}), file.get("pulls") or [{}]
    if not isinstance(defaults, dict) or not isinstance(entries, list):
        raise _Fault("`[defaults]` is a table, `[[pulls]]` a list of tables")
    defaults = {key: value for key, value in defaults.items() if key != "pull_id"}
    marks = [_marks(defaults, entry, f"pulls[{i}]") for i, entry in enumerate(entries)]
    bags = [path.parent / m.bag if m.bag is not None else bag for m in marks]
    ids = _named(marks, bags)
    return BagMapping(path, clock, campaign, topics, force, motion, tuple(map(MarkedPull, ids, bags, marks)))


def _marks(defaults: Mapping[str, Any], entry: Any, at: str) -> Marks:
    if not isinstance(entry, dict):
        raise _Fault(f"{at} is {entry!r}, it must be a table")
    given = {**defaults, **entry}
    names = {f.name for f in fields(Marks)} - {"columns"}
    columns = {key: value for key, value in given.items() if key not in names}
    for key, value in columns.items():
        if not isinstance(value, bool | float | str) and not _whole(value):
            raise _Fault(f"{at}: `{key}` is {value!r}, it must be a number or a word")
    if "max_pull_force_n" in columns:
        raise _Fault(f"{at}: `max_pull_force_n` is taken from the readings")
    kinds = get_type_hints(Marks)
    marks = Marks(**{key: _checked(kinds[key], given[key], f"{at}.{key}") for key in given if key in names}, columns=columns)
    pairs = [(key, pair) for key in ("no_load_s", "no_load_after_s") if (pair := getattr(marks, key)) is not None]
    for key, (low, high) in pairs:
        if low >= high:
            raise _Fault(f"{at}: `{key}` is from {plain(low)} to {plain(high)} s, it must rise")
    if marks.begin_s is not None and marks.end_s is not None and marks.begin_s >= marks.end_s:
        raise _Fault(f"{at}: `end_s` is {plain(marks.end_s)}, it must be above `begin_s`, {plain(marks.begin_s)}")
    times = [marks.begin_s, marks.end_s, marks.from_s, marks.image_s, marks.rest_s, *(x for _, pair in pairs for x in pair)]
    for x in times:
        if x is not None and not abs(x) < 1e9:
            raise _Fault(f"{at}: a time is {plain(x)} s, it must be seconds from the start of the bag")
    return marks


def _named(marks: list[Marks], bags: list[Path]) -> list[str]:
    """Names of the pulls, after their bags where they have none. They are names of files too."""
    ids: list[str] = []
    counts, met = Counter(bags), Counter[Path]()
    for i, (of_pull, bag) in enumerate(zip(marks, bags, strict=True)):
        met[bag] += 1
        stem = Path(os.path.abspath(bag)).stem or "bag"
        name = of_pull.pull_id or (f"{stem}-{met[bag]}" if counts[bag] > 1 else stem)
        if name in (".", "..") or set(name) & set("/\\:\0"):
            raise _Fault(f"pulls[{i}]: `pull_id` is `{name}`, it must be a name without `/`, `\\` and `:`")
        if name in ids:
            raise _Fault(f"pulls[{ids.index(name)}] and pulls[{i}] are both pull `{name}`, `pull_id` names each")
        ids.append(name)
    return ids


def _section(kind: type[_Section], file: Mapping[str, Any], key: str) -> _Section:
    table = file.get(key, {})
    if not isinstance(table, dict):
        raise _Fault(f"`{key}` is {table!r}, it must be a table")
    of_section = fields(kind)  # type: ignore[arg-type]
    # Further keys of a campaign are left alone, as in its own file.
    if kind is not Campaign:
        _known(table, [f.name for f in of_section], f"{key}.")
    missing = [f.name for f in of_section if f.default is MISSING and f.name not in table]
    if missing:
        raise _Fault(f"there is no key `{key}.{missing[0]}`")
    kinds = get_type_hints(kind)
    given = {f.name: _checked(kinds[f.name], table[f.name], f"{key}.{f.name}") for f in of_section if f.name in table}
    return kind(**given)


def _known(table: Mapping[str, Any], known: list[str] | tuple[str, ...], prefix: str) -> None:
    for key in table:
        if key not in known:
            raise _Fault(f"unknown key `{prefix}{key}`, there are {', '.join(known)}")


def _whole(value: Any) -> bool:
    return type(value) is int and abs(value) < 1 << 63


def _checked(kind: Any, value: Any, key: str) -> Any:
    """The value of a key, as its field wants it."""
    if type(None) in get_args(kind):
        kind = next(of for of in get_args(kind) if of is not type(None))
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        fits, wanted = isinstance(value, str) and value in parts, " or ".join(f"`{x}`" for x in parts)
    elif get_origin(kind) is tuple:
        fits, wanted = isinstance(value, list) and len(value) == len(parts), f"a list of {len(parts)}"
        if fits:
            return tuple(_checked(of, x, f"{key}[{i}]") for i, (of, x) in enumerate(zip(parts, value, strict=True)))
    elif kind is float:
        fits, wanted = isinstance(value, float) or _whole(value), "a number"
        value = float(value) if fits else value
    else:
        fits, wanted = isinstance(value, kind), "true or false" if kind is bool else "a text"
    if not fits:
        raise _Fault(f"`{key}` is {value!r}, it must be {wanted}")
    return value
