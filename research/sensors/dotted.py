"""A sensor file with dots on its gel: those of a regular grid, drawn into the frame at rest.

    python research/sensors/dotted.py sensor.npz dotted.npz --columns 9 --rows 7 --pitch-mm 2.8 --radius-mm 0.4 --darkness 0.7

A dot takes the same share of each colour, with a soft edge of one pixel, as `crates/tactile/src/markers.rs` draws it where it moves.
"""

import argparse
from pathlib import Path

import numpy as np


def dotted(arrays: dict[str, np.ndarray], columns: int, rows: int, pitch_mm: float, radius_mm: float, darkness: float) -> dict[str, np.ndarray]:
    rest = arrays["rest_rgb"].astype(np.float64)
    height, width = rest.shape[:2]
    mm_per_px = float(arrays["mm_per_px"])
    pitch, radius = pitch_mm / mm_per_px, radius_mm / mm_per_px
    across = (width - 1) / 2 + (np.arange(columns) - (columns - 1) / 2) * pitch
    down = (height - 1) / 2 + (np.arange(rows) - (rows - 1) / 2) * pitch
    centres = np.array([(x, y) for y in down for x in across])
    y, x = np.mgrid[:height, :width]
    cover = np.zeros((height, width))
    for cx, cy in centres:
        cover = np.maximum(cover, np.clip(radius + 0.5 - np.hypot(x - cx, y - cy), 0, 1))
    return {
        **arrays,
        "rest_rgb": np.rint(rest * (1 - darkness * cover[:, :, None])).astype(np.uint8),
        "marker_px": centres,
        "marker_radius_px": np.float64(radius),
        "marker_darkness_rgb": np.full(3, darkness),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("sensor", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--columns", type=int, default=9)
    parser.add_argument("--rows", type=int, default=7)
    parser.add_argument("--pitch-mm", type=float, default=2.8)
    parser.add_argument("--radius-mm", type=float, default=0.4)
    parser.add_argument("--darkness", type=float, default=0.7)
    given = parser.parse_args()
    with np.load(given.sensor) as file:
        arrays = {key: file[key] for key in file.files}
    made = dotted(arrays, given.columns, given.rows, given.pitch_mm, given.radius_mm, given.darkness)
    np.savez_compressed(given.out, **made)


if __name__ == "__main__":
    main()
