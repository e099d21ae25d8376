"""Sweeps from Python: the bytes of the command line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _core


@dataclass(frozen=True)
class SweepSummary:
    """How a sweep ended."""

    #: The run folder, or its URL.
    out: str
    #: Samples in finished shards.
    samples: int
    #: Of these, samples that failed; why is in the column `failure`.
    failed: int = 0
    #: Of these, pulls that ended before the jaws slipped: their label is a lower bound.
    censored: int = 0
    #: Of these, grips that missed the part: their label is 0.
    no_contact: int = 0
    #: Of these, pulls whose trace contradicts their label.
    suspect: int = 0
    #: All shards are done and `index.csv` is written.
    complete: bool = False
    #: The run was stopped before its end; the same call continues it.
    interrupted: bool = False


def sweep(
    config: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    jobs: int | None = None,
    slice: tuple[int, int] | None = None,
    set: Mapping[str, Any] | None = None,
    progress: bool | Callable[[int, int], None] | None = None,
) -> SweepSummary:
    """Run a sweep into the folder `out` (`runs/NAME` of NAME.toml if None), or what is missing of it: the same bytes
    as `gripgen sweep`.

    `jobs` threads (all cores if None), `slice=(i, n)` for piece i of n, `set` overrides any key. `progress` is called
    with samples done and samples in all; True prints them, None prints on a terminal only. Ctrl-C finishes the
    shards under way and raises KeyboardInterrupt; the same call continues.

    Raises ConfigError for what the configuration forbids, GripgenError if `out` holds another run.
    """
    tell: Callable[[int, int], None] | None
    if progress is None or isinstance(progress, bool):
        show = sys.stderr.isatty() if progress is None else progress
        tell = _print_progress if show else None
    else:
        tell = progress
    jobs = os.cpu_count() or 1 if jobs is None else jobs
    out = Path("runs") / Path(config).stem if out is None else out
    found = _core.sweep(os.fspath(config), os.fspath(out), dict(set or {}), jobs, slice, tell)
    return SweepSummary(out=os.fspath(out), **found)


def _print_progress(done: int, samples: int) -> None:
    end = "\n" if done == samples else ""
    print(f"\r{done} of {samples} samples", end=end, file=sys.stderr, flush=True)
