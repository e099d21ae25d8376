"""What sixty pulls without images are worth to a network: before, with the diagnosed twin, and with its whole posterior.

    pip install '.[train]'
    python examples/close_the_loop.py --work runs/close-the-loop

A rig does something that the twin does not know. A network is trained on the twin and meets the rig. Then the rig makes sixty pulls, no image
among them; `gripgen diagnose` says what the twin lacks, and two new sweeps are made: of the one twin that it writes, and of draws from its
posterior, cause and parameters together (docs/few-pulls.md). A network is trained on each and meets the same grips of the rig. The rig is
simulated. `docs/training.md` has the figures of one run with `--samples 1500 --epochs 12 --test 500`; with the defaults it takes several times as long.
"""

import argparse
import csv
import json
import subprocess
import sys
import time
from pathlib import Path

import gripgen as gg
import numpy as np
from train_grip_metric import Arrays, data, errors, scores, show, train

BASELINE = "asset:configs/twin-baseline.toml"
# What the rigs do and the twin does not know. The first shows in images, the others do not.
RIGS = {
    "off-centre grips hold less": [{"name": "off_centre", "inverse_lever_per_mm": 0.2}],
    "light grips hold more": [{"name": "load_offset", "b_n": 9.0}],
    "light grips of the gear hold less, and off-centre grips": [{"name": "load_offset", "part": "gear", "b_n": -7.0}, {"name": "off_centre", "inverse_lever_per_mm": 0.15}],
}


def campaign(work: Path, effects: list[dict[str, object]], pulls: int, seed: int) -> Path:
    """Pulls without images on a rig with these effects; returns their folder."""
    folder = work / "campaign"
    if not folder.exists():
        inline = ", ".join("{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in e.items()) + " }" for e in effects)
        command = [sys.executable, "-m", "gripgen", "campaign", "--pulls", str(pulls), "--seed", str(seed), "--offsets-mm=-6,-3,0,3,6"]
        command += ["--quiet", "--set", f"effects=[{inline}]", "--out", str(work / "campaign.toml"), "--force", "--simulate", str(folder)]
        subprocess.run(command, check=True)
    return folder


def line_of_pulls(folder: Path, test: Arrays) -> dict[str, float]:
    """The baseline without images and without a twin: a force per newton of grip force of each part, fitted to the same pulls."""
    with (folder / "pulls.csv").open(encoding="utf-8") as file:
        pulls = list(csv.DictReader(file))
    found = np.empty(len(test.part))
    for part in set(test.part):
        own = [pull for pull in pulls if pull["part"] == part] or pulls
        force_n, label_n = (np.array([float(pull[key]) for pull in own]) for key in ("grip_force_n", "max_pull_force_n"))
        at = test.part == part
        found[at] = test.force_n[at] * (force_n @ label_n) / (force_n @ force_n)
    return scores(found, test.labels.numpy())


def average(rows: list[dict[str, float]]) -> dict[str, float]:
    """The mean of each figure."""
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def main() -> None:
    """One table for each rig, and their mean."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("runs/close-the-loop"))
    parser.add_argument("--pulls", type=int, default=60)
    parser.add_argument("--samples", type=int, default=4000, help="samples of each sweep")
    parser.add_argument("--test", type=int, default=1000, help="grips of the rig, with images, to test on")
    parser.add_argument("--epochs", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    started = time.time()

    before = train(Arrays(data(options.work, "before", BASELINE, options.samples, 1)), options.epochs, options.seed)
    tables: dict[str, dict[str, dict[str, float]]] = {}
    for number, (name, effects) in enumerate(RIGS.items()):
        work = options.work / f"rig-{number}"
        work.mkdir(exist_ok=True)
        test = Arrays(data(work, "rig", BASELINE, options.test, 100 + number, effects=effects))
        found = gg.diagnose(campaign(work, effects, options.pulls, options.seed + number), out=work / "diagnosed.toml", force=True)
        print(f"\n{name}: {options.pulls} pulls without images say {found.verdict}, {', '.join(found.names) or 'no name'}")
        twin = str((work / "diagnosed.toml").resolve())
        rows = {"no network: a F_G by part, of the pulls": line_of_pulls(work / "campaign", test), "before": errors(before, test)}
        for kind, more in {"the diagnosed twin": {}, "draws from the posterior": {"vary.twin": {"from": "posterior"}}}.items():
            folder = kind.rsplit(" ", 1)[-1]
            after = train(Arrays(data(work, folder, twin, options.samples, 3, **more)), options.epochs, options.seed)
            rows[f"after, {kind}"] = errors(after, test)
        tables[name] = rows
        show(f"Rig {number}: {name}", rows)
    mean = {row: average([rows[row] for rows in tables.values()]) for row in next(iter(tables.values()))}
    show("Mean of the rigs", mean)
    print(f"\n{time.time() - started:.0f} s")
    (options.work / "figures.json").write_text(json.dumps(tables, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
