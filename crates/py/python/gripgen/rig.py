"""A rig from Python: check it, rehearse, make pulls. The same functions as `gripgen rig`, the same files.

    from gripgen import rig

    assert all(line.ok for line in rig.check("rig.toml"))
    run = rig.pull("rig.toml", "runs/monday", parts=["gear"], grip_force_n=[10, 20, 40], repetitions=5)

A robot moves: read docs/rig.md first. Ctrl-C, and an exception in `on_event`, stop the rig safely before they are raised.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from . import _core

_Path = str | os.PathLike[str]
_OnEvent = Callable[[dict[str, Any]], object]


class CheckLine(NamedTuple):
    """What was found of one thing."""

    #: What was asked.
    what: str
    #: Whether pulls can be made with it.
    ok: bool
    #: The answer, in words.
    found: str


@dataclass(frozen=True)
class RigSummary:
    """How a run of a rig stands."""

    #: The run folder: `gripgen.load` reads it.
    out: str
    #: Pulls without a label; the same call makes them again.
    failed: int
    #: Pulls whose label is suspect; the column `status_reason` says why.
    suspect: int
    #: Every pull has a label.
    complete: bool


def check(
    config: _Path, *, rehearsal: _Path | None = None, set: Mapping[str, Any] | None = None
) -> list[CheckLine]:
    """Ask every device of a rig and check the robot's programs; nothing moves. `rehearsal` is the file of `rehearse`: versions,
    payload and tool have to be the same.

    Raises ConfigError for a rig's file that cannot be; a device that does not answer is a line with `ok=False`.
    """
    return [CheckLine(*line) for line in _core.rig_check(os.fspath(config), dict(set or {}), rehearsal)]


def rehearse(
    config: _Path,
    out: _Path | None = None,
    *,
    part: str | None = None,
    grip_force_n: float = 30.0,
    dwell_s: float = 5.0,
    set: Mapping[str, Any] | None = None,
    on_event: _OnEvent | None = None,
) -> dict[str, Any]:
    """Find out what the rig is like today: sensor, force mode, clocks; in air, then with a pull of 5 N. The robot moves.

    `part` is the first that is taught if None; the grip has to hold 5 N. What was found is returned (`gripgen.rigrehearsal/1`) and
    written to `out`, for `check` and `pull`; `doubts` says what is not as a pull needs it. A file that is there is not replaced.

    Raises ConfigError before anything moves, GripgenError for what stopped the rig.
    """
    if out is not None and Path(out).exists():
        raise FileExistsError(f"{out} is there already")
    text = _core.rig_rehearse(os.fspath(config), dict(set or {}), part, grip_force_n, dwell_s, on_event)
    if out is not None:
        Path(out).write_text(text)
    found: dict[str, Any] = json.loads(text)
    return found


def pull(
    config: _Path,
    out: _Path,
    *,
    campaign: _Path | None = None,
    parts: Sequence[str] = (),
    grip_force_n: Sequence[float] = (20.0,),
    repetitions: int = 1,
    seed: int = 0,
    rehearsal: _Path | None = None,
    after: _Path | None = None,
    columns: Mapping[str, str | float] | None = None,
    power_on: bool = False,
    unlock: bool = False,
    reconnect: int = 0,
    set: Mapping[str, Any] | None = None,
    on_event: _OnEvent | None = None,
) -> RigSummary:
    """Make pulls on a rig and record them into the run folder `out`; the same call makes what is missing. The robot moves.

    The pulls are those of `campaign`, or each of `parts` (all that are taught if empty) with each grip force. `rehearsal` slows
    staircases until force mode and sensor can follow; `after` is a run on the same gels before this one. `columns` are noted with
    every pull: `{"operator": "anna", "temperature_c": 21.5}`. `power_on` and `unlock` say
    that somebody stands beside the robot. `on_event` gets a dict for each event: `pull_started`, `step`, `images`, `reading`,
    `pull_finished`, `stopped`, `reconnecting`, `said`.

    Raises ConfigError before anything moves, GripgenError for what stopped the rig or if `out` holds another run.
    """
    found = _core.rig_pull(
        os.fspath(config),
        out,
        dict(set or {}),
        campaign,
        list(parts),
        list(grip_force_n),
        repetitions,
        seed,
        rehearsal,
        after,
        [(name, str(value)) for name, value in (columns or {}).items()],
        power_on,
        unlock,
        reconnect,
        on_event,
    )
    return RigSummary(out=os.fspath(out), **found)
