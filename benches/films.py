"""Films without a disk: frames a second that `gg.stream(video=True)` hands out, with and without markers in the gels.

    python benches/films.py            # needs numpy and the installed package

A frame is the image of one jaw with its cells, depths, shear and state. The marker sensor is the shipped one with a grid of dots. For figures
that mean something nothing else may run.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

import gripgen as gg
import numpy as np

SENSOR = Path(__file__).parent.parent / "assets/sensors/gelsight_synthetic/sensor.npz"
ELASTIC = {"young_modulus_mpa": 0.145, "poisson_ratio": 0.48}


def marked(path: Path, apart_px: int) -> str:
    """The shipped sensor with a dot of 4 px every so many pixels; returns its path for a twin."""
    arrays = dict(np.load(SENSOR))
    height, width = arrays["rest_rgb"].shape[:2]
    columns, rows = np.meshgrid(np.arange(apart_px, width - 8, apart_px), np.arange(apart_px, height - 8, apart_px))
    dots = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)
    np.savez(path, **arrays, marker_px=dots, marker_radius_px=4.0, marker_darkness_rgb=np.full(3, 0.6))
    return str(path)


def rate(seconds: float, keys: dict) -> tuple[float, float]:
    """Frames and pulls a second of a stream, after its first batch."""
    stream = iter(gg.stream("asset:configs/quickstart.toml", batch_size=4, video=True, set=keys))
    next(stream)
    start, frames, pulls = time.perf_counter(), 0, 0
    while time.perf_counter() - start < seconds:
        films = next(stream).films
        frames += sum(2 * len(film) for film in films if film is not None)
        pulls += len(films)
    took = time.perf_counter() - start
    return frames / took, pulls / took


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=15.0)
    options = parser.parse_args()
    base = {
        "mechanics": "reduced",
        "design": "random",
        "samples": 10**6,
        "trace": "none",
        "images": {"storage": "clean", "during_pull": {"frames": 24}},
    }
    with tempfile.TemporaryDirectory() as folder:
        sensor = marked(Path(folder) / "marked.npz", 24)
        dots = {f"optics.{jaw}.sensor": sensor for jaw in ("left", "right")}
        moving = {f"gel.{jaw}.{key}": value for jaw in ("left", "right") for key, value in ELASTIC.items()}
        print(f"{os.cpu_count()} threads\n{'film of 24 frames':24} {'frames/s':>10} {'pulls/s':>10}")
        for name, keys in [("no markers", {}), ("markers", {**dots, **moving})]:
            frames, pulls = rate(options.seconds, {**base, **keys})
            print(f"{name:24} {frames:10.0f} {pulls:10.1f}")


if __name__ == "__main__":
    main()
