"""python -m research.peers.table FOLDER --out RECORDS [--tools fdr,gp,...] [--only c000,c001]

Runs the methods on the campaigns of FOLDER, one after the other, adds their records to RECORDS/METHOD.json and prints
the table of all that lie there. GRIPGEN_BIN names the binary for `gripgen` and `gripgen-model` (`--engine model`, names
alone). Errors of `gripgen` on unseen pulls take the exact simulation and are measured in every third campaign.
"""

import argparse
import json
import os
from functools import partial
from pathlib import Path

import numpy as np

from research.blind import baselines, judge, runner, scorer

from .declared import declared
from .methods import discovery, ridge, symbolic

LIMIT_S = 240
ERRORS_EVERY = 3
RATE, CLOCK, FORCE = ["force_increment_n", "step_time_s"], ["pull_index", "time_s", "session"], ["grip_force_n"]
# Columns of the table through which an effect acts; those of no column are left out of the second table.
ACTS_BY = {
    "load_offset": FORCE, "load_power_law": FORCE, "area_saturation": FORCE, "regime_transition": FORCE, "grip_force_loss": FORCE,
    "sensor_quadratic": FORCE, "sensor_saturation": FORCE, "sensor_hysteresis": FORCE, "rate_dependence": RATE,
    "sensor_lowpass": RATE, "sensor_creep": [*RATE, *FORCE], "deadband": [*RATE, *FORCE], "dwell_ageing": ["dwell_s"],
    "grip_relaxation": ["dwell_s"], "anisotropy": ["grip_angle_deg"], "contamination": CLOCK, "wear": CLOCK, "conditioning": CLOCK,
    "sensor_drift": [*CLOCK, "pull_direction"], "sensor_gain_drift": CLOCK, "temperature": ["temperature_c", *CLOCK],
    "jaw_tilt": ["pull_direction"], "sensor_bias": ["pull_direction", *FORCE], "off_centre": ["grip_offset_mm"],
}


def cpu(tool):
    """The same tool with the processor seconds it and its children took."""

    def run(*arguments):
        before = sum(os.times()[:4])
        answer = tool(*arguments)
        answer.seconds = sum(os.times()[:4]) - before
        return answer

    return run


def gripgen(folder, unseen, work, engine=None):
    """The tool itself, through the runner of the benchmark; another engine by a script in the place of the binary."""
    binary = os.environ.get("GRIPGEN_BIN", "gripgen")
    if engine:
        script = Path(work) / "gripgen.sh"
        script.parent.mkdir(parents=True, exist_ok=True)
        script.write_text(f'#!/bin/sh\n[ "$1" = diagnose ] && exec "{binary}" "$@" --engine {engine}\nexec "{binary}" "$@"\n')
        script.chmod(0o755)
        os.environ["GRIPGEN_BIN"] = str(script)
    errors = engine is None and int(folder.name[1:]) % ERRORS_EVERY == 0
    try:
        answer = cpu(runner.diagnose)(folder, unseen, work, LIMIT_S, False, errors)
    finally:
        os.environ["GRIPGEN_BIN"] = binary
    if errors:  # the time of the simulation is in it
        answer.seconds = float("nan")
    return answer


# What a method is told beforehand, and the method.
TOOLS = {
    "gripgen": ("formulas", gripgen), "gripgen-model": ("formulas", partial(gripgen, engine="model")),
    "declared": ("formulas", cpu(declared)), "declared-strict": ("formulas", cpu(partial(declared, level=1 - 0.05 / 27))),
    "fdr": ("terms", cpu(discovery)), "fdr-forward": ("terms", cpu(partial(discovery, forward=True))),
    "bic": ("terms", cpu(baselines.bic)), "stlsq": ("terms", cpu(baselines.stlsq)), "symbolic": ("columns", cpu(symbolic)),
    "gp": ("columns", cpu(baselines.gp)), "ridge": ("columns", cpu(ridge)),
}


def counts(truth, record):
    """Right names, and the same by columns: what is named acts through a column that the truth acts through."""
    acts = truth["acts"]
    library = [a for a in acts if a["library"]]
    accepted = [{judge._covariate(x) for x in a["accepted"]} for a in acts if not a["library"]]
    unknown = {judge._covariate(u) for u in record["unknown"]}
    entries = [{"name": n, "class": []} for n in record["named"]]
    true = [set(ACTS_BY.get(a["name"], [])) if a["library"] else {c for x in a["accepted"] for c in x.split("*")} for a in acts]
    said = [set(ACTS_BY.get(n, [])) for n in record["named"]] + [set(u.split("*")) for u in record["unknown"]]
    return {
        "library": len(library), "exact": sum(a["name"] in record["named"] for a in library),
        "by_class": judge._matched(library, entries), "outside": len(accepted), "outside_right": sum(bool(x & unknown) for x in accepted),
        "columns": sum(bool(t) for t in true), "columns_right": sum(any(t & s for s in said) for t in true),
        "columns_wrong": sum(bool(s) and not any(s & t for t in true) for s in said),
    }


def row(name, records, truths):
    """The cells of one method in both tables."""
    all_counts = {k: counts(truths[k], r) for k, r in records.items()}
    total = {key: sum(c[key] for c in all_counts.values()) for key in next(iter(all_counts.values()))}
    nothing = [r for r in records.values() if r["group"] == "A"]
    ratio = {k: r["ratio"] for k, r in records.items() if "ratio" in r and r["group"] in "ABCD"}
    third = [v for k, v in ratio.items() if int(k[1:]) % ERRORS_EVERY == 0]
    errors = ["-" if not r else f"{np.median(r):.2f}, {np.quantile(r, 0.9):.2f} ({len(r)})" for r in (third, [*ratio.values()])]
    if len(third) == len(ratio):
        errors[1] = "-"
    seconds, extra = ([r[key] for r in records.values()] for key in ("seconds", "extra"))
    false = sum(bool(r["named"] or r["unknown"]) for r in nothing)
    first = [name, TOOLS[name][0], len(records), f"{total['exact']}/{total['library']}", f"{total['by_class']}/{total['library']}",
             f"{total['outside_right']}/{total['outside']}", f"{np.mean(extra):.2f}",
             f"{false}/{len(nothing)}, {np.mean([r['extra'] for r in nothing]):.2f}", *errors, f"{np.nanmedian(seconds):.2f}, {np.nanmax(seconds):.1f}"]
    second = [name, f"{total['columns_right']}/{total['columns']}", f"{total['columns_wrong'] / len(all_counts):.2f}"]
    return first, second


HEADS = (["method", "told", "campaigns", "library effects named", "by class", "outside columns named", "too many, a campaign",
          "nothing acts: named something, too many a campaign", "error / floor in every third campaign: median, 90 % (campaigns)",
          "in all", "processor seconds: median, largest"], ["method", "columns right", "columns too many, a campaign"])


def table(place, truths, only):
    """Both tables in Markdown, of all records in `place`."""
    rows = []
    for name in TOOLS:
        if (place / f"{name}.json").is_file():
            records = json.loads((place / f"{name}.json").read_text(encoding="utf-8"))
            records = {k: r for k, r in records.items() if not only or k in only}
            if records:
                rows.append(row(name, records, truths))
    text = ""
    for i, head in enumerate(HEADS):
        text += "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in [head, ["---"] * len(head), *(r[i] for r in rows)]) + "\n\n"
    return text


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--out", required=True, help="folder of the records")
    parser.add_argument("--tools", default="", help="those to run, with commas; without, only the table is printed")
    parser.add_argument("--only", default="", help="comma list of campaign names")
    args = parser.parse_args(arguments)
    folder, place = args.folder.rstrip("/"), Path(args.out)
    place.mkdir(parents=True, exist_ok=True)
    only = [n for n in args.only.split(",") if n]
    for name in filter(None, args.tools.split(",")):
        records, _ = scorer.score(folder, place / f"{name}-work", TOOLS[name][1], 1, only)
        for key, record in records.items():
            if record["reason"]:
                print(f"{name} {key}: {record['reason']}")
        kept = place / f"{name}.json"
        before = json.loads(kept.read_text(encoding="utf-8")) if kept.is_file() else {}
        kept.write_text(json.dumps(dict(sorted((before | records).items())), indent=1) + "\n", encoding="utf-8")
    truths = {p.parent.name: json.loads(p.read_text(encoding="utf-8")) for p in Path(folder + "-sealed").glob("*/truth.json")}
    print(table(place, truths, only))


if __name__ == "__main__":
    main()
