"""python -m research.blind.baselines FOLDER [--json OUT.json] [--with GRIPGEN.json]

What can be done without a twin, on the same campaigns and scored the same way:
`offset` a + b/F with an F test, `bic` log-linear terms by BIC, `stlsq` sparse regression
on the same terms, `gp` a Gaussian process on all covariates. Needs scikit-learn for `gp`.
"""

import argparse
import csv
import json
import time
from pathlib import Path

import numpy as np

from . import judge, scorer
from .runner import Answer

KNOWN = {
    "grip_force_n", "force_increment_n", "step_time_s", "dwell_s", "pull_index", "time_s", "temperature_c",
    "grip_offset_mm", "grip_angle_deg", "pull_direction", "session", "gel_id", "part",
}


def read(folder):
    """Columns of `pulls.csv`; text columns become codes."""
    with open(Path(folder) / "pulls.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    table = {}
    for name in rows[0]:
        values = [r[name] for r in rows]
        try:
            table[name] = np.array([float(v) for v in values])
        except ValueError:
            table[name] = np.array(values)
    return table


def mapped(table, source):
    """Relative residual basis of the library's effects in log-linear form: {name: column}."""
    f, n = table["grip_force_n"], table["pull_index"]
    t, mid = table["time_s"], source
    rate = np.log(table["force_increment_n"] / table["step_time_s"])
    angle = np.radians(2 * table["grip_angle_deg"])
    first = np.concatenate([[True], np.diff(table["session"]) != 0])
    rest = n - np.maximum.accumulate(np.where(first, n, 0)) if np.all(np.diff(n) > 0) else n % 37
    columns = {
        "load_offset": 1 / f, "load_power_law": np.log(f), "area_saturation": f,
        "regime_transition": (f > mid["kink"]).astype(float), "rate_dependence": rate,
        "dwell_ageing": np.log1p(table["dwell_s"]), "grip_relaxation": -np.log1p(table["dwell_s"]),
        "anisotropy": np.cos(angle), "contamination": (n > mid["step"]).astype(float),
        "wear": -np.log1p(n / (0.3 * mid["last"])), "conditioning": np.exp(-rest / 5),
        "temperature": table["temperature_c"] - 22, "jaw_tilt": table["pull_direction"],
        "off_centre": -table["grip_offset_mm"] ** 2, "sensor_bias": table["pull_direction"] / f,
        "sensor_gain_drift": t / mid["end"], "sensor_drift": table["pull_direction"] * t / mid["end"] / f,
    }
    for name, centre in mid["centre"].items():
        columns["?" + name] = _number(table[name], centre)
    return columns


def _number(values, mean_or_level):
    if values.dtype.kind in "fi":
        return values - mean_or_level
    return (values == mean_or_level).astype(float)


def source_of(table):
    """What the columns need from the training pulls."""
    free = {k: v for k, v in table.items() if k not in KNOWN | {"pull_id", "max_pull_force_n"}}
    return {
        "kink": 20.0, "step": float(np.median(table["pull_index"])), "last": float(table["pull_index"].max() + 1),
        "end": float(table["time_s"].max()),
        "centre": {k: v.mean() if v.dtype.kind in "fi" else v[0] for k, v in free.items()},
    }


def parts_matrix(table, parts):
    return np.stack([(table["part"] == p).astype(float) for p in parts], axis=1)


def _ready(folder, unseen):
    train, test = read(folder), read(unseen)
    parts = sorted(set(train["part"]))
    source = source_of(train)
    use = train["max_pull_force_n"] > 0.05
    y = np.log(np.maximum(train["max_pull_force_n"], 0.05) / train["grip_force_n"])
    return train, test, parts, source, use, y


def _finish(answer, test, log_mu):
    predicted = np.exp(log_mu) * test["grip_force_n"]
    answer.rmse_after_n = float(np.sqrt(np.mean((predicted - test["max_pull_force_n"]) ** 2)))
    return answer


def _weights(train):
    """Relative errors of 4 % and 0.3 N."""
    return 1 / np.hypot(0.04, 0.3 / np.maximum(train["max_pull_force_n"], 0.3))


def offset(folder, unseen, work):
    """The paper's law, accepted by an F test at 5 %."""
    train, test, parts, _, _, _ = _ready(folder, unseen)
    w = _weights(train) / np.maximum(train["max_pull_force_n"], 0.3)
    f, y = train["grip_force_n"], train["max_pull_force_n"]
    p = parts_matrix(train, parts)
    small = p * f[:, None]
    big = np.concatenate([small, p], axis=1)
    fits = [np.linalg.lstsq(m * w[:, None], y * w, rcond=None)[0] for m in (small, big)]
    rss = [np.sum(((y - m @ c) * w) ** 2) for m, c in zip((small, big), fits)]
    free = max(len(y) - big.shape[1], 1)
    value = (rss[0] - rss[1]) / len(parts) / (rss[1] / free)
    answer = Answer(verdict="none")
    q = parts_matrix(test, parts)
    designs = (q * test["grip_force_n"][:, None], np.concatenate([q * test["grip_force_n"][:, None], q], axis=1))
    chosen = 0
    if value > _f_limit(len(parts), free):
        chosen = 1
        answer.verdict = "effect"
        answer.effects = [{"name": "load_offset", "class": [], "weight": 1.0, "rivals": [], "parameters": {}}]
    predicted = designs[chosen] @ fits[chosen]
    answer.rmse_after_n = float(np.sqrt(np.mean((predicted - test["max_pull_force_n"]) ** 2)))
    return answer


def _f_limit(a, b):
    """95 % point of F by simulation with a fixed seed (numpy only)."""
    rng = np.random.default_rng(0)
    return float(np.quantile(rng.chisquare(a, 40_000) / a / (rng.chisquare(b, 40_000) / b), 0.95))


def _answer_of(names):
    known = [n for n in names if not n.startswith("?")]
    unknown = [n[1:] for n in names if n.startswith("?")]
    verdict = "effect" if known else "unknown" if unknown else "none"
    entries = [{"name": n, "class": [], "weight": 1.0, "rivals": [], "parameters": {}} for n in known]
    return Answer(verdict=verdict, effects=entries, unknown=unknown)


def bic(folder, unseen, work):
    """Forward choice of log-linear terms by BIC, at most three."""
    train, test, parts, source, use, y = _ready(folder, unseen)
    w = _weights(train) * use
    terms, later = mapped(train, source), mapped(test, source)
    chosen, m = [], parts_matrix(train, parts)

    def score_of(design):
        c = np.linalg.lstsq(design * w[:, None], y * w, rcond=None)[0]
        rss = np.sum(((y - design @ c) * w) ** 2)
        return len(y) * np.log(rss / len(y)) + design.shape[1] * np.log(len(y)), c

    best, coefficients = score_of(m)
    for _ in range(3):
        trials = {}
        for name, column in terms.items():
            if name not in chosen and np.ptp(column) > 0:
                value, c = score_of(np.column_stack([m, column]))
                if name in ("load_offset", "sensor_bias") or c[-1] > 0 or name[0] == "?":
                    trials[name] = (value, c)
                elif name not in ("dwell_ageing", "grip_relaxation", "wear", "off_centre"):
                    trials[name] = (value, c)
        if not trials:
            break
        name = min(trials, key=lambda k: trials[k][0])
        if trials[name][0] > best - 2:
            break
        best, coefficients = trials[name]
        chosen.append(name)
        m = np.column_stack([m, terms[name]])
    design = np.column_stack([parts_matrix(test, parts)] + [later[n] for n in chosen])
    return _finish(_answer_of(chosen), test, design @ coefficients)


def stlsq(folder, unseen, work):
    """Sequentially thresholded least squares on standardised terms, threshold 2 %."""
    train, test, parts, source, use, y = _ready(folder, unseen)
    w = _weights(train) * use
    terms, later = mapped(train, source), mapped(test, source)
    names = [n for n in terms if np.ptp(terms[n]) > 0 and n != "grip_relaxation"]
    scale = {n: np.std(terms[n]) for n in names}
    m0 = parts_matrix(train, parts)
    for _ in range(10):
        m = np.column_stack([m0] + [terms[n] / scale[n] for n in names])
        ridge = 1e-3 * np.eye(m.shape[1]) * np.sum(w**2)
        c = np.linalg.solve((m * (w**2)[:, None]).T @ m + ridge, (m * (w**2)[:, None]).T @ y)
        kept = [n for n, v in zip(names, c[len(parts):]) if abs(v) >= 0.02]
        if kept == names:
            break
        names = kept
    order = sorted(names, key=lambda n: -abs(c[len(parts) + names.index(n)]))
    said = ["grip_relaxation" if n == "dwell_ageing" and c[len(parts) + names.index(n)] < 0 else n for n in order]
    design = np.column_stack([parts_matrix(test, parts)] + [later[n] / scale[n] for n in names])
    return _finish(_answer_of(said), test, design @ c)


def gp(folder, unseen, work):
    """Kennedy-O'Hagan style: Coulomb plus a process on all covariates; names covariates only."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    train, test, parts, source, use, y = _ready(folder, unseen)
    names = [n for n in train if n not in ("pull_id", "part", "max_pull_force_n") and len(set(train[n])) > 1]

    def numbers(table):
        columns = []
        for n in names:
            v, ref = table[n], train[n]
            if ref.dtype.kind == "U":
                levels = sorted(set(ref))
                v, ref = (np.array([levels.index(x) if x in levels else 0 for x in a], float) for a in (v, ref))
            columns.append((v - ref.mean()) / (ref.std() + 1e-9))
        return np.column_stack(columns)

    m, w = parts_matrix(train, parts), _weights(train) * use
    c = np.linalg.lstsq(m * w[:, None], y * w, rcond=None)[0]
    rest = y - m @ c
    x = numbers(train)
    kernel = ConstantKernel(0.01, (1e-6, 1)) * RBF(np.ones(len(names)), (0.2, 1e3)) + WhiteKernel(0.002, (1e-6, 1))
    model = GaussianProcessRegressor(kernel, alpha=1 / np.maximum(w, 0.1) ** 2, n_restarts_optimizer=0).fit(x, rest)
    lengths = model.kernel_.k1.k2.length_scale
    amplitude = model.kernel_.k1.k1.constant_value
    alone = WhiteKernel(0.002, (1e-6, 1))
    null = GaussianProcessRegressor(alone, alpha=1 / np.maximum(w, 0.1) ** 2).fit(x, rest)
    gain = model.log_marginal_likelihood_value_ - null.log_marginal_likelihood_value_
    order = np.argsort(np.atleast_1d(lengths))
    said = [names[order[0]]] if gain > 4 and amplitude > 1e-5 else []
    answer = Answer(verdict="unknown" if said else "none", unknown=said)
    return _finish(answer, test, parts_matrix(test, parts) @ c + model.predict(numbers(test)))


TOOLS = {"offset": offset, "bic": bic, "stlsq": stlsq, "gp": gp}


def timed(tool):
    """The same tool with the seconds it took."""

    def run(*arguments):
        started = time.monotonic()
        answer = tool(*arguments)
        answer.seconds = time.monotonic() - started
        return answer

    return run


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("folder")
    parser.add_argument("--tools", default=",".join(TOOLS))
    parser.add_argument("--json")
    parser.add_argument("--with", dest="ours", help="summary of the scorer, put beside")
    parser.add_argument("--markdown")
    args = parser.parse_args(arguments)
    columns = {}
    if args.ours:
        columns["gripgen"] = json.loads(Path(args.ours).read_text(encoding="utf-8"))["summary"]
    for name in args.tools.split(","):
        records, _ = scorer.score(args.folder.rstrip("/"), "unused", timed(TOOLS[name]), jobs=2)
        columns[name] = judge.summary(list(records.values()))
    text = scorer.table(columns)
    print(text)
    if args.markdown:
        Path(args.markdown).write_text(text, encoding="utf-8")
    if args.json:
        Path(args.json).write_text(json.dumps(columns, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
