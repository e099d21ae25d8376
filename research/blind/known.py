"""python -m research.blind.known FOLDER

What a fit reaches that is told the formula and its constants (world `l`): it has the size of the effect, the friction of each
part and an offset left to find, from the labels alone, by plain robust least squares: a yardstick for after / floor of `regret.py`, no bound.
"""

import argparse
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from . import baselines, literature

BAD = 3.0
"""Robust deviations from which on a label counts less."""

SIZES = 81
"""Sizes that are tried, from nothing to twice the largest of the formula."""


def log_factor(name, size, constants, table):
    """Logarithm of what a formula does to the friction of each pull; None where it acts on readings or on what is not in the table."""
    n = len(table["grip_force_n"])
    pulls = SimpleNamespace(ledger=table, mu=np.ones((n, 1)), normal_n=np.ones((n, 1)), sensor=[])
    try:
        literature.BOOK[name][0](pulls, size, constants)
    except KeyError:
        return None
    return None if pulls.sensor else np.log(pulls.mu * pulls.normal_n)[:, 0]


def _levels(table, parts):
    """Columns of the levels of the parts, and of an offset of the force."""
    return np.column_stack([table["part"] == p for p in parts] + [1 / table["grip_force_n"]]).astype(float)


def _robust(x, y, weight):
    """Coefficients by least squares with bad rows weighed down, and how unlikely what is left is."""
    w = weight
    for _ in range(20):
        found = np.linalg.lstsq(x * w[:, None], y * w, rcond=None)[0]
        error = (y - x @ found) * weight
        deviation = 1.4826 * np.median(np.abs(error)) + 1e-6
        w = weight / np.sqrt(1 + (error / (BAD * deviation)) ** 2)
    return found, np.sum(np.log1p((error / (BAD * deviation)) ** 2)) + 2 * len(y) / BAD**2 * np.log(deviation)


def error_n(folder, expected, act):
    """Root mean square error on the expected labels; None where nothing in the table shows the effect."""
    train, test = baselines.read(folder), baselines.read(expected)
    parts = sorted(set(train["part"]))
    y = np.log(train["max_pull_force_n"] / train["grip_force_n"])
    weight = 1 / np.hypot(0.04, 0.3 / train["max_pull_force_n"])
    best = None
    for size in np.linspace(0, 2 * literature.BOOK[act["name"]][2], SIZES):
        acts = log_factor(act["name"], size, act["constants"], train)
        if acts is None:
            return None
        found, cost = _robust(_levels(train, parts), y - acts, weight)
        if best is None or cost < best[0]:
            best = (cost, size, found)
    _, size, found = best
    predicted = test["grip_force_n"] * np.exp(log_factor(act["name"], size, act["constants"], test) + _levels(test, parts) @ found)
    return float(np.sqrt(np.mean((predicted - test["max_pull_force_n"]) ** 2)))


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    folder = Path(parser.parse_args(arguments).folder)
    sealed = Path(f"{folder}-sealed")
    ratios = []
    for place in sorted(p for p in folder.iterdir() if (p / "pulls.csv").is_file()):
        truth = json.loads((sealed / place.name / "truth.json").read_text(encoding="utf-8"))
        act = next(iter(truth["acts"]), None)
        if act is None or act["name"] not in literature.BOOK:
            continue
        error, floor = error_n(place, sealed / place.name / "expected", act), truth["floor_rmse_n"]
        if error is not None:
            ratios.append(np.hypot(error, floor) / floor)
            print(f"{place.name} {act['name']}: {error:.3f} N, after / floor {ratios[-1]:.3f}")
    if ratios:
        print(f"{len(ratios)} campaigns: {np.median(ratios):.3f} in the middle, {np.quantile(ratios, 0.9):.3f} at 90 %")


if __name__ == "__main__":
    main()
