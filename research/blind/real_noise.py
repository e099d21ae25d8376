"""False names and detection of `gripgen diagnose` on the noise of real pulls.

    python research/blind/real_noise.py GRIPGEN REAL OUT [--measure null|planted] [--seconds N] [--sizes]

REAL: a folder a set with pulls.csv, and twin.toml with the parts. Tables run one after the other, in an order balanced over sets; each
is a line of OUT/NAME.jsonl, and a second call goes on where the first stopped. No --measure: counts. --sizes: what right twins predict.

null     labels = Coulomb law + permuted real residual: nothing acts, each name is false
planted  one invented effect in the same noise ("real") or in Gaussian noise of the same deviation ("sim"), size = multiple of the
         detectable one: a 1 % test of the true form with the friction of each part fitted again has 80 % power (noncentrality 11.68)
Shares nothing with gripgen. Needs numpy and scipy."""

import argparse
import collections
import csv
import json
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
from scipy.stats import beta

SETS, PLANTED = ("o_ring", "pk", "circle", "stadium_lc", "x_ring257", "apple"), ("apple", "two_rings")
LABEL, LEAST_N, NEED, MULTIPLES = "max_pull_force_n", 0.05, 11.68, (1.0, 1.5, 2.0, 3.0)
KINDS = ("dwell", "wear", "temperature", "humidity_one_part", "zero", "operator_part", "film_dip")
# Column that an effect of the library speaks of; those left out speak of the load, the rate or a constant of the sensor.
SPEAKS_OF = {"dwell_ageing": "dwell_s", "grip_relaxation": "dwell_s", "temperature": "temperature_c", "wear": "pull_index",
             "conditioning": "pull_index", "contamination": "pull_index", "sensor_drift": "time_s", "sensor_gain_drift": "time_s"}


def read(real, name):
    """Rows of a set; two rings of like scatter are joined for effects that one part has."""
    names = ("o_ring", "stadium_lc") if name == "two_rings" else (name,)
    return [row for n in names for row in csv.DictReader((real / n / "pulls.csv").read_text(encoding="utf-8").splitlines())]


def noise_of(rows):
    """Coulomb label and deviation of each row, standardised residuals (exchangeable), which of them are known, levels.
    Rings: a level is a part at a grip force, ten strokes each. Levels scatter by 0.01 to 1 N, so a residual is divided by the
    deviation of its level before it may go to another one, and multiplied by that of the level where it lands.
    The run-in from stroke to stroke is in the residuals, but not in their new order.
    Apples: one grip force and one scale. The level is the pose of the apple, with lines in offsets and tilts of the hand in addition;
    residuals are divided by what the fit leaves of them. Rows that are alone in their pose tell nothing and draw one of the others."""
    y, force = np.array([float(r[LABEL]) for r in rows]), np.array([float(r["grip_force_n"]) for r in rows])
    part, apples, law = np.array([r["part"] for r in rows]), "apple_pose" in rows[0], np.zeros(len(y))
    for p in set(part):
        law[part == p] = force[part == p] * y[part == p].mean() / force[part == p].mean()
    key = np.array([r["apple_pose"] if apples else f"{r['part']} {r['grip_force_n']}" for r in rows])
    lines = [[float(r[c]) for r in rows] for c in rows[0] if c.startswith(("hand_", "tilt_"))]
    u, s, _ = np.linalg.svd(np.column_stack([key[:, None] == np.unique(key), *lines]).astype(float), full_matrices=False)
    u = u[:, s > 1e-9 * s[0]]
    left = 1 - np.sum(u * u, axis=1)
    known = left > 0.1
    rest = np.where(known, (y - u @ (u.T @ y)) / np.sqrt(np.where(known, left, 1)), 0)
    sd = np.array([np.sqrt(np.mean(rest[known if apples else key == k] ** 2)) for k in key])
    return law, sd, rest / sd, known, key


def permuted(noise, rng, within):
    """Real residuals in another order: within levels, or over all rows in units of the deviation."""
    _, sd, z, known, key = noise
    out = rng.permutation(np.append(z[known], rng.choice(z[known], np.sum(~known))))
    for k in np.unique(key) if within else ():
        out[key == k] = rng.permutation(z[key == k])
    return sd * out


def invented(rows, rng):
    """The rows with invented columns added, these columns, and parts (of one part two); row order is the order of time."""
    n, part = len(rows), np.array([r["part"] for r in rows])
    words = lambda levels: rng.permutation(np.array(levels)[np.arange(n) % len(levels)])
    part = words((part[0], part[0] + "_b")) if len(set(part)) == 1 else part
    session, count = np.arange(n) * 4 // n, np.arange(n)
    clock = count * 60.0 + session * 1500.0
    wave = np.sin(2 * np.pi * (clock / clock[-1] * rng.uniform(1.2, 2.2) + rng.uniform()))
    damp = np.convolve(rng.normal(0, 0.8, n + 20), 0.6 ** np.arange(20))[20 : 20 + n]
    columns = {
        "part": part, "session": np.array([f"s{k + 1}" for k in session]), "time_s": clock, "pull_index": count,
        "dwell_s": words((0.5, 1.0, 3.0, 10.0, 30.0)), "temperature_c": np.round(23 + 3 * wave + rng.normal(0, 0.4, n), 2),
        "humidity_pct": np.round(np.clip(45 + 9 * damp, 15, 85), 1), "film_um": np.round(rng.uniform(0, 60, n), 1),
        "operator": words(("anna", "ben")),
    }
    return [{**r, **{c: v[i].item() for c, v in columns.items()}} for i, r in enumerate(rows)], columns, part


def shape_of(kind, c, part, law):
    """What a size of 1 (of `zero` a newton) does to the relative label, columns that show it, columns that go with these."""
    other, clocks = part == np.unique(part)[1], ["pull_index", "time_s"]
    return {
        "dwell": lambda: (np.log1p(c["dwell_s"]), ["dwell_s"], []),
        "wear": lambda: (np.exp(-3 * c["pull_index"] / len(part)), clocks, ["session"]),
        "temperature": lambda: (23 - c["temperature_c"], ["temperature_c"], []),
        "humidity_one_part": lambda: ((c["humidity_pct"] - 45) / 10 * other, ["humidity_pct"], []),
        "zero": lambda: ((c["session"] == "s3") / law, ["session"], clocks),
        "operator_part": lambda: (((c["operator"] == "ben") & other) * 1.0, ["operator"], []),
        "film_dip": lambda: (-1 / (1 + ((c["film_um"] - 25) / 7) ** 2), ["film_um"], []),
    }[kind]()


def plant(rows, kind, noise, multiple, mode, rng):
    """A table with one effect: rows, labels, and what is needed to judge it."""
    order = rng.permutation(len(rows))
    rows, columns, part = invented([rows[i] for i in order], rng)
    law, sd = noise[0][order], noise[1][order]
    error = sd * rng.standard_normal(len(sd)) if mode == "sim" else permuted(noise, rng, False)[order]
    if kind == "nothing":
        return rows, law + error, {"size": 0.0, "seen": [], "tied": []}
    change, seen, tied = shape_of(kind, columns, part, law)
    for p in np.unique(part):
        change = change - (part == p) * change[part == p].mean()
    # Least squares of relative labels; the deviation of the slope is that which the noise of the rows gives it.
    gain = change / (change @ change)
    size = float(multiple * np.sqrt(NEED) * np.sqrt(np.sum((gain * sd / law) ** 2)))
    labels = law * (1 + size * change) + error
    return rows, labels, {"size": size, "seen": seen, "tied": tied, "gain": gain / law, "clipped": int(np.sum(labels < LEAST_N)),
                          "weighted": float(size * np.sqrt(np.sum((change * law / sd) ** 2) / NEED))}  # multiple by weighted squares


def write(folder, rows, labels):
    """Writes the table and returns its labels as they are written."""
    labels = [round(float(max(v, LEAST_N)), 5) for v in labels]
    folder.mkdir(parents=True, exist_ok=True)
    lines = [rows[0], *({**r, LABEL: v}.values() for r, v in zip(rows, labels))]
    (folder / "pulls.csv").write_text("\n".join(",".join(map(str, line)) for line in lines) + "\n", encoding="utf-8")
    return np.array(labels)


def call(*command):
    """What the tool prints as JSON, or None and why."""
    done = subprocess.run(["timeout", "400", *command], capture_output=True, text=True, check=False)
    try:
        return json.loads(done.stdout), ""
    except ValueError:
        return None, f"exit {done.returncode}: {done.stderr[-300:]}"


def diagnose(gripgen, folder, twin, work):
    """What was named and how long it took. `names` holds effects as they are, columns with a question mark."""
    began = time.monotonic()
    answer, why = call(gripgen, "diagnose", folder, "-q", "--twin", twin, "--json", "-o", work / "written.toml", "--force")
    out = {"names": [], "seconds": time.monotonic() - began}
    if why:
        return {**out, "failed": why}
    names = [e["name"] + (f"@{e['part']}" if e.get("part") else "") for e in answer["effects"]]
    return {**out, "names": names + ["?" + u["covariate"] for u in answer["unknown"]], "effects": answer["effects"],
            "outliers": len(answer["data"].get("outliers", [])), "hints": [h["name"] for h in answer.get("hints", [])],
            **{k: answer.get(k) for k in ("verdict", "residual", "plain", "notes", "error")}}


def size_in_twin(gripgen, folder, rows, labels, twin, gain):
    """Slope of the twin's predicted labels along the true form. Only their RMS error is told, so it is asked twice, the second time with
    labels moved along that form: the difference of the squares holds the sum that is wanted."""
    scale, now, squares = 0.3 / np.abs(gain).max(), [], []
    for add in (0, scale):
        now.append(write(folder, rows, labels + add * gain))
        answer, why = call(gripgen, "compare", folder, "-q", "--twin", twin, "--json", "--include-suspect")
        if why:
            return None
        squares.append(answer["pulls"]["rmse_n"] ** 2 * len(rows))
    moved = now[1] - now[0]
    return float((squares[0] - squares[1] + moved @ moved) / 2 + moved @ now[0]) / scale


def judge(names, truth):
    """For each name whether it speaks of the true column (right), of one that goes with it (tied) or of neither (false)."""
    columns = [set(n[1:].split("*") if n[0] == "?" else [SPEAKS_OF.get(n.split("@")[0], "")]) for n in names]
    return ["right" if c & set(truth["seen"]) else "tied" if c & set(truth["tied"]) else "false" for c in columns]


def jobs(which):
    """Keys in an order that is balanced over sets; planted: passes over all cells, each in its own order."""
    for number in range(1000):
        cells = [(s, k, m, mode) for s in PLANTED for k in KINDS for m in MULTIPLES for mode in ("real", "sim")]
        cells += [(s, "nothing", 0.0, mode) for s in PLANTED for mode in ("real", "sim")]
        for cell in [(s,) for s in SETS] if which == "null" else [cells[i] for i in np.random.default_rng(number).permutation(len(cells))]:
            yield "-".join(map(str, (*cell, number))), cell, number


def measure(gripgen, real, out, which, seconds, sizes):
    """Runs until the time is spent."""
    ledger, work, twin, began = out / f"{which}.jsonl", out / f"work_{which}", out / "twin.toml", time.monotonic()
    work.mkdir(parents=True, exist_ok=True)
    text = (real / "twin.toml").read_text(encoding="utf-8")
    apple = text[text.index("[parts.apple]") :].split("\n[parts.")[0]
    twin.write_text(text + "\n" + apple.replace("parts.apple", "parts.apple_b") + "\n", encoding="utf-8")
    done = {json.loads(line)["key"] for line in ledger.open(encoding="utf-8")} if ledger.exists() else set()
    tables = {s: (rows, noise_of(rows)) for s in (*SETS, "two_rings") for rows in [read(real, s)]}
    for key, cell, number in jobs(which):
        if key in done or time.monotonic() - began > seconds:
            continue
        rng, folder, (rows, noise) = np.random.default_rng([ord(c) for c in key]), work / key, tables[cell[0]]
        if which == "null":
            record = {"key": key, "set": cell[0], "within": cell[0] != "apple" and number % 2 == 0}
            write(folder, rows, noise[0] + permuted(noise, rng, record["within"]))
            record.update(diagnose(gripgen, folder, twin, work))
        else:
            rows, labels, truth = plant(rows, cell[1], noise, cell[2], cell[3], rng)
            labels, gain = write(folder, rows, labels), truth.pop("gain", None)
            record = {"key": key, **dict(zip(("set", "kind", "multiple", "noise"), cell)), **truth, **diagnose(gripgen, folder, twin, work)}
            record["said"] = judge(record["names"], truth)
            if sizes and "right" in record["said"]:
                record["found"] = size_in_twin(gripgen, work / "probe", rows, labels, work / "written.toml", gain)
        with ledger.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
        if which == "planted" or not record["names"]:  # tables with a false name stay
            shutil.rmtree(folder)


def share(hits, n):
    """Counts with the exact 95 % interval."""
    low, high = beta.ppf(0.025, hits, n - hits + 1) if hits else 0.0, beta.ppf(0.975, hits + 1, n - hits) if hits < n else 1.0
    return f"{hits}/{n} = {100 * hits / n:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def summary(out):
    """Prints all counts."""
    null, planted = ([json.loads(x) for x in f.open(encoding="utf-8")] if f.exists() else [] for f in (out / "null.jsonl", out / "planted.jsonl"))
    for title, ways in (("all", (True, False)), ("within levels", (True,)), ("over levels", (False,))):
        for name in (*SETS, "all sets"):
            some = [r for r in null if r["within"] in ways and name in ("all sets", r["set"])]
            names = collections.Counter(" + ".join(r["names"]) for r in some if r["names"])
            if some:
                print(f"null, {title}, {name}: {share(sum(names.values()), len(some))}, failed {sum('failed' in r for r in some)}, verdicts "
                      f"{dict(collections.Counter(r.get('verdict') for r in some))}, seconds {np.median([r['seconds'] for r in some]):.1f} "
                      f"(most {max(r['seconds'] for r in some):.1f}) {dict(names.most_common())}")
    for fields in (("noise", "multiple"), ("set", "noise", "multiple"), ("kind", "noise", "multiple"), ("kind", "set", "noise")):
        print("\nplanted by", *fields)
        for group in sorted({tuple(r[f] for f in fields) for r in planted}):
            some = [r for r in planted if tuple(r[f] for f in fields) == group]
            count = collections.Counter(next((v for v in ("right", "tied", "false") if v in r["said"]), "silent") for r in some)
            ratio = [r["found"] / r["size"] for r in some if r.get("found") is not None and "right" in r["said"]]
            print(*group, f"right {share(count['right'], len(some))}, tied {count['tied']}, false alone {count['false']}, silent {count['silent']}, "
                  f"with a false name in addition {sum('right' in r['said'] and 'false' in r['said'] for r in some)}, failed {sum('failed' in r for r in some)}"
                  + (f", found / true {np.round(np.quantile(ratio, (0.1, 0.5, 0.9)), 2).tolist()}" if ratio else ""))


if __name__ == "__main__":
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("gripgen", "real", "out"):
        ask.add_argument(name, type=Path)
    ask.add_argument("--measure", choices=("null", "planted"))
    ask.add_argument("--seconds", type=float, default=600)
    ask.add_argument("--sizes", action="store_true")
    got = ask.parse_args()
    if got.measure:
        measure(got.gripgen, got.real, got.out, got.measure, got.seconds, got.sizes)
    else:
        summary(got.out)
