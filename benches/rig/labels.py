"""How many labels of the virtual rig are off without a word: pulls under lag, drift and wrong zeros, over the wire.

    python benches/rig/labels.py --gripgen target/release/gripgen --work /tmp/labels --pulls 400

Each pull is one `gripgen rig pull` on a rig with a fault of its own, drawn from the seed: a lag of force mode or of the sensor or a dead time of up
to 0.5 s, a mass of up to 0.5 kg on the tool while the sensor is zeroed, a zero that drifts. Friction does not scatter, so the truth is the
label of the same grip without a fault. A label may be off by 0.5 N or 5 % of it. `--faultless` makes as many pulls without a
fault: how many of them are called suspect. Needs no package. `docs/rig.md` has the figures of one run.
"""

import argparse
import csv
import json
import random
import shutil
import subprocess
import threading
from collections import Counter
from pathlib import Path

from served import Rig

FORCES_N = [10, 15, 20, 30, 40]
PARTS = ["gear", "long_shaft", "ball_bearing", "roller_bearing"]


class Labelled(Rig):
    """A rig whose friction does not scatter, that makes one pull at a time."""

    def __init__(self, gripgen, folder):
        super().__init__(gripgen, folder, 20, [x for part in PARTS for x in ("--set", f"parts.{part}.scatter=0")])

    def pull(self, part, force_n, out, before="", after=""):
        """One pull; `before` is a fault until the jaws close, `after` from then on. Status, reason, label."""
        shutil.rmtree(out, ignore_errors=True)
        if before:
            self.fault(before)
        command = [self.gripgen, "rig", "pull", self.file, "--parts", part, "--grip-force-n", force_n, "-o", out, "-v", "--set", "limits.robot_gap_s=1.0"]
        process = subprocess.Popen([str(c) for c in command], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        for line in process.stderr:
            if after and "gripping" in line:
                self.fault(after)
        process.wait()
        if not (out / "index.csv").exists():
            return "refused", "", None
        with (out / "index.csv").open() as file:
            row = next(csv.DictReader(line for line in file if not line.startswith("#")))
        label = row.get("max_pull_force_n") or None
        return row["status"], row.get("failure") or "", float(label) if label else None


def drawn(rng):
    """A fault: its name, what is said before the grip, what when the jaws close, what takes it away."""
    kind = rng.choice(["force-lag", "sensor-lag", "force-delay", "hang", "drift", "lag and drift"])
    seconds, newtons = round(rng.uniform(0.0, 0.5), 3), rng.uniform(0.0, 5.0)
    if kind == "hang":
        return f"hang {newtons / 9.81:.3f}", f"hang {newtons / 9.81:.3f}", "hang 0", "hang 0"
    if kind == "drift":
        return f"drift {6 * newtons:.2f}", f"drift {6 * newtons:.2f}", "", "drift 0"
    if kind == "lag and drift":
        return f"force-lag {seconds} and drift {newtons:.2f}", f"force-lag {seconds}\ndrift {newtons:.2f}", "", "force-lag 0\ndrift 0"
    return f"{kind} {seconds}", f"{kind} {seconds}", "", f"{kind} 0"


def main():
    """Counts, and the labels that were off."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", default="gripgen")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--pulls", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faultless", action="store_true")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rng, rows, truth = random.Random(options.seed), [], {}
    with Labelled(options.gripgen, options.work) as rig:
        for part in PARTS:
            for force_n in FORCES_N:
                truth[part, force_n] = rig.pull(part, force_n, options.work / "run")
        for k in range(options.pulls):
            part, force_n = rng.choice(PARTS), rng.choice(FORCES_N)
            name, before, after, away = ("", "", "", "") if options.faultless else drawn(rng)
            status, reason, label_n = rig.pull(part, force_n, options.work / "run", before, after)
            if away:
                rig.fault(away)
            true_n = truth[part, force_n][2]
            row = {"part": part, "grip_force_n": force_n, "fault": name, "status": status, "reason": reason, "label_n": label_n, "true_n": true_n}
            rows.append(row)
            print(json.dumps(row), flush=True)
    (options.work / "rows.json").write_text(json.dumps(rows, indent=1))
    plain = [r for r in rows if r["status"] == "slipped" and r["label_n"] is not None and r["true_n"] is not None]
    off = [r for r in plain if abs(r["label_n"] - r["true_n"]) > max(0.5, 0.05 * r["true_n"])]
    far = [r for r in plain if abs(r["label_n"] - r["true_n"]) > 3 * max(0.5, 0.05 * r["true_n"])]
    print(dict(Counter(r["status"] for r in rows)))
    print(f"{len(plain)} plain labels, {len(off)} off by more than 0.5 N or 5 %, {len(far)} by three times that")


if __name__ == "__main__":
    main()
