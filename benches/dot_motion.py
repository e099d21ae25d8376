"""How dots of a gel move: measured while gripped objects were shaken, beside those of the films of pulls.

    python benches/dot_motion.py FOLDER        # needs numpy and the installed package; FOLDER holds NAME_dots.npz

An NPZ has tracks `cam0_xy_px`, `cam2_xy_px` of shape (readings, dots, 2), NaN where a dot was not seen. Each track is the motion of a gel over time;
compared is its first principal component, the field in which it moves most, in the parts mean, affine (the gel turns, stretches, is sheared) and rest.
No grip force, no force and no scale of the recordings is known, so that shapes are compared and no size.
"""

import argparse
import tempfile
from pathlib import Path

import gripgen as gg
import numpy as np
from films import ELASTIC, marked

APART_PX = 48  # dots of a GelSight Mini are some 40 px apart in such images


def field(track: np.ndarray) -> dict[str, float] | None:
    """Of float[T, M, 2]: what the field in which the dots move most looks like."""
    track = track[:, np.isfinite(track).all(axis=(0, 2))]
    if track.shape[0] < 4 or track.shape[1] < 12:
        return None
    place = track.mean(axis=0)
    moved = (track - place).reshape(len(track), -1)
    _, size, fields = np.linalg.svd(moved, full_matrices=False)
    # In pixels: the root mean square over time.
    first = (fields[0] * size[0] / np.sqrt(len(track))).reshape(-1, 2)
    mean = first.mean(axis=0)
    about = place - place.mean(axis=0)
    linear, *_ = np.linalg.lstsq(about, first - mean, rcond=None)
    rest = first - mean - about @ linear
    energy = (first**2).sum()
    later = track[2:] - 2 * track[1:-1] + track[:-2]
    return {
        "of the motion in the first field, %": 100 * size[0] ** 2 / (size**2).sum(),
        "spread about the mean over the mean": np.sqrt(((first - mean) ** 2).sum(axis=1).mean()) / np.linalg.norm(mean),
        "mean, % of the field": 100 * len(first) * (mean**2).sum() / energy,
        "affine, %": 100 * ((about @ linear) ** 2).sum() / energy,
        "rest, %": 100 * (rest**2).sum() / energy,
        "motion of the mean, px rms": float(np.linalg.norm(mean)),
        # Three readings in line: noise of a place has 1 + 4 + 1 times its variance.
        "jitter, px": float(np.median(np.abs(later)) * 1.4826 / np.sqrt(6)),
    }


def measured(folder: Path) -> list[dict[str, float]]:
    """One row for each camera of each recording."""
    tracks = [np.load(path)[name] for path in sorted(folder.glob("*_dots.npz")) for name in ("cam0_xy_px", "cam2_xy_px")]
    return [row for row in map(field, tracks) if row]


def simulated(pulls: int) -> list[dict[str, float]]:
    """One row for each jaw of each film of the shipped sweep's pulls, with an elastic gel and dots."""
    jaws = ("left", "right")
    with tempfile.TemporaryDirectory() as folder:
        sensor = marked(Path(folder) / "marked.npz", APART_PX)
        keys = {
            "mechanics": "reduced",
            "design": "random",
            "samples": pulls,
            "trace": "none",
            "images": {"storage": "clean", "during_pull": {"frames": 24}},
            **{f"optics.{jaw}.sensor": sensor for jaw in jaws},
            **{f"gel.{jaw}.{key}": value for jaw in jaws for key, value in ELASTIC.items()},
        }
        batches = gg.stream("asset:configs/quickstart.toml", batch_size=4, video=True, set=keys)
        films = [film for batch in batches for film in batch.films if film is not None]
    tracks = [film.markers_px[:, jaw].astype(float) for film in films for jaw in range(2)]
    return [row for row in map(field, tracks) if row]


def main() -> None:
    """The table: the middle of all and the range from 10 to 90 %."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pulls", type=int, default=40)
    options = parser.parse_args()
    both = [measured(options.folder), simulated(options.pulls)]
    print(f"| | measured, {len(both[0])} tracks | films, {len(both[1])} tracks |\n|---|---|---|")
    for name in both[1][0]:
        cells = []
        for rows in both:
            low, middle, high = np.quantile([row[name] for row in rows], [0.1, 0.5, 0.9])
            cells.append(f"{middle:.2g} ({low:.2g} to {high:.2g})")
        print(f"| {name} | {cells[0]} | {cells[1]} |")


if __name__ == "__main__":
    main()
