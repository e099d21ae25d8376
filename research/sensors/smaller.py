"""A sensor file in pixels `factor` times as wide, its rest frame in whole grey levels.

    python research/sensors/smaller.py sensor.npz smaller.npz --factor 2

A pixel of the new file is the mean of `factor` x `factor` of the old one: noise that differs from pixel to pixel falls by the factor, and a
kernel becomes the odd number next to its share. Colours, limits and the gel of a file of gripgen's own regression do not depend on pixels.
A factor of 1 only rounds the rest frame: fractions of a grey level make up nine tenths of a file.
"""

import argparse
from pathlib import Path

import numpy as np


def smaller(arrays: dict[str, np.ndarray], factor: int) -> dict[str, np.ndarray]:
    rest = arrays["rest_rgb"].astype(np.float64)
    rows, columns = (n // factor for n in rest.shape[:2])
    cells = rest[: rows * factor, : columns * factor].reshape(rows, factor, columns, factor, 3)
    kernels = [2 * round((k / factor - 1) / 2) + 1 for k in arrays["kernels_px"]]
    return {
        **arrays,
        "mm_per_px": arrays["mm_per_px"] * factor,
        "rest_rgb": np.rint(cells.mean(axis=(1, 3))).astype(np.uint8),
        "noise_rgb": arrays["noise_rgb"] / factor,
        "kernels_px": np.array(kernels, dtype=np.float64),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("sensor", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--factor", type=int, default=1)
    given = parser.parse_args()
    with np.load(given.sensor) as file:
        arrays = {key: file[key] for key in file.files}
    np.savez_compressed(given.out, **smaller(arrays, given.factor))


if __name__ == "__main__":
    main()
