"""Batches of a sweep that are made while a network trains on them: no run folder, no disk."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _core, checks
from .dataset import LABELLED
from .films import Film

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class StreamBatch(NamedTuple):
    """A batch with columns of its rows."""

    #: uint8[B, 2, H, W, 3], left jaw first; None where the sweep makes no images.
    images: NDArray[np.uint8] | None
    #: float32[B], the pull force at slip, N.
    max_pull_force_n: NDArray[np.float32]
    #: The columns asked for: float64[B], or a list of str.
    columns: dict[str, NDArray[np.float64] | list[str]]


class FilmBatch(NamedTuple):
    """A batch with the films of its pulls, and columns of its rows."""

    #: As those of `StreamBatch`.
    images: NDArray[np.uint8] | None
    max_pull_force_n: NDArray[np.float32]
    columns: dict[str, NDArray[np.float64] | list[str]]
    #: The film of each pull; None where there is none (no contact).
    films: list[Film | None]


def stream(
    config: str | os.PathLike[str],
    *,
    batch_size: int = 32,
    columns: Sequence[str] = (),
    status: str | Sequence[str] = LABELLED,
    set: Mapping[str, Any] | None = None,
    rank: int = 0,
    world_size: int = 1,
    jobs: int | None = None,
    ahead: int | None = None,
    drop_last: bool = False,
    video: bool = False,
) -> Stream:
    """The samples of a sweep as batches, made by `jobs` threads while they are read.

    Iterating gives `(images, labels)`, uint8[B, 2, H, W, 3] and float32[B], or with `columns` a `StreamBatch`: the rows that
    `gripgen sweep` would write and `gg.load` would keep, in the order of their indices, bit for bit, whatever the number of
    threads. Each of `world_size` ranks gets every so manieth sample. At most `ahead` samples (two batches if None) are kept,
    so that memory is bounded and a slow reader slows the threads down. One pass is one sweep: its length is `samples` of the
    configuration, which `set={"samples": 10**9}` overrides.

    With `video=True` a batch is a `FilmBatch`: a film of each pull too, of a sweep with `[images] during_pull`, as `gg.load(..., video=True)`
    gives it. A film of 24 frames takes 40 MB: choose `batch_size` and `ahead` (one batch if None) by that.

    `state_dict` and `load_state_dict` continue where a training stopped. An iterator belongs to the process that began it: in a child that
    was forked off it raises DataError. The stream itself can be iterated over anywhere.

    Raises ConfigError for what the configuration forbids, and for an argument that cannot be.
    """
    size, workers = checks.rows_of_batch(batch_size), jobs or os.cpu_count() or 1
    found = Stream(
        config=checks.absolute(config),
        batch_size=size,
        columns=tuple(columns),
        status=checks.known_statuses(status),
        set=dict(set or {}),
        rank=checks.own_rank(rank, world_size),
        world_size=world_size,
        jobs=workers,
        ahead=(max(size, workers) if video else max(2 * size, 2 * workers)) if ahead is None else ahead,
        drop_last=drop_last,
        video=video,
    )
    # A configuration that cannot be is told now.
    if video and not found.info["filmed"]:
        hint = "films are made by a sweep with [images] during_pull = { frames = 24 }"
        raise checks.refusal(f"{config}: its pulls are not filmed", hint)
    known = found.info["columns"]
    for name in columns:
        if name not in known:
            raise checks.unreadable(f"{config}: there is no column {name!r}; there are {', '.join(known)}")
    return found


@dataclass(eq=False)
class Stream:
    """An iterable of batches. Made by `stream`; it can be pickled, and every copy makes samples of its own."""

    config: str
    batch_size: int
    columns: tuple[str, ...]
    status: tuple[str, ...]
    set: dict[str, Any]
    rank: int
    world_size: int
    jobs: int
    ahead: int
    drop_last: bool
    video: bool = False
    #: Samples of this rank that were read in this pass.
    _read: int = 0
    # Asked of the configuration once.
    _info: dict[str, Any] | None = field(default=None, repr=False)

    @property
    def info(self) -> dict[str, Any]:
        """Of the sweep: samples, seed, config_sha256, columns, filmed."""
        if self._info is None:
            # Beyond the end of any sweep: nothing is made.
            core = _core.Stream(self.config, self.set, 2**63, 1, 1, 1)
            self._info = dict(core.info)
        return self._info

    def share(self, part: int, parts: int) -> Stream:
        """This rank's samples, shared out once more: to worker processes of a loader."""
        found = Stream(**{**self.__dict__, "rank": self.rank + part * self.world_size})
        found.world_size = self.world_size * parts
        found._read = len(range(part, self._read, parts))
        return found

    def state_dict(self) -> dict[str, Any]:
        """Where this pass is, as JSON would write it."""
        return {"read": self._read, "config_sha256": self.info["config_sha256"], "world_size": self.world_size}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Continues where `state_dict` was: the next pass begins there, those after it at the beginning."""
        for key, found in (("config_sha256", self.info["config_sha256"]), ("world_size", self.world_size)):
            if state[key] != found:
                raise checks.refusal(
                    f"the state has {key} = {state[key]}, this stream {found}: its samples would be others",
                    "continue with the configuration and the ranks that it was made with",
                )
        self._read = int(state["read"])

    def __iter__(self) -> Iterator[tuple[NDArray[np.uint8] | None, NDArray[np.float32]] | StreamBatch | FilmBatch]:
        first = self.rank + self._read * self.world_size
        core = _core.Stream(
            self.config, self.set, first, self.world_size, self.jobs, self.ahead, list(self.status), self.video
        )
        while True:
            images, labels, columns, films, read = core.batch(self.batch_size, list(self.columns))
            if len(labels) == 0 or (self.drop_last and len(labels) < self.batch_size):
                break
            # The batch that is handed out counts as read: a state that is taken after it begins with the next.
            self._read += read
            if films is not None:
                made = [None if arrays is None else Film(**arrays) for arrays in films]
                yield FilmBatch(images, labels, columns, made)
            else:
                yield StreamBatch(images, labels, columns) if self.columns else (images, labels)
        self._read = 0
