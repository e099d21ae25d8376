"""Arguments that cannot be are refused: taken for something else they would give other data without a word."""

from __future__ import annotations

import difflib
import operator
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ._core import ConfigError, DataError, GripgenError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

AnyError = TypeVar("AnyError", bound=GripgenError)

#: Names of all statuses of a pull (docs/format.md).
STATUSES = ("slipped", "no_contact", "censored", "suspect", "failed")


def refusal(message: str, hint: str | None = None) -> ConfigError:
    """The exception of an argument that cannot be, with its hint as the Rust half gives one."""
    return _with_hint(ConfigError, message, hint)


def unreadable(message: str, hint: str | None = None) -> DataError:
    """The exception of data that cannot be read, or not in this way."""
    return _with_hint(DataError, message, hint)


def _with_hint(kind: type[AnyError], message: str, hint: str | None) -> AnyError:
    error = kind(f"{message}\nhint: {hint}" if hint else message)
    error.hint = hint
    return error


def needs(what: str, package: str, extra: str) -> ImportError:
    """The exception of a package that is not there, with the extra of gripgen that brings it."""
    return ImportError(f"{what} needs {package}: pip install 'gripgen[{extra}]'", name=package)


def absolute(path: str | os.PathLike[str]) -> str:
    """A path that holds wherever it is opened: Hydra, Ray and launchers change the folder. `asset:...` is the same everywhere."""
    text = os.fspath(path)
    return text if text.startswith("asset:") else os.path.abspath(text)


def known_statuses(status: str | Sequence[str]) -> tuple[str, ...]:
    """Statuses that there are; one alone may be a word."""
    asked = (status,) if isinstance(status, str) else tuple(status)
    for name in asked:
        if name not in STATUSES:
            close = difflib.get_close_matches(str(name).lower(), STATUSES, n=1)
            hint = f"did you mean `{close[0]}`?" if close else None
            raise refusal(f"there is no status {name!r}; there are {', '.join(STATUSES)}", hint)
    return asked


def one_of(name: str, value: str, known: Iterable[str]) -> str:
    """A word of a list."""
    if value not in known:
        close = difflib.get_close_matches(str(value).lower(), known, n=1)
        hint = f"did you mean `{close[0]}`?" if close else None
        raise refusal(f"{name} = {value!r} is none of {', '.join(known)}", hint)
    return value


def mask_of(keep: ArrayLike, rows: int) -> NDArray[np.bool_]:
    """A mask with a value for each row."""
    mask = np.asarray(keep)
    if mask.shape != (rows,):
        has = f"{mask.size} values" if mask.ndim == 1 else f"the shape {mask.shape}"
        hint = "compare a column of this dataset, not of the one it was taken from"
        raise refusal(f"the mask has {has}, the dataset {rows} rows", hint)
    # An empty list has no type of its own.
    if mask.dtype != bool and rows:
        raise refusal(f"a mask is of bool, this one of {mask.dtype}", "ds.subset(ids) takes numbers of rows")
    return mask.astype(bool)


def row_numbers(ids: ArrayLike, rows: int) -> NDArray[np.int64]:
    """Numbers of rows as numpy would pick them: those below 0 count from the end, a mask selects."""
    asked = np.asarray(ids)
    if asked.dtype == bool:
        return np.flatnonzero(mask_of(asked, rows))
    asked = asked.reshape(-1)
    if asked.size and asked.dtype.kind not in "iuf":
        raise refusal(f"rows are asked for by whole numbers or a mask, not by {asked.dtype}")
    if asked.dtype.kind == "f":
        broken = asked[~(np.isfinite(asked) & (asked == np.floor(asked)))]
        if broken.size:
            raise refusal(f"there is no row {broken[0]}: numbers of rows are whole")
    outside = asked[(asked < -rows) | (asked >= rows)]
    if outside.size:
        raise IndexError(f"there is no row {outside[0]}, the dataset has {rows}")
    return asked.astype(np.int64)


def share(test: float) -> float:
    """The share of groups that a split holds out: each side has something."""
    if not 0 < test < 1:
        hint = "test=0.2 holds out a fifth of the groups"
        raise refusal(f"test = {test} is no share of the groups: it must be above 0 and below 1", hint)
    return test


def own_rank(rank: int, world_size: int) -> int:
    """The rank of this process among those that share the rows."""
    if not 0 <= rank < world_size:
        hint = "two processes have the ranks 0 and 1 of world_size=2"
        raise refusal(f"rank = {rank} of world_size = {world_size}: ranks count from 0", hint)
    return rank


def rows_of_batch(batch_size: Any) -> int:
    """The size of a batch, which has one row at least."""
    try:
        size = operator.index(batch_size)
    except TypeError:
        size = 0
    if size < 1:
        raise refusal(f"batch_size = {batch_size!r}, it must be a whole number, 1 at least")
    return size
