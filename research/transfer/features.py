"""Features of tactile images that survive a change of optics.

Input is the change from the frame at rest on cells of 0.35 mm. Directions and colours of lights differ from sensor to sensor; where
the picture changes, and about how much, differs less. No feature uses a direction or a channel by itself.
"""

import numpy as np
from scipy.ndimage import binary_fill_holes, gaussian_filter, maximum_filter, minimum_filter

from research.transfer.contact import CELL_MM

LEVELS = (3.0, 6.0, 12.0, 24.0, 48.0)  # grey levels, all channels together
CLOSED_AT = (6.0, 14.0)  # levels whose outlines are closed and filled
COARSE_MM = 2 * CELL_MM  # outlines are drawn on coarser cells
IN_PLANE = np.array([[[0] * 3] * 3, [[0, 1, 0], [1, 1, 1], [0, 1, 0]], [[0] * 3] * 3], bool)


def other_lights(change: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same presses under other lights, each image its own: another gain, another mixture of the channels."""
    turn, _ = np.linalg.qr(rng.standard_normal((len(change), 2, 3, 3)))
    gain = np.exp(rng.normal(0, 0.35, (len(change), 2, 1, 1)) + rng.normal(0, 0.3, (len(change), 2, 1, 3)))
    return np.einsum("njyxc,njcd->njyxd", change.astype(np.float32), (turn * gain).astype(np.float32), optimize=True)


def strength(change: np.ndarray) -> np.ndarray:
    """How much each cell changes, with what changes everywhere taken off: [images, rows, columns]."""
    found = change.astype(np.float32)
    found = found - np.median(found, axis=(1, 2), keepdims=True)
    return gaussian_filter(np.sqrt((found**2).sum(-1)), (0, 0.7, 0.7))


def outlines(mask: np.ndarray) -> np.ndarray:
    """Size and form of regions [N, rows, columns] of coarse cells: area, axes, distance of the middle, share at the border, outline."""
    closed = minimum_filter(maximum_filter(mask, (1, 3, 3), mode="nearest"), (1, 3, 3), mode="nearest") | mask
    filled = binary_fill_holes(closed, IN_PLANE).astype(np.float32)
    cells = filled.sum((1, 2))
    some = np.maximum(cells, 1)
    y, x = np.meshgrid(*(np.arange(n) - n / 2 + 0.5 for n in mask.shape[1:]), indexing="ij")
    mx, my = (filled * x).sum((1, 2)) / some, (filled * y).sum((1, 2)) / some
    xx, yy = (filled * x * x).sum((1, 2)) / some - mx**2, (filled * y * y).sum((1, 2)) / some - my**2
    xy = (filled * x * y).sum((1, 2)) / some - mx * my
    middle, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    long, short = (0.5 * np.log(np.clip(v, 0.05, None)) for v in (middle + half, middle - half))
    border = np.concatenate([filled[:, 0], filled[:, -1], filled[:, :, 0], filled[:, :, -1]], 1).mean(1)
    around = (np.diff(filled, axis=1) != 0).sum((1, 2)) + (np.diff(filled, axis=2) != 0).sum((1, 2))
    away = np.hypot(mx, my) * COARSE_MM / 5
    area, solid = (np.log1p(n * COARSE_MM**2) for n in (cells, closed.sum((1, 2))))
    return np.column_stack([area, long, short, away, border, np.log1p(around * COARSE_MM), solid])


def of_images(change: np.ndarray) -> np.ndarray:
    """Features of single images [N, rows, columns, 3]: [N, K]."""
    found = []
    for first in range(0, len(change), 256):
        c = strength(change[first:first + 256])
        areas = [np.log1p((c > level).sum((1, 2)) * CELL_MM**2) for level in LEVELS]
        top = np.quantile(c, 0.98, axis=(1, 2))
        half = np.log1p((c > 0.4 * np.maximum(top, 6)[:, None, None]).sum((1, 2)) * CELL_MM**2)
        # The sum of the slopes over the length of the outline goes with the depth of the press.
        total = np.log1p(np.clip(c - 2, 0, None).sum((1, 2)) * CELL_MM**2)
        coarse = c.reshape(len(c), c.shape[1] // 2, 2, c.shape[2] // 2, 2).mean((2, 4))
        forms = np.concatenate([outlines(coarse > level) for level in CLOSED_AT], 1)
        depth = total - np.logaddexp(0, forms[:, 5])
        found.append(np.column_stack([*areas, np.log1p(top), half, total, depth, forms]))
    return np.concatenate(found)


def of_grips(change: np.ndarray) -> np.ndarray:
    """Features of both images of grips [N, 2, rows, columns, 3]: mean and difference of the jaws, whichever is which."""
    n = len(change)
    both = of_images(change.reshape(2 * n, *change.shape[2:])).reshape(n, 2, -1)
    return np.concatenate([both.mean(1), np.abs(both[:, 0] - both[:, 1])], 1)


def of_contact(area_mm2: np.ndarray, depth_mm: np.ndarray) -> np.ndarray:
    """What an oracle sees in the place of images: true area and press depth of each jaw."""
    both = np.stack([np.log(np.clip(area_mm2, 0.5, None)), np.log(np.clip(depth_mm, 0.01, None))], -1)
    return np.concatenate([both.mean(1), np.abs(both[:, 0] - both[:, 1])], 1)
