"""Datasets: runs and measured pulls as rows with random access."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _core, checks, remote
from .films import Film

if TYPE_CHECKING:
    import pandas
    import pyarrow
    from numpy.typing import ArrayLike, NDArray

#: Statuses whose label is exact.
LABELLED = ("slipped", "no_contact")

#: Labels of a pull, and their columns: what the label rule of the experiment reads, the largest mean force while the jaws held, the
#: friction of jaws that slide, and (of simulated pulls) what the contact held without noise and rule.
LABELS = {
    "rule": "max_pull_force_n",
    "peak": "peak_force_n",
    "kinetic": "kinetic_force_n",
    "limit": "limit_force_n",
}


class Sample(NamedTuple):
    """One row: both images, the label, and what is known of the pull."""

    #: uint8[2, H, W, 3], left jaw first; None where the dataset has no images.
    images: NDArray[np.uint8] | None
    #: The label that the dataset was loaded with, N.
    label_n: float
    #: The row of the table.
    values: dict[str, Any]
    #: The film of the pull, where the dataset was loaded with `video=True`.
    film: Film | None = None


class Batch(NamedTuple):
    """Several rows with more than images and labels; what was not asked for is None."""

    #: uint8[B, 2, H, W, 3].
    images: NDArray[np.uint8] | None
    #: float32[B], N.
    label_n: NDArray[np.float32]
    #: float32[B, T, 4]: time_s, desired_force_n, measured_force_n, displacement_mm; NaN beyond the end of a pull.
    traces: NDArray[np.float32] | None = None
    #: int64[B], rows of each trace; 0 where none is stored.
    trace_rows: NDArray[np.int64] | None = None
    #: float32[B, 2, H, W], mm that the part is pressed into the gel.
    heights_mm: NDArray[np.float32] | None = None
    #: float32[B, 2, 64, 4]: x_mm, y_mm, area_mm2 and force_n of the cells of each jaw's contact.
    forces: NDArray[np.float32] | None = None


def load(
    path: str | os.PathLike[str],
    *,
    label: str = "rule",
    status: str | Sequence[str] = LABELLED,
    suspect: bool = False,
    noise: str = "stored",
    video: bool = False,
    cache_dir: str | os.PathLike[str] | None = None,
) -> Dataset:
    """Open a run folder or a folder with `pulls.csv`; an fsspec URL (`s3://...`) is copied into `cache_dir` first.

    A relative path holds from where the program is now: the dataset keeps the absolute one, so that it can be read after the folder was changed.

    Rows are kept whose status is in `status` (slipped, no_contact, censored, suspect, failed). A censored pull ended
    before the jaws slipped: its label is a lower bound, so it is left out unless asked for; a failed sample has neither
    label nor images. A suspect pull has a label that recorded evidence contradicts, and says in `status_reason` how:
    with `suspect=True` its row is kept too.

    `label` is "rule" (the label rule of the experiment), "peak" (the largest mean of 20 ms while the jaws held), "kinetic" (the friction
    of jaws that slide) or "limit" (what the contact held, of simulated pulls). Rows without that label are left out.

    A run with `images = "clean"` has its images without the noise of the sensors, which is added when they are read: as the
    sweep drew it (`noise="stored"`, the bytes of `images = "png"`), anew in every epoch ("resample"), or not at all ("off").

    With `video=True` every row has the film of its pull (`ds[i].film`), of a run with `[images] during_pull`; `ds.film(i)` reads one
    in any case.

    Raises DataError, naming the file, for what is no such folder or is damaged, and ConfigError for an unknown status.
    """
    asked = checks.known_statuses(status)
    text = os.fspath(path)
    if remote.is_url(text):
        text = remote.fetch(text, cache_dir)
    text = checks.absolute(text)
    kept = (*asked, "suspect") if suspect and "suspect" not in asked else asked
    checks.one_of("label", label, LABELS)
    found = Dataset(text, status=kept, label=label, _opened=(os.getpid(), _core.Dataset(text)))
    if video:
        if not found._open().has_films:
            hint = "sweep with images = { during_pull = { frames = 24 } }"
            raise checks.unreadable(f"{text}: its pulls are not filmed", hint)
        found = replace(found, video=True, _opened=(os.getpid(), found._open()))
    return found if noise == "stored" else found.with_noise(noise)


@dataclass(frozen=True, eq=False)
class Dataset(Sequence[Sample]):
    """Rows of a run, in the order of its index. Made by `load`.

    `ds[i]` is one row, `ds.batch(rows)` several in one call without the interpreter's lock, `ds.table()` everything
    but images and traces; `ds[2:6]`, `ds[[3, 1]]` and `ds[mask]` are datasets of those rows. It is a map-style dataset for torch (`__getitems__` fetches a batch at once), can be
    pickled, and works under fork and spawn: a copy opens the files anew when it first reads.
    """

    path: str
    status: tuple[str, ...] = LABELLED
    #: Which label it has: a key of `LABELS`.
    label: str = "rule"
    #: Rows of the run that belong to this dataset.
    rows: NDArray[np.int64] | None = None
    #: The noise that images are read with: "stored", "resample" or "off"; and the epoch that it is drawn for.
    noise: str = "stored"
    noise_epoch: int = 0
    #: Whether rows have the films of their pulls.
    video: bool = False
    # The open files, and the process that opened them.
    _opened: tuple[int, _core.Dataset] | None = field(default=None, repr=False)
    # Rows of the run when it was loaded.
    _total: int = 0

    def __post_init__(self) -> None:
        if not self._total:
            object.__setattr__(self, "_total", len(self._open()))
        if self.rows is None:
            found = np.asarray(self._columns()["status"])
            keep = np.isin(found, self.status)
            if self.label != "rule":
                keep &= np.isfinite(self._label_column())
            rows = np.flatnonzero(keep)
        else:
            rows = np.array(self.rows, dtype=np.int64)
        rows.flags.writeable = False
        object.__setattr__(self, "rows", rows)

    def __getstate__(self) -> dict[str, Any]:
        kept = ("path", "status", "label", "rows", "noise", "noise_epoch", "video", "_total")
        return {**{name: getattr(self, name) for name in kept}, "_opened": None}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, value)

    def _open(self) -> _core.Dataset:
        # What is open belongs to the process that opened it: a child opens the files anew.
        if self._opened is not None and self._opened[0] == os.getpid():
            return self._opened[1]
        found = _opened_here(self.path)
        if self._total and len(found) != self._total:
            raise checks.unreadable(
                f"{self.path}: it has {len(found)} rows now and had {self._total} when it was loaded",
                "load it again",
            )
        object.__setattr__(self, "_opened", (os.getpid(), found))
        return found

    def _columns(self) -> dict[str, Any]:
        found = self.__dict__.get("_columns_read")
        if found is None:
            found = self._open().columns()
            object.__setattr__(self, "_columns_read", found)
        return found

    def __repr__(self) -> str:
        size = self.image_size_px
        images = f"images 2 x {size[0]} x {size[1]}" if size else "no images"
        return f"gripgen.Dataset({self.path!r}, {len(self)} pulls, {images})"

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def image_size_px(self) -> tuple[int, int] | None:
        """Width and height of the images; None if there are none."""
        return self._open().image_size_px

    @property
    def info(self) -> dict[str, str]:
        """What the run says of itself: name, source, gripgen_version, config_sha256, config_toml."""
        return self._open().info

    @property
    def labels(self) -> NDArray[np.float32]:
        """float32[len]: the label of every row, N."""
        return self._label_column()[self.rows].astype(np.float32)

    def _label_column(self) -> NDArray[np.float64]:
        name = LABELS[self.label]
        columns = self._columns()
        if name not in columns:
            hint = "traces with displacements have it, and runs of this version" if self.label != "rule" else ""
            raise checks.unreadable(f"{self.path}: there is no column {name!r} for label = {self.label!r}", hint)
        return np.asarray(columns[name])

    @property
    def inputs(self) -> tuple[str, ...]:
        """Columns that are known before a pull: what a network may be given."""
        return self._of_role("input")

    @property
    def answers(self) -> tuple[str, ...]:
        """Columns that only a simulation knows (limits, friction coefficients, drawn keys of the twin): no network may be given one."""
        return self._of_role("answer")

    def _of_role(self, role: str) -> tuple[str, ...]:
        return tuple(name for name, found in self._open().roles().items() if found == role)

    def column(self, name: str) -> NDArray[Any]:
        """A column of the table as an array of float64 or str."""
        columns = self._columns()
        if name not in columns:
            raise checks.unreadable(f"{self.path}: there is no column {name!r}; there are {', '.join(columns)}")
        return np.asarray(columns[name])[self.rows]

    def table(self, *, to: str = "pandas") -> pandas.DataFrame | pyarrow.Table:
        """All columns without images and traces, as a pandas DataFrame or (`to="arrow"`) a pyarrow Table."""
        columns = {name: self.column(name) for name in self._columns()}
        if to == "pandas":
            try:
                import pandas
            except ImportError as e:
                raise checks.needs("table()", "pandas", "table") from e
            return pandas.DataFrame(columns)
        if to == "arrow":
            try:
                import pyarrow
            except ImportError as e:
                raise checks.needs('table(to="arrow")', "pyarrow", "table") from e
            return pyarrow.table({name: pyarrow.array(values.tolist()) for name, values in columns.items()})
        raise checks.refusal(f"to = {to!r} is neither 'pandas' nor 'arrow'")

    def _rows_of(self, ids: ArrayLike) -> list[int]:
        return self.rows[checks.row_numbers(ids, len(self))].tolist()

    def __getitem__(self, i: int | slice | ArrayLike) -> Sample | Dataset:
        if isinstance(i, slice):
            return self.subset(range(*i.indices(len(self))))
        if np.ndim(i) > 0:
            return self.subset(i)
        return self.__getitems__([i])[0]

    def __getitems__(self, ids: Sequence[int]) -> list[Sample]:
        """Several rows at once; torch's loaders call it with the ids of a batch."""
        rows = self._rows_of(ids)
        images = self._images(rows, 1) if self.image_size_px else [None] * len(rows)
        columns, labels = self._columns(), self._label_column()
        found = []
        for row, both in zip(rows, images):
            values = {name: column[row] for name, column in columns.items()}
            film = self._film(row) if self.video else None
            found.append(Sample(both, float(labels[row]), values, film))
        return found

    def __iter__(self) -> Iterator[Sample]:
        for first in range(0, len(self), 32):
            yield from self.__getitems__(range(first, min(first + 32, len(self))))

    def batch(
        self,
        ids: ArrayLike,
        *,
        images: bool = True,
        traces: bool = False,
        heights: bool = False,
        forces: bool = False,
        threads: int = 1,
    ) -> tuple[NDArray[np.uint8] | None, NDArray[np.float32]] | Batch:
        """Rows as arrays: `images, labels = ds.batch(ids)`, uint8[B, 2, H, W, 3] and float32[B].

        `ids` are numbers of rows, or a mask (bool[len]) that selects them.

        With `traces`, `heights` or `forces` a `Batch` with those. Heights are simulated again from the run's own
        configuration and cost milliseconds each. `threads` share decoding and simulation.
        """
        rows = self._rows_of(ids)
        opened = self._open()
        labels = self._label_column()[rows].astype(np.float32)
        pixels = self._images(rows, threads) if images else None
        if not (traces or heights or forces):
            return pixels, labels
        lines, lengths = opened.traces(rows) if traces else (None, None)
        return Batch(
            images=pixels,
            label_n=labels,
            traces=lines,
            trace_rows=lengths,
            heights_mm=opened.heights(rows, threads) if heights else None,
            forces=opened.forces(rows) if forces else None,
        )

    def film(self, i: int) -> Film | None:
        """The film of a row's pull; None where there is none (no contact, or a run without films)."""
        return self._film(self._rows_of([i])[0])

    def _film(self, row: int) -> Film | None:
        arrays = self._open().film(row)
        return None if arrays is None else Film(**arrays)

    def subset(self, ids: ArrayLike) -> Dataset:
        """The rows with these numbers, in this order, or those that a mask (bool[len]) selects."""
        return self._with(np.asarray(self._rows_of(ids), dtype=np.int64))

    def where(self, keep: ArrayLike) -> Dataset:
        """The rows for which `keep` (bool[len]) is true."""
        return self._with(self.rows[checks.mask_of(keep, len(self))])

    def with_noise(self, noise: str, epoch: int = 0) -> Dataset:
        """The same rows with other noise on their images, for runs with `images = "clean"`: "stored" is that of the sweep,
        "resample" is drawn for this epoch (the same for the same epoch, of the same size), "off" is none."""
        if noise not in ("stored", "resample", "off"):
            raise checks.refusal(f"noise = {noise!r} is neither 'stored' nor 'resample' nor 'off'")
        if noise != "stored" and not self._open().clean_images:
            hint = 'sweep with images = "clean" to choose the noise when reading'
            raise checks.unreadable(f"{self.path}: the noise of its images is in them", hint)
        return replace(self, noise=noise, noise_epoch=epoch, _opened=(os.getpid(), self._open()))

    def _images(self, rows: list[int], threads: int) -> NDArray[np.uint8]:
        mode = "again" if self.noise == "resample" else self.noise
        return self._open().images(rows, threads, mode, self.noise_epoch)

    def _with(self, rows: NDArray[np.int64]) -> Dataset:
        return replace(self, rows=rows, _opened=(os.getpid(), self._open()))

    def split(
        self, *, by: str | Sequence[str] | None = None, test: float = 0.2, seed: int = 0
    ) -> tuple[Dataset, Dataset]:
        """Split into train and test so that rows with equal values of `by` stay together.

        The default keeps together what shares a draw and would leak from train to test otherwise: whole rigs (`rig_id`) where
        the sweep has several, the repetitions of a configuration (`group`) where it has not;
        `by="part"` holds out whole parts, `by=("part", "grip_pose")` whole grips. `test` is the share of groups, above 0
        and below 1; each side has one at least.
        """
        test = checks.share(test)
        if by is None:
            by = "rig_id" if "rig_id" in self._columns() and len(set(self.column("rig_id"))) > 1 else "group"
        names = [by] if isinstance(by, str) else list(by)
        if by == "group" and "group" not in self._columns():
            # Measured pulls: what was set is the configuration.
            known = ["part", "grip_force_n", "grip_offset_mm", "grip_angle_deg", "force_increment_n", "step_time_s"]
            names = [name for name in known if name in self._columns()]
        keys = list(zip(*(self.column(name).tolist() for name in names)))
        groups = sorted(set(keys), key=repr)
        if len(groups) < 2:
            raise checks.unreadable(f"{self.path}: all {len(self)} pulls have the same {', '.join(names)}")
        order = np.random.default_rng(seed).permutation(len(groups))
        count = min(max(1, round(test * len(groups))), len(groups) - 1)
        held_out = {groups[i] for i in order[:count]}
        is_test = np.array([key in held_out for key in keys])
        return self.where(~is_test), self.where(is_test)

    def iterate(
        self,
        *,
        batch_size: int = 32,
        shuffle: bool = True,
        seed: int = 0,
        epoch: int = 0,
        rank: int = 0,
        world_size: int = 1,
        drop_last: bool = False,
        threads: int = 1,
    ) -> Iterator[tuple[NDArray[np.uint8] | None, NDArray[np.float32]]]:
        """Batches of this rank in a seeded order, a new one every epoch; every row is seen by one rank. With
        `noise="resample"` the noise of the images is that of the epoch."""
        batch_size = checks.rows_of_batch(batch_size)
        rank = checks.own_rank(rank, world_size)
        own = self.with_noise(self.noise, epoch) if self.noise == "resample" else self
        order = np.arange(len(self))
        if shuffle:
            order = np.random.default_rng((seed, epoch)).permutation(order)
        order = order[rank::world_size]
        for first in range(0, len(order), batch_size):
            ids = order[first : first + batch_size]
            if drop_last and len(ids) < batch_size:
                return
            images, labels = own.batch(ids, images=self.image_size_px is not None, threads=threads)
            yield images, labels


# What this process opened for datasets that came from another one: workers have many copies of one.
_lock = threading.Lock()
_open_files: dict[str, _core.Dataset] = {}
_MOST_OPEN = 16


def _opened_here(path: str) -> _core.Dataset:
    with _lock:
        found = _open_files.get(path)
        if found is None:
            found = _core.Dataset(path)
            if len(_open_files) >= _MOST_OPEN:
                _open_files.pop(next(iter(_open_files)))
            _open_files[path] = found
        return found


def _forget() -> None:
    global _lock, _open_files
    _lock, _open_files = threading.Lock(), {}


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
