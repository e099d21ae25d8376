"""Pulls out of ROS bags: `read_bag` makes a folder of measured pulls of recordings and their `rosbag.toml` (docs/interop.md)."""

from __future__ import annotations

import atexit
import csv
import json
import os
import re
import secrets
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._core import DataError
from .bag_mapping import ROSBAG_FILE, BagMapping, MarkedPull, Marks, mapping_of, plain, read_mapping
from .bag_signals import WRENCH, Signals, read_images, read_signals, topics_of, unused
from .checks import refusal, unreadable

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: First words of the campaign.toml of a folder that was made of bags: it may be made again.
MADE = "# gripgen import"
#: What a folder of pulls of bags holds.
_PARTS = ("pulls.csv", "campaign.toml", "traces", "images")
_TRACE = ("time_s", "desired_force_n", "measured_force_n", "displacement_mm")
#: Default increment and length of a step (docs/format.md).
_INCREMENT_N, _STEP_S = 1.0, 0.104
_MOST_STEPS = 1e6
#: How much of a pull the readings may miss at its ends.
_UNCOVERED_S = 1.0

_Path = str | os.PathLike[str]


@dataclass(frozen=True)
class BagSummary:
    """The folder of measured pulls that was made of bags."""

    #: The folder; `load`, `calibrate`, `diagnose` and `compare` read it.
    out: Path
    #: Pulls in its table.
    pulls: int
    #: Of these, pulls with a trace.
    traces: int
    #: Of these, pulls with images of both jaws.
    images: int
    #: Pulls by status.
    status: dict[str, int]
    #: What people have to know of them.
    notes: tuple[str, ...]


@dataclass
class _Pull:
    """One pull of a bag."""

    #: float64[T, 4] in the columns of a trace, up to the displacement stop.
    trace: NDArray[np.float64]
    #: The same without a load after the pull.
    after: NDArray[np.float64]
    #: The motion of the tool was recorded.
    moved: bool
    label_n: float | None
    status: str
    reason: str
    #: Row of the series of images, by name of the file behind the pull's.
    images: dict[str, tuple[str, int]]


def read_bag(
    path: _Path,
    mapping: _Path | None = None,
    *,
    out: _Path | None = None,
    force: bool = False,
    progress: bool | Callable[[int, int], None] | None = None,
) -> BagSummary:
    """Make a folder of measured pulls (pulls.csv, campaign.toml, traces, images) of ROS bags. Needs `gripgen[bags]`.

    `path` is a bag (ROS 1, or ROS 2 as MCAP or sqlite3), a folder with `rosbag.toml`, or that file, which says what the topics
    are and when the pulls were made; `mapping` is that file where it is neither in the bag nor in its folder. Without `out`
    the folder is a temporary one that goes when Python ends. `force` makes a folder again that was made of bags.
    `progress` is called with bags read and bags in all; True prints them, None prints on a terminal only.

    Raises ConfigError for a mapping or an argument that cannot be, DataError for a bag that cannot be read or is not clear.
    """
    path = Path(path)
    if not path.exists():
        raise refusal(f"{path}: there is no such file or folder")
    of_bag = Path(mapping) if mapping is not None else mapping_of(path)
    if of_bag is None:
        hint = f"name a folder with {ROSBAG_FILE}, or a bag: a folder with metadata.yaml, an .mcap, .db3 or .bag"
        raise refusal(f"{path}: neither a bag nor a mapping of bags", hint)
    bag = path.parent if path == of_bag else path
    if not of_bag.is_file():
        raise _no_mapping(of_bag, bag)
    read = read_mapping(of_bag, bag)
    if out is None:
        out = tempfile.mkdtemp(prefix="gripgen-bag-")
        atexit.register(shutil.rmtree, out, ignore_errors=True)
    out = Path(out)
    _check_out(out, read, force)
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = out.with_name(f"{out.name}.{secrets.randbelow(10**16):016}.partial")
    partial.mkdir()
    try:
        notes = _fill(partial, read, _teller(progress))
        if path in (of_bag, of_bag.parent):
            notes += unused(of_bag.parent, [pull.bag for pull in read.pulls])
        found = _summary(partial, read, notes)
        _publish(partial, out)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return BagSummary(out, *found)


def _no_mapping(mapping: Path, bag: Path) -> Exception:
    """The error of a bag without a mapping: its topics, and how a mapping begins."""
    try:
        topics = topics_of(bag)
    except DataError as e:
        return e
    there = ", ".join(f"{name} ({kind})" for name, kind in topics.items())
    wrench = next((name for name, kind in topics.items() if kind == WRENCH), "/wrench")
    hint = (
        f'begin with `[topics]`, `wrench = "{wrench}"`, `[defaults]`, `part = "gear"`, `grip_force_n = 40`; docs/interop.md'
    )
    return refusal(f"{mapping}: a bag needs this file, which says what its topics are; topics: {there}", hint)


def _check_out(out: Path, mapping: BagMapping, force: bool) -> None:
    inputs = [mapping.path.absolute(), *(pull.bag.absolute() for pull in mapping.pulls)]
    if any(os.path.realpath(out) in (os.path.realpath(p), os.path.realpath(p.parent)) for p in inputs):
        raise refusal(f"{out}: the bags are in this folder", "name another folder")
    if out.exists() and not out.is_dir():
        raise refusal(f"{out}: this is a file, a folder is written")
    if not out.exists() or not any(out.iterdir()):
        return
    campaign = out / "campaign.toml"
    own = campaign.is_file() and campaign.read_bytes().startswith(MADE.encode())
    if not own:
        raise refusal(f"{out}: it is not empty, and was not made of bags", "name a new folder")
    if not force:
        raise refusal(f"{out}: it is there already", "`force` makes it again, or name another folder")


def _teller(progress: bool | Callable[[int, int], None] | None) -> Callable[[int, int], None] | None:
    if progress is None or isinstance(progress, bool):
        show = sys.stderr.isatty() if progress is None else progress
        return (lambda done, bags: print(f"{done} of {bags} bags", file=sys.stderr, flush=True)) if show else None
    return progress


def _fill(folder: Path, mapping: BagMapping, tell: Callable[[int, int], None] | None) -> list[str]:
    """Write table, traces and images; returns remarks."""
    bags: dict[Path, list[int]] = {}
    for i, pull in enumerate(mapping.pulls):
        bags.setdefault(pull.bag, []).append(i)
    rows: dict[int, _Pull] = {}
    notes: list[str] = []
    for done, (bag, of_bag) in enumerate(bags.items(), 1):
        signals = read_signals(bag, mapping)
        begins: dict[int, int] = {}
        ends: list[int] = []
        wanted: dict[Path, tuple[str, int]] = {}
        for i in of_bag:
            marked = mapping.pulls[i]
            try:
                begin, end = _span(signals, marked.marks, len(of_bag))
                if begin in begins:
                    at = plain(signals.seconds(begin))
                    hint = "`begin_s` or `from_s` says which pull of the bag is meant"
                    raise _Fault(f"it begins at {at} s, and so does pulls[{begins[begin]}]", hint)
                begins[begin] = i
                ends.append(end)
                rows[i] = _read(signals, marked.marks, begin, end)
            except _Fault as e:
                raise unreadable(f"{mapping.path}: pulls[{i}] (`{marked.id}`, {marked.bag}): {e}", e.hint) from e
            _write_trace(folder, marked, rows[i])
            # The traces of all bags together may be large.
            rows[i].trace = rows[i].after = np.zeros((0, 4))
            wanted |= {folder / "images" / f"{marked.id}_{name}.png": place for name, place in rows[i].images.items()}
        notes += _other_staircases(signals, list(zip(begins, ends, strict=True)))
        if wanted:
            (folder / "images").mkdir(exist_ok=True)
            read_images(signals, wanted)
        if tell:
            tell(done, len(bags))
    _write_table(folder, mapping, [rows[i] for i in range(len(mapping.pulls))])
    still = sum(not pull.moved for pull in rows.values())
    unmoved = f"the motion of the tool was not recorded (topics.pose, topics.joint_states): {still} pulls have no trace"
    return [*notes, unmoved] if still else notes


def _other_staircases(signals: Signals, spans: list[tuple[int, int]]) -> list[str]:
    """Where the command rises outside all pulls of a bag."""
    command = signals.series.get("command")
    if command is None:
        return []
    up = command.values[:, 0] > 0.0
    rises = command.ns[up & ~np.concatenate([[False], up[:-1]])]
    # The command may have risen before the mark of its pull.
    last = [command.ns[up & (command.ns <= begin)][-1:] for begin, _ in spans]
    begun = {int(rises[rises <= ns[0]][-1]) for ns in last if ns.size}
    other = [int(ns) for ns in rises if int(ns) not in begun and not any(low <= ns <= high for low, high in spans)]
    if not other:
        return []
    at = ", ".join(f"{plain(round(signals.seconds(ns), 3))} s" for ns in other[:5]) + (", ..." if len(other) > 5 else "")
    return [f"{signals.bag}: the command rises at {at} too, in no pull: a `[[pulls]]` with `from_s` reads it"]


class _Fault(Exception):
    """What is wrong with a pull, and what to do about it."""

    def __init__(self, problem: str, hint: str | None = None) -> None:
        super().__init__(problem)
        self.hint = hint


def _span(signals: Signals, marks: Marks, pulls: int) -> tuple[int, int]:
    """Start and end of the staircase, ns."""
    wrench, command = signals.series["wrench"], signals.series.get("command")
    origin, last = signals.origin, int(wrench.ns[-1])
    times = command.ns if command else np.zeros(0, np.int64)
    up = (command.values[:, 0] > 0.0) if command else np.zeros(0, bool)
    # Where it rises above 0, and where it falls back.
    rises = times[up & ~np.concatenate([[False], up[:-1]])] if up.size else times
    falls = times[~up & np.concatenate([[False], up[:-1]])] if up.size else times
    if marks.begin_s is not None:
        begin = signals.ns(marks.begin_s)
    else:
        after = signals.ns(marks.from_s) if marks.from_s is not None else -(1 << 63)
        above = times[(times >= after) & up]
        if not above.size:
            hint = "`begin_s` is the start of the staircase, in seconds after the first wrench; or name topics.command"
            raise _Fault(f"nothing says when it begins: none of {len(times)} commands is above 0 N", hint)
        begin = int(above[0])
    fallen = falls[falls > begin]
    end = signals.ns(marks.end_s) if marks.end_s is not None else last
    # The command that ends it is the first that is not above 0.
    end = min(end, int(fallen[0]) - 1) if fallen.size else end
    if begin >= end or begin > last or min(begin + round(_UNCOVERED_S * 1e9), end) < origin:
        seconds = [plain(signals.seconds(ns)) for ns in (begin, end, last)]
        hint = '`clock = "log"` counts when messages were recorded'
        problem = f"it is from {seconds[0]} to {seconds[1]} s, the wrench from 0 to {seconds[2]} s"
        raise _Fault(problem, f"times are in seconds after the first wrench; {hint}")
    marked_end = signals.ns(marks.end_s) if marks.end_s is not None else None
    alone = pulls == 1 and marks.begin_s is None and marks.from_s is None and marked_end is None
    again = rises[rises > end]
    again = again if alone else again[again <= marked_end] if marked_end is not None else again[:0]
    if again.size:
        at = [plain(signals.seconds(ns)) for ns in (end, int(again[0]))]
        hint = "one `[[pulls]]` for each with its `bag`, and `begin_s` and `end_s` or `from_s`"
        raise _Fault(f"the command falls back at {at[0]} s and rises again at {at[1]} s: {len(again) + 1} staircases", hint)
    return begin, end


def _read(signals: Signals, marks: Marks, begin: int, end: int) -> _Pull:
    """The trace of a pull, and the label that it gives."""
    mapping, wrench = signals.mapping, signals.series["wrench"]
    sign = {"": 1.0, "1": 1.0, "-1": -1.0}.get(marks.text("pull_direction"))
    if sign is None:
        problem = f"`pull_direction` is `{marks.text('pull_direction')}`, it must be 1 or -1"
        raise _Fault(problem, "1 is up, -1 is down")
    force_n = sign * (wrench.values @ np.array(mapping.force.along))

    def within(low: int, high: int) -> NDArray[np.int64]:
        return np.flatnonzero((wrench.ns >= low) & (wrench.ns <= high))

    def marked(pair: tuple[float, float] | None) -> NDArray[np.int64]:
        return within(signals.ns(pair[0]), signals.ns(pair[1])) if pair else np.zeros(0, np.int64)

    before, pulled, after = marked(marks.no_load_s), within(begin, end), marked(marks.no_load_after_s)
    if before.size and wrench.ns[before[-1]] >= begin:
        reach = [plain(signals.seconds(ns)) for ns in (wrench.ns[before[-1]], begin)]
        problem = f"`no_load_s` reaches {reach[0]} s, the pull begins at {reach[1]} s"
        raise _Fault(problem, "readings without a load are those before the jaws pull")
    if mapping.force.tare:
        if not before.size:
            raise _Fault("`force.tare` has no reading to take off", "`no_load_s` says when there was no load")
        force_n = force_n - force_n[before].mean()
    place_m = _places(signals, begin, end)
    start_m = place_m(np.array([begin]))[0] if place_m else 0.0

    def table(rows: NDArray[np.int64], desired_n: NDArray[np.float64], moves: bool) -> NDArray[np.float64]:
        ns = wrench.ns[rows]
        moved_m = sign * (place_m(ns) - start_m) if place_m and moves else np.zeros(len(rows))
        return np.column_stack([(ns - begin) / 1e9, desired_n, force_n[rows], 1e3 * moved_m])

    none = np.zeros
    pull = table(pulled, _commands(signals, marks, wrench.ns[pulled], begin, end), True)
    trace = np.concatenate([table(before, none(len(before)), False), pull])
    past = np.flatnonzero(trace[:, 3] > mapping.campaign.stop_mm)
    kept = trace[: past[0] + 1] if past.size else trace
    # Without a displacement it slid if its command ended farther above the force than the label rule lets it be.
    tolerance_n = mapping.campaign.label_tolerance_n
    slid = bool(past.size) if place_m else bool(len(trace) and trace[-1, 1] - trace[-1, 2] > tolerance_n)
    label_n, status, reason = _label(kept, tolerance_n, slid)
    if status == "censored":
        # Whoever wonders why a pull has no slip sees how far it went.
        last = trace[-1]
        reason = f"the pull ends {last[1] - last[2]:.3f} N below its command, {plain(tolerance_n)} N are a slip"
        if place_m:
            farthest = f"its largest displacement is {trace[:, 3].max():.3f} mm"
            reason = f"the pull ends before the slip: {farthest}, `stop_mm` is {plain(mapping.campaign.stop_mm)} mm"
    after = after[wrench.ns[after] > end]
    return _Pull(
        kept, table(after, none(len(after)), True), place_m is not None, label_n, status, reason, _frames(signals, marks, begin)
    )


def _places(signals: Signals, begin: int, end: int) -> Callable[[NDArray[np.int64]], NDArray[np.float64]] | None:
    """Where the tool is along the pull at given times, m; None where it was not recorded."""
    key = next((key for key in ("pose", "joint_states") if key in signals.series), None)
    if key is None:
        return None
    series, along = signals.series[key], np.array(signals.mapping.motion.along)
    first, last = (signals.seconds(ns) for ns in (series.ns[0], series.ns[-1]))
    span = (signals.seconds(begin), signals.seconds(end))
    if first > span[0] + _UNCOVERED_S or last < span[1] - _UNCOVERED_S:
        name = signals.mapping.topics.named()[key]
        problem = f"`{name}` is from {plain(first)} to {plain(last)} s, the pull from {plain(span[0])} to {plain(span[1])} s"
        raise _Fault(problem, '`clock = "log"` counts when messages were recorded; or leave the topic out')
    if key == "pose":
        return lambda ns: series.at(ns) @ along
    return lambda ns: _core.ur5e_tool_m(series.at(ns)) @ along


def _commands(signals: Signals, marks: Marks, ns: NDArray[np.int64], begin: int, end: int) -> NDArray[np.float64]:
    """The command at given times: that of its topic, or the staircase of the pull."""
    command = signals.series.get("command")
    if command is not None:
        row = np.searchsorted(command.ns, ns, side="right") - 1
        return np.where(row >= 0, command.values[np.maximum(row, 0), 0], 0.0)
    increment_n, step_s = _above(marks, "force_increment_n", _INCREMENT_N), _above(marks, "step_time_s", _STEP_S)
    duration_s = (end - begin) / 1e9
    if duration_s / step_s > _MOST_STEPS:
        steps = f"{plain(duration_s)} s have {duration_s / step_s:.0f} steps of {plain(step_s)} s, at most {_MOST_STEPS:.0f}"
        raise _Fault(steps, "`end_s` is the end of the pull")
    starts_s = step_s * np.arange(max(1, np.ceil(duration_s / step_s)))
    # A start that rounding puts a hair after a reading still belongs to it.
    begun = np.searchsorted(starts_s, (ns - begin) / 1e9 + 1e-9, side="right")
    start_n = _number(marks, "force_start_n", increment_n)
    rising = begun * increment_n if start_n == increment_n else start_n + (begun - 1) * increment_n
    return np.where(begun > 0, rising, 0.0)


def _number(marks: Marks, key: str, default: float) -> float:
    value = marks.columns.get(key, default)
    if isinstance(value, bool | str):
        raise _Fault(f"`{key}` is `{marks.text(key)}`, it must be a number")
    return float(value)


def _above(marks: Marks, key: str, default: float) -> float:
    value = _number(marks, key, default)
    if not (np.isfinite(value) and value > 0.0):
        raise _Fault(f"`{key}` is {plain(value)}, it must be a number above 0")
    return value


def _label(trace: NDArray[np.float64], tolerance_n: float, slid: bool) -> tuple[float | None, str, str]:
    """Label, status and reason by the label rule (docs/model.md): the last reading that is near its command."""
    rows = trace[trace[:, 0] >= 0.0]
    apart_n = np.abs(rows[:, 2] - rows[:, 1])
    near = np.flatnonzero(apart_n < tolerance_n)
    if not near.size:
        closest = f"closest {apart_n.min():.3f} N in {len(trace)} rows" if len(rows) else "there is no reading"
        return None, "failed", f"the measured force was never within {plain(tolerance_n)} N of the command ({closest})"
    return float(rows[near[-1], 2]), "slipped" if slid else "censored", ""


def _frames(signals: Signals, marks: Marks, begin: int) -> dict[str, tuple[str, int]]:
    """The last images up to the mark of each; none where a jaw has none while gripped."""
    gripped = signals.ns(marks.image_s) if marks.image_s is not None else begin
    at = {jaw: (f"image_{jaw}", gripped) for jaw in ("left", "right")}
    if marks.rest_s is not None:
        at |= {f"rest_{jaw}": (f"image_{jaw}", signals.ns(marks.rest_s)) for jaw in ("left", "right")}
    found = {}
    for name, (key, ns) in at.items():
        row = signals.series[key].last(ns) if key in signals.series else None
        if row is not None:
            found[name] = (key, row)
    return found if {"left", "right"} <= found.keys() else {}


def _write_trace(folder: Path, marked: MarkedPull, pull: _Pull) -> None:
    if not pull.moved or not len(pull.trace):
        return
    (folder / "traces").mkdir(exist_ok=True)
    with open(folder / "traces" / f"{marked.id}.csv", "w") as file:
        file.write(",".join(_TRACE) + "\n")
        for time_s, desired_n, measured_n, moved_mm in np.concatenate([pull.trace, pull.after]).tolist():
            file.write(f"{plain(time_s)},{plain(desired_n)},{plain(measured_n)},{plain(round(moved_mm, 9))}\n")


def _write_table(folder: Path, mapping: BagMapping, pulls: list[_Pull]) -> None:
    stated = ("status", "status_reason")
    names = sorted({name for marked in mapping.pulls for name in marked.marks.columns} - set(stated))
    for name in ("part", "grip_force_n"):
        if name not in names:
            raise refusal(f"{mapping.path}: no pull has the key `{name}`", _COLUMNS)
    with open(folder / "pulls.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["pull_id", *names, *stated, "max_pull_force_n"])
        for marked, pull in zip(mapping.pulls, pulls, strict=True):
            # A status in the mapping takes precedence over the one from the readings.
            own = [marked.marks.text(name) for name in stated]
            status = own if own[0] else [pull.status, pull.reason]
            label = "" if pull.label_n is None else plain(pull.label_n)
            writer.writerow([marked.id, *(marked.marks.text(name) for name in names), *status, label])
    lines = [f"{MADE}: pulls of {mapping.path.name}; every reading of the sensor is in the traces"]
    campaign = {f.name: getattr(mapping.campaign, f.name) for f in fields(mapping.campaign)}
    lines += [f"{key} = {json.dumps(value)}" for key, value in campaign.items() if value is not None]
    (folder / "campaign.toml").write_text("\n".join([*lines, "every_reading = true", ""]), encoding="utf-8")


_COLUMNS = "keys of `[[pulls]]` or `[defaults]` are the columns of pulls.csv (docs/format.md)"


def _summary(folder: Path, mapping: BagMapping, notes: list[str]) -> tuple[int, int, int, dict[str, int], tuple[str, ...]]:
    """What the reader of measured pulls says of the folder: one meaning of each column."""
    try:
        columns = _core.Dataset(folder).columns()
    except DataError as e:
        text = str(e).split("\nhint:")[0]
        line = re.search(r"line (\d+), (.*)", text, re.S)
        if line and "pulls.csv" in text:
            i = int(line[1]) - 2
            text = f"{mapping.path}: pulls[{i}] (`{mapping.pulls[i].id}`): {line[2]}"
        raise refusal(text.replace(str(folder), str(mapping.path)), _COLUMNS) from e
    status, reasons, ids = columns["status"], columns.get("status_reason"), columns["pull_id"]
    for i, name in enumerate(status):
        if name in ("censored", "suspect", "failed") and reasons is not None and reasons[i]:
            notes.append(f"pull {ids[i]} is {name}: {reasons[i]}")
    traces = len(list((folder / "traces").glob("*.csv")))
    images = len(list((folder / "images").glob("*_right.png"))) - len(list((folder / "images").glob("*_rest_right.png")))
    return len(status), traces, images, dict(Counter(status)), tuple(notes)


def _publish(partial: Path, out: Path) -> None:
    """Give the folder its name; one that was there before loses its parts first."""
    if not out.exists():
        os.replace(partial, out)
        return
    for name in _PARTS:
        old = out / name
        if old.is_dir():
            shutil.rmtree(old)
        else:
            old.unlink(missing_ok=True)
        if (partial / name).exists():
            os.replace(partial / name, old)
