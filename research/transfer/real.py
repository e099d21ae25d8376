"""W3: real grasps of known force with one sensor (no pulls): the force from one image, by networks that never saw the sensor."""

import csv
from pathlib import Path

import numpy as np
from PIL import Image

from research.transfer.contact import VIEW
from research.transfer.features import of_images
from research.transfer.network import Network, Rows
from research.transfer.scores import factor, rmse

GIVEN, DEVELOPMENT = "golf_ball", "strawberry"
PIXELS = (VIEW[0] * 4, VIEW[1] * 4)  # 0.0875 mm each: cells as those of the training sets


def cells(path: Path) -> np.ndarray:
    """The middle of a frame, on cells of 0.35 mm."""
    frame = np.asarray(Image.open(path).convert("RGB"), dtype=np.float32)
    top, left = ((a - b) // 2 for a, b in zip(frame.shape[:2], PIXELS))
    cut = frame[top:top + PIXELS[0], left:left + PIXELS[1]]
    return cut.reshape(VIEW[0], 4, VIEW[1], 4, 3).mean((1, 3))


def grasps(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Features, forces, objects and grasps of the frames under load."""
    with (folder / "frames.csv").open() as stream:
        frames = list(csv.DictReader(stream))
    rest = {f["grasp"]: cells(folder / f["image"]) for f in frames if f["what"] == "rest"}
    used = [f for f in frames if f["what"] not in ("rest", "after") and f["force_n"] and float(f["force_n"]) >= 4]
    change = np.stack([cells(folder / f["image"]) - rest[f["grasp"]] for f in used])
    names = np.array([f["grasp"] for f in used])
    objects = np.array(["_".join(n.split("_")[1:-1]) for n in names])
    return of_images(change), np.array([float(f["force_n"]) for f in used]), objects, names


def report(folder: Path, training: dict[str, dict[str, np.ndarray]], seeds: int) -> str:
    """A table: RMSE by object, as it is and with one factor from the golf ball."""
    x, force_n, objects, names = grasps(folder)
    groups = {"golf ball (given)": np.char.find(objects, GIVEN) >= 0, "strawberry (development)": np.char.find(objects, DEVELOPMENT) >= 0}
    groups["others (test)"] = ~np.any(list(groups.values()), axis=0)
    golf = groups["golf ball (given)"]
    text = f"\n### W3: force of one jaw from one image, RMSE in N ({len(names)} frames of {len(set(names))} grasps)\n\n"
    text += "| objects | frames | mean of the golf ball | " + " | ".join(f"{n}, k = 0 | {n}, one factor | {n}, correlation" for n in training) + " |\n"
    text += "|---" * (3 + 3 * len(training)) + "|\n"
    found = {}
    for name, table in training.items():
        both, twice = np.concatenate([table["jaw"], table["jaw_other"]]), np.tile(table["force_n"], 2)
        found[name] = np.mean([Network(Rows(both, twice, np.zeros(len(twice), bool), np.zeros(len(twice), int)), s, (0.3, 0.1))(x).expected_n() for s in range(seeds)], 0)
    for group, at in groups.items():
        row = [group, str(at.sum()), f"{rmse(force_n[at] - force_n[golf].mean()):.1f}"]
        for p in found.values():
            a = factor(p[golf], force_n[golf])
            row += [f"{rmse(force_n[at] - p[at]):.1f}", f"{rmse(force_n[at] - a * p[at]):.1f}", f"{np.corrcoef(p[at], force_n[at])[0, 1]:.2f}"]
        text += "| " + " | ".join(row) + " |\n"
    return text
