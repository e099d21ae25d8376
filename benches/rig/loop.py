"""How often the loop over the wire names what a rig has, and how often something where there is nothing.

    python benches/rig/loop.py --gripgen target/release/gripgen --work /tmp/loop --runs 120

Each run serves a virtual rig of its own with a lag of force mode of up to 0.2 s and a zero that drifts, which are a nuisance and no effect of the
grip, rehearses, pulls the campaign of 48 pulls that `gripgen campaign` plans, and diagnoses it. Every other rig has an undeclared effect. Names that no
design tells apart count as right (`HIDDEN`). Where something is hidden, `compare` gives the error on 24 pulls that no twin has seen, before and after.
One line of JSON a run, appended, so that a run can be continued. Needs no package. `research/loop/rig.md` has the figures of one run.
"""

import argparse
import json
import random
import shutil
import subprocess
from pathlib import Path

from served import PATIENT, Rig

SPEED = 50
# What is hidden, and the names under which it counts as found: those that labels of one campaign do not tell apart.
HIDDEN = {
    "load_offset": ('{{name="load_offset", a={a:.3f}, b_n={b:.3f}, fitted_grip_force_n=[2, 80], outside_fit="extrapolate"}}', {"load_offset", "grip_force_loss", "load_power_law"}),
    "dwell_ageing": ('{{name="dwell_ageing", beta={beta:.4f}}}', {"dwell_ageing"}),
    "wear": ('{{name="wear", depth={depth:.3f}, n0=20}}', {"wear", "conditioning"}),
    "rate_dependence": ('{{name="rate_dependence", k={k:.3f}}}', {"rate_dependence"}),
}


def drawn(rng, hidden):
    """The words of an effect, large enough to be seen by such a campaign."""
    if hidden is None:
        return ""
    sizes = {"a": 1.2, "b": -rng.uniform(2.5, 4.0), "beta": rng.uniform(0.05, 0.08), "depth": rng.uniform(0.3, 0.5), "k": rng.uniform(0.06, 0.1)}
    return HIDDEN[hidden][0].format(**sizes)


def one(gripgen, folder, number, drift_n_min):
    """One loop: nuisance, names, errors."""
    rng = random.Random(number)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    hidden = [None, sorted(HIDDEN)[number // 2 % len(HIDDEN)]][number % 2]
    lag_s, drift_n_min = round(rng.uniform(0.0, 0.2), 3), round(rng.uniform(0.0, drift_n_min), 2)
    line = {"run": number, "hidden": hidden, "effects": drawn(rng, hidden), "lag_s": lag_s, "drift_n_min": drift_n_min}

    def call(*words, fine=(0,)):
        done = subprocess.run([str(w) for w in [gripgen, *words]], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode not in fine:
            raise RuntimeError(f"{words[:3]}: {done.returncode}: {done.stderr.strip()[-400:]}")
        return done

    try:
        hide = ["--set", f"effects=[{line['effects']}]"] if hidden else []
        with Rig(gripgen, folder, SPEED, ["--seed", number, *hide]) as rig:
            rig.fault(f"force-lag {lag_s}")
            rig.fault(f"drift {drift_n_min}")
            call("rig", "rehearse", rig.file, "-o", "rehearsal.json", "-q", *PATIENT, fine=(0, 4))
            pull = ["rig", "pull", rig.file, "--rehearsal", "rehearsal.json", "-q", "--reconnect", "20", *PATIENT]
            call("campaign", "--rig", rig.file, "--pulls", 48, "--sessions", 1, "--seed", number, "-o", "first.toml", "-q")
            call(*pull, "--campaign", "first.toml", "-o", "first", fine=(0, 4))
            call("diagnose", "first", "-o", "after.toml", "--json", "found.json", "-q")
            found = json.loads((folder / "found.json").read_text(encoding="utf-8"))
            line |= {"verdict": found["verdict"], "named": [e["name"] for e in found["effects"]], "unknown": [u["covariate"] for u in found["unknown"]],
                     "tied": [[r["name"] for r in e["indistinguishable_from"]] for e in found["effects"]]}
            with (folder / "first" / "index.csv").open(encoding="utf-8") as file:
                line["suspect"] = sum(",suspect," in row for row in file)
            if hidden:
                call("campaign", "--rig", rig.file, "--pulls", 24, "--sessions", 1, "--seed", 1000 + number, "-o", "unseen.toml", "-q")
                call(*pull, "--campaign", "unseen.toml", "--after", "first", "-o", "unseen", fine=(0, 4))
                call("calibrate", "pulls", "first", "-o", "before.toml", "-q")
                for name in ("before", "after"):
                    call("compare", "unseen", "--twin", f"{name}.toml", "--json", f"{name}.json", "-q")
                    line[f"{name}_n"] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))["pulls"]["rmse_n"]
    except (RuntimeError, AssertionError, OSError, KeyError) as error:
        line["failed"] = f"{type(error).__name__}: {error}"
    return line


def right(line):
    """Whether the first name, or one tied with it, is what is hidden."""
    names = line["named"][:1] + [n for tied in line["tied"][:1] for n in tied]
    return bool(names) and bool(HIDDEN[line["hidden"]][1] & set(names))


def main():
    """The runs, and the counts over all of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", default="gripgen")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=120)
    parser.add_argument("--drift-n-min", type=float, default=1.0, help="the largest drift, N per minute")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    kept = options.work / "runs.jsonl"
    lines = [json.loads(text) for text in kept.read_text(encoding="utf-8").splitlines()] if kept.exists() else []
    for number in range(len(lines), options.runs):
        line = one(options.gripgen, options.work / "run", number, options.drift_n_min)
        lines.append(line)
        with kept.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        print(json.dumps(line), flush=True)
    done = [x for x in lines if "failed" not in x]
    plain, hidden = [x for x in done if not x["hidden"]], [x for x in done if x["hidden"]]
    named = [x for x in plain if x["verdict"] != "none"]
    print(f"{len(lines) - len(done)} runs failed")
    print(f"nothing hidden: {len(named)} of {len(plain)} with a name: {[x['named'] + x['unknown'] for x in named]}")
    print(f"something hidden: {sum(map(right, hidden))} of {len(hidden)} right, {sum(x['verdict'] == 'none' for x in hidden)} with nothing")
    for name in HIDDEN:
        of = [x for x in hidden if x["hidden"] == name]
        middle = [sorted(x[k] for x in of)[len(of) // 2] if of else float("nan") for k in ("before_n", "after_n")]
        print(f"  {name}: {sum(map(right, of))} of {len(of)}, error before {middle[0]:.2f} N, after {middle[1]:.2f} N (medians)")


if __name__ == "__main__":
    main()
