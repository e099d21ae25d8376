"""One epoch of a small network from `gg.stream` beside the same from a run on disk: the same losses to the bit, and what each takes.

    python benches/epoch.py            # needs numpy and the installed package

The network has the sizes of `examples/train_grip_metric.py`'s input (40 x 30 pixels of both jaws), one hidden layer and plain gradient descent, in
numpy. For figures that mean something nothing else may run.
"""

import argparse
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

import gripgen as gg
import numpy as np

CONFIG = "asset:configs/quickstart.toml"
SHRINK = 8
BATCH = 32


def epoch(batches: Iterable) -> tuple[list[float], int]:
    """Losses of one pass, and how many samples it saw."""
    rng = np.random.default_rng(0)
    inputs = 6 * (240 // SHRINK) * (320 // SHRINK)
    first = rng.normal(0, 1 / np.sqrt(inputs), (inputs, 64))
    second = rng.normal(0, 1 / 8, 64)
    losses, seen = [], 0
    for images, labels in batches:
        count, jaws, height, width, colours = images.shape
        small = images.reshape(count, jaws, height // SHRINK, SHRINK, width // SHRINK, SHRINK, colours).mean(axis=(3, 5), dtype=np.float32)
        x = small.reshape(count, -1) / 255.0 - 0.5
        slipped = np.isfinite(labels)
        hidden = np.maximum(x @ first, 0.0)
        error = np.where(slipped, hidden @ second - np.nan_to_num(labels) / 10.0, 0.0)
        losses.append(float(np.mean(error**2)))
        back = np.outer(error, second) * (hidden > 0)
        second -= 1e-3 * hidden.T @ error / count
        first -= 1e-3 * x.T @ back / count
        seen += count
    return losses, seen


def timed(name: str, batches: Iterable) -> list[float]:
    """An epoch, and its line of the table."""
    start = time.perf_counter()
    losses, seen = epoch(batches)
    took = time.perf_counter() - start
    print(f"{name:34} {took:8.2f} {seen / took:10.0f} {losses[0]:10.5f} {losses[-1]:10.5f}")
    return losses


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1600)
    options = parser.parse_args()
    keys = {"mechanics": "reduced", "design": "random", "samples": options.samples, "trace": "none"}
    print(f"{'epoch':34} {'seconds':>8} {'samples/s':>10} {'first loss':>10} {'last loss':>10}")
    streamed = timed("streamed", gg.stream(CONFIG, batch_size=BATCH, set=keys))
    with tempfile.TemporaryDirectory() as folder:
        for images in ("png", "clean"):
            run = Path(folder) / images
            start = time.perf_counter()
            gg.sweep(CONFIG, run, set=keys | {"images": images})
            print(f"{f'sweep, {images}':34} {time.perf_counter() - start:8.2f}")
            run_set = gg.load(run)
            rows = [range(i, min(i + BATCH, len(run_set))) for i in range(0, len(run_set), BATCH)]
            stored = timed(f"from disk, {images}", (run_set.batch(r, threads=2) for r in rows))
            if stored != streamed:
                raise SystemExit(f"losses differ: {stored[:3]} from disk, {streamed[:3]} streamed")
    print("all losses are equal to the bit")


if __name__ == "__main__":
    main()
