"""Dots on a gel: where they are in an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Diameter of the disc that closes the dots of an image 320 px wide; it has to be wider than a dot.
_CLOSING_PX = 19
#: Share of the light around it that a dot takes, at least.
_DARKER = 0.22
#: Pixels of a dot in an image 320 px wide.
_AREA_PX = (20, 220)


def dots(image: ArrayLike, rest: ArrayLike | None = None) -> NDArray[np.float64]:
    """Find the dark dots of a gel in an image (H, W, 3).

    Returns their centres in pixels, float64[N, 2]: column and row, counted from the centre of the first pixel, row by row. A centre is that of
    the light that the dot takes.

    With `rest`, the centres of an image without contact, it follows each of them: float64[len(rest), 2] in the order of `rest`, NaN where a
    dot is not seen. Dots are told apart as long as they move by less than half the distance to their neighbours.

    What is dark enough and large enough is a dot: a share of 0.22 less than the brightest channel around it, 20 to 220 px in an image 320 px
    wide.
    """
    pixels = np.asarray(image)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ValueError(f"the image has the shape {pixels.shape}, it must be (rows, columns, 3)")
    light = pixels.max(axis=2).astype(np.float32)
    scale = light.shape[1] / 320
    closed = -_widened(-_widened(light, _CLOSING_PX * scale / 2), _CLOSING_PX * scale / 2)
    taken = (closed - light) / np.maximum(closed, 1)
    least, most = (area * scale**2 for area in _AREA_PX)
    found = [
        centre
        for rows, columns in _islands(taken > _DARKER)
        if least <= len(rows) <= most
        for centre in [_centre(taken, rows, columns)]
    ]
    centres = np.array(found, dtype=np.float64).reshape(-1, 2)
    if rest is None:
        return centres
    return _followed(centres, np.asarray(rest, dtype=np.float64).reshape(-1, 2))


def _widened(plane: NDArray[np.float32], radius_px: float) -> NDArray[np.float32]:
    """The largest value within a disc; the border is continued."""
    reach = int(radius_px)
    padded = np.pad(plane, reach, mode="edge")
    height, width = plane.shape
    most = np.full_like(plane, -np.inf)
    for dy in range(-reach, reach + 1):
        half = int(np.sqrt(radius_px**2 - dy**2))
        rows = padded[reach + dy : reach + dy + height]
        # The largest of 2 half + 1 neighbours, by doubling.
        length, run = 1, rows
        while 2 * length <= 2 * half + 1:
            run = np.maximum(run[:, :-length], run[:, length:])
            length *= 2
        rest = 2 * half + 1 - length
        if rest:
            run = np.maximum(run[:, :-rest], run[:, rest:])
        np.maximum(most, run[:, reach - half : reach - half + width], out=most)
    return most


def _islands(mask: NDArray[np.bool_]) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Rows and columns of each set of pixels that touch along a side, in the order of their first pixels."""
    label = np.where(mask, np.arange(1, mask.size + 1).reshape(mask.shape), 0)
    # Each pixel takes the smallest number that it touches, until nothing changes: a dot is a few pixels wide.
    while True:
        new = label.copy()
        for axis, ahead in ((0, slice(1, None)), (1, slice(1, None))):
            a = [slice(None)] * 2
            b = [slice(None)] * 2
            a[axis], b[axis] = slice(None, -1), ahead
            first, second = tuple(a), tuple(b)
            both = mask[first] & mask[second]
            lower = np.minimum(new[first], new[second])
            new[first] = np.where(both, lower, new[first])
            new[second] = np.where(both, np.minimum(lower, new[second]), new[second])
        if np.array_equal(new, label):
            break
        label = new
    rows, columns = np.nonzero(mask)
    _, number = np.unique(label[rows, columns], return_inverse=True)
    order = np.argsort(number, kind="stable")
    ends = np.cumsum(np.bincount(number)) if len(rows) else []
    starts = [0, *ends[:-1]] if len(rows) else []
    return [(rows[order[a:b]], columns[order[a:b]]) for a, b in zip(starts, ends, strict=True)]


def _centre(taken: NDArray[np.float32], rows: NDArray[np.int64], columns: NDArray[np.int64]) -> tuple[float, float]:
    weight = taken[rows, columns].astype(np.float64)
    weight /= weight.sum()
    return float(weight @ columns), float(weight @ rows)


def _followed(centres: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """The centre that belongs to each dot at rest: nearest pairs first, at most half the distance of neighbours at rest."""
    found = np.full(rest.shape, np.nan)
    if len(centres) == 0 or len(rest) == 0:
        return found
    between = np.linalg.norm(rest[:, None] - rest[None], axis=2)
    np.fill_diagonal(between, np.inf)
    most = between.min(axis=1) / 2 if len(rest) > 1 else np.full(1, np.inf)
    apart = np.linalg.norm(rest[:, None] - centres[None], axis=2)
    for pair in np.argsort(apart, axis=None, kind="stable"):
        dot, centre = np.unravel_index(pair, apart.shape)
        if not np.isfinite(apart[dot, centre]):
            break
        if apart[dot, centre] <= most[dot]:
            found[dot] = centres[centre]
            apart[dot, :] = np.inf
            apart[:, centre] = np.inf
    return found
