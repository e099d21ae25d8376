"""Writes campaigns as folders, and the sealed truth beside them."""

import csv
import hashlib
import json
from pathlib import Path

import numpy as np

from . import physics

COLUMNS = [
    ("pull_id", "{}"), ("part", "{}"), ("gel_id", "{}"), ("session", "{:d}"), ("grip_force_n", "{:.1f}"),
    ("force_increment_n", "{:g}"), ("step_time_s", "{:g}"), ("dwell_s", "{:.1f}"), ("pull_index", "{:d}"),
    ("time_s", "{:.1f}"), ("temperature_c", "{:.2f}"), ("grip_offset_mm", "{:.1f}"), ("grip_angle_deg", "{:.1f}"),
    ("pull_direction", "{:d}"),
]
FREE = {"humidity_pct": "{:.1f}", "table_mm": "{:.0f}", "operator": "{:d}", "supplier": "{}"}
EVERY = 5  # one trace row for five ticks of the label: 100 Hz


def measured_ledger(ledger, rng):
    """Covariates as a person would have logged them: with small errors."""
    n = len(ledger["pull_index"])
    seen = dict(ledger)
    seen["temperature_c"] = ledger["temperature_c"] + rng.normal(0, 0.05, n)
    seen["humidity_pct"] = ledger["humidity_pct"] + rng.normal(0, 0.5, n)
    seen["time_s"] = ledger["time_s"] + rng.uniform(-0.5, 0.5, n)
    seen["gel_id"] = [f"g{k}" for k in ledger["gel_number"]]
    return seen


def write_campaign(folder, seen, labels, free, prefix="p", feedback="independent"):
    """`pulls.csv` and `campaign.toml`; `feedback` is what the force loop closes on."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    columns = COLUMNS + [(name, FREE[name]) for name in free]
    with open(folder / "pulls.csv", "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow([name for name, _ in columns] + ["max_pull_force_n"])
        for i, value in enumerate(labels):
            row = [f"{prefix}{i:04d}"]
            row += [form.format(seen[name][i]) for name, form in columns[1:]]
            out.writerow(row + [f"{value:.3f}"])
    (folder / "campaign.toml").write_text(
        f'force_convention = "per_jaw"\nlabel_tolerance_n = 3.0\nstop_mm = 5.0\nfeedback = "{feedback}"\n',
        encoding="utf-8",
    )


def write_traces(folder, which, out, noisy, world, rng, prefix="p"):
    """Traces at 100 Hz with half a second of no-load reading before time 0."""
    folder = Path(folder) / "traces"
    folder.mkdir(exist_ok=True)
    for i in which:
        end = out["ends"][i]
        idle = out["idle"][i] + world.noise_n * rng.standard_normal(out["idle"].shape[1])
        force = np.concatenate([idle, noisy[i, :end]])[::EVERY]
        desired = np.concatenate([np.zeros_like(idle), out["desired"][i, :end]])[::EVERY]
        travel = np.concatenate([np.zeros_like(idle), out["travel"][i, :end]])[::EVERY]
        travel = travel + rng.normal(0, 0.006, len(travel))
        t = np.arange(len(force)) * EVERY * physics.TICK_S - physics.IDLE_S
        rows = np.stack([t, desired, force, travel], axis=1)
        with open(folder / f"{prefix}{i:04d}.csv", "w", encoding="utf-8") as file:
            file.write("time_s,desired_force_n,measured_force_n,displacement_mm\n")
            np.savetxt(file, rows, fmt=["%.3f", "%.2f", "%.3f", "%.4f"], delimiter=",")


def write_truth(path, truth):
    """Sealed file; returns its sha256."""
    text = json.dumps(truth, indent=1, sort_keys=True) + "\n"
    Path(path).write_text(text, encoding="utf-8")
    return hashlib.sha256(text.encode()).hexdigest()
