"""python -m research.blind.regret FOLDER [--json OUT.jsonl] [--only c000,c001]

The expected error on unseen pulls, noise off, of worlds that have expected labels (`expected/` beside the truth): of the
recalibrated baseline (`calibrate pulls`), of the twin that `diagnose -o` writes (environment GRIPGEN_BIN), of a quadratic
ridge on the table, and of a Gaussian process where scikit-learn is installed. One line of JSON a campaign, appended as it is done; then a table by world.
"""

import argparse
import json
import os
from pathlib import Path

import numpy as np

from . import baselines, runner

PENALTIES = [1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0]


def _features(table, train, parts):
    """Parts, then all columns, squares and products, standardised as in training; words by one column each."""
    columns = [(table["part"] == p).astype(float) for p in parts]
    numbers = []
    for name, values in train.items():
        if name in ("pull_id", "part", "max_pull_force_n") or len(set(values)) < 2:
            continue
        if values.dtype.kind in "fi" and name != "session":
            numbers.append((table[name] - values.mean()) / values.std())
        elif len(set(values)) <= 12:
            columns += [(table[name] == w).astype(float) for w in sorted(set(values))]
    columns += numbers
    columns += [numbers[i] * numbers[j] for i in range(len(numbers)) for j in range(i, len(numbers))]
    return np.column_stack(columns)


def ridge(folder, unseen):
    """Root mean square error at `unseen`; the penalty by generalised cross-validation."""
    train, test = baselines.read(folder), baselines.read(unseen)
    parts = sorted(set(train["part"]))
    x, f = _features(train, train, parts), train["grip_force_n"]
    w = f / np.hypot(0.04 * train["max_pull_force_n"], 0.3)
    y = train["max_pull_force_n"] / f
    keep = np.abs(y - np.median(y)) < 6 * 1.4826 * np.median(np.abs(y - np.median(y))) + 0.05
    x, w, y = x[keep], w[keep], y[keep]
    xw, yw = x * w[:, None], y * w
    best = None
    for penalty in PENALTIES:
        d = np.full(x.shape[1], penalty)
        d[: len(parts)] = 1e-9
        inverse = np.linalg.inv(xw.T @ xw + np.diag(d) * np.sum(w**2))
        c = inverse @ (xw.T @ yw)
        used = np.trace(inverse @ (xw.T @ xw))
        error = np.sum((yw - xw @ c) ** 2) / max(len(y) - used, 0.5) ** 2
        if best is None or error < best[0]:
            best = (error, c)
    predicted = _features(test, train, parts) @ best[1] * test["grip_force_n"]
    return float(np.sqrt(np.mean((predicted - test["max_pull_force_n"]) ** 2)))


def process(folder, unseen):
    """The same of a Gaussian process on all columns; None without scikit-learn."""
    try:
        return baselines.gp(folder, unseen, None).rmse_after_n
    except ImportError:
        return None


def score(folder, sealed, work, binary, limit_s, calibrated):
    """All errors of one campaign."""
    truth = json.loads((sealed / "truth.json").read_text(encoding="utf-8"))
    expected = sealed / "expected"
    work.mkdir(parents=True, exist_ok=True)
    report, twin, plain = work / "report.json", work / "diagnosed.toml", work / "fitted.toml"
    line = {"name": folder.name, "kind": truth["kind"], "group": truth["group"], "pulls": truth["pulls"],
            "acts": [a["name"] for a in truth["acts"]], "floor_n": truth["floor_rmse_n"], "ridge_n": ridge(folder, expected)}
    line["gp_n"] = process(folder, expected)
    if calibrated:
        _, why, _ = runner._call([binary, "calibrate", "pulls", str(folder), "-o", str(plain), "--force"], limit_s)
        line["before_n"] = None if why else runner._compare(binary, expected, plain, limit_s)[0]
    _, why, line["seconds"] = runner._call(
        [binary, "diagnose", str(folder), "--json", str(report), "-o", str(twin), "--force"], limit_s)
    if why:
        line["why"] = why
        return line
    answer = json.loads(report.read_text(encoding="utf-8"))
    line["after_n"] = runner._compare(binary, expected, twin, limit_s)[0]
    line.update(
        verdict=answer["verdict"], named=[e["name"] for e in answer["effects"]], unknown=[u["covariate"] for u in answer["unknown"]],
        residual=answer.get("residual"), hints=[h["name"] for h in answer.get("hints", [])],
        stated_n=[(answer.get("error") or {}).get(k, {}).get("rmse_n") for k in ("before", "after")],
        ridge_note=[n for n in answer["notes"] if "ridge" in n])
    return line


def table(lines):
    """By world: regret against the recalibrated baseline, error over that of an oracle with its noise, the ridge's."""
    rows = ["| world | n | after / before, median, worst | worse than 1.02 x + 0.01 N | after / floor, median, worst | ridge / floor, median, worst | residual kept |",
            "|---|---|---|---|---|---|---|"]
    done = [r for r in lines if r.get("after_n") is not None and r.get("before_n") is not None]
    for kind in sorted({r["kind"] for r in done}) + ["all"]:
        own = [r for r in done if kind in (r["kind"], "all")]
        noisy = lambda r, key: np.hypot(r[key], r["floor_n"]) / r["floor_n"]
        regret = [r["after_n"] / r["before_n"] for r in own]
        worse = sum(r["after_n"] > 1.02 * r["before_n"] + 0.01 for r in own)
        after, rival = ([noisy(r, key) for r in own] for key in ("after_n", "ridge_n"))
        rows.append(f"| {kind} | {len(own)} | {np.median(regret):.2f}, {max(regret):.2f} | {worse} | {np.median(after):.2f}, {max(after):.2f} "
                    f"| {np.median(rival):.2f}, {max(rival):.2f} | {sum(bool(r.get('residual')) for r in own)} |")
    return "\n".join(rows)


def explained(lines):
    """The share of the recalibrated baseline's expected error that is gone, noise off, by world: this tool and the process."""
    rows = ["| world | n | before, N | explained share, median, least | the process's | none found above 3 x floor |", "|---|---|---|---|---|---|"]
    done = [r for r in lines if r.get("after_n") is not None and r.get("before_n") and r.get("gp_n")]
    for kind in sorted({r["kind"] for r in done}):
        own = [r for r in done if r["kind"] == kind]
        share, rival = ([1 - r[key] / r["before_n"] for r in own] for key in ("after_n", "gp_n"))
        missed = sum(r["verdict"] == "none" and np.hypot(r["after_n"], r["floor_n"]) > 3 * r["floor_n"] for r in own)
        rows.append(f"| {kind} | {len(own)} | {np.median([r['before_n'] for r in own]):.2f} | {np.median(share):.2f}, {min(share):.2f} "
                    f"| {np.median(rival):.2f}, {min(rival):.2f} | {missed} |")
    return "\n".join(rows)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--json")
    parser.add_argument("--only", default="")
    parser.add_argument("--work")
    parser.add_argument("--before", help="lines of an earlier run, whose recalibrated baselines count")
    parser.add_argument("--limit-s", type=float, default=900)
    args = parser.parse_args(arguments)
    folder, sealed = Path(args.folder), Path(args.folder.rstrip("/") + "-sealed")
    work = Path(args.work or args.folder.rstrip("/") + "-work")
    known = {}
    if args.before:
        known = {r["name"]: r.get("before_n") for r in map(json.loads, Path(args.before).read_text(encoding="utf-8").splitlines())}
    only = [n for n in args.only.split(",") if n]
    binary, lines = os.environ.get("GRIPGEN_BIN", "gripgen"), []
    for place in sorted(p for p in folder.iterdir() if (p / "pulls.csv").is_file() and (not only or p.name in only)):
        line = score(place, sealed / place.name, work / place.name, binary, args.limit_s, place.name not in known)
        if place.name in known:
            line["before_n"] = known[place.name]
        lines.append(line)
        text = json.dumps(line)
        print(text, flush=True)
        if args.json:
            with open(args.json, "a", encoding="utf-8") as file:
                file.write(text + "\n")
    print(table(lines))
    if any(r.get("gp_n") for r in lines):
        print(explained(lines))


if __name__ == "__main__":
    main()
