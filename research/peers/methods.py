"""Sparse regression with a false-discovery rate, symbolic regression, ridge; the others come from `research.blind`."""

import numpy as np
from scipy.stats import f as fisher

from research.blind import baselines, regret
from research.blind.runner import Answer

RATE = 0.05


def candidates(train, table, source):
    """Terms by name, each a group of columns: the library in log-linear form, and what it does not hold ("?")."""
    groups = {k: v[:, None] for k, v in baselines.mapped(table, source).items() if k[0] != "?" and k != "grip_relaxation"}
    log_rate = np.log(table["force_increment_n"] / table["step_time_s"] / 10)
    groups["?grip_force_n*force_increment_n"] = (np.log(table["grip_force_n"] / 25) * log_rate)[:, None]
    for name in ["session", "gel_id", *source["centre"]]:
        reference = train[name]
        if name in ("session", "gel_id") or reference.dtype.kind == "U":
            groups["?" + name] = np.column_stack([table[name] == level for level in sorted(set(reference))]).astype(float)
        else:
            groups["?" + name] = np.column_stack([table[name] - reference.mean(), (table[name] - reference.mean()) ** 2])
    return groups


def _fit(columns, y, w):
    x = np.column_stack(columns) * w[:, None]
    scale = np.linalg.norm(x, axis=0) + 1e-12
    c, _, rank, _ = np.linalg.lstsq(x / scale, y * w, rcond=1e-6)
    return c / scale, float(np.sum((y * w - x @ (c / scale)) ** 2)), rank


def _p_value(small, big, count):
    """F test of two nested fits; 1 where the larger one holds nothing new."""
    added, left = big[2] - small[2], count - big[2]
    if added < 1 or left < 1:
        return 1.0
    return float(fisher.sf((small[1] - big[1]) / added / (big[1] / left), added, left))


def discovery(folder, unseen, work, forward=False):
    """Joint fit of all candidates, Benjamini and Hochberg at 5 % on their F tests; or their forward selection.

    Forward: the best further candidate enters while its p is below 5 % i / m (i-th of m).
    """
    train, test, parts, source, use, y = baselines._ready(folder, unseen)
    w, own = baselines._weights(train) * use, [baselines.parts_matrix(train, parts)]
    terms, later = candidates(train, train, source), candidates(train, test, source)
    names, count, kept = list(terms), int(use.sum()), []
    if forward:
        now = _fit(own, y, w)
        while len(kept) < len(names):
            left = {n: _fit(own + [terms[k] for k in (*kept, n)], y, w) for n in names if n not in kept}
            p = {n: _p_value(now, fit, count) for n, fit in left.items()}
            best = min(p, key=p.get)
            if p[best] > RATE * (len(kept) + 1) / len(names):
                break
            kept, now = [*kept, best], left[best]
    else:
        full = _fit(own + [terms[n] for n in names], y, w)
        p = {n: _p_value(_fit(own + [terms[k] for k in names if k != n], y, w), full, count) for n in names}
        order = sorted(names, key=p.get)
        kept = order[: max([i for i, n in enumerate(order, 1) if p[n] <= RATE * i / len(names)], default=0)]
    c = _fit(own + [terms[n] for n in kept], y, w)[0]
    said, at = [], len(parts)
    for n in kept:
        said.append("grip_relaxation" if n == "dwell_ageing" and c[at] < 0 else n)
        at += terms[n].shape[1]
    design = np.column_stack([baselines.parts_matrix(test, parts)] + [later[n] for n in kept])
    return baselines._finish(baselines._answer_of(said), test, design @ c)


def symbolic(folder, unseen, work):
    """Genetic programming (gplearn) on what the friction of the parts leaves; names the columns of its expression.

    Found on two thirds of the pulls; kept if it takes 3 % of the squared error of the other third away.
    """
    from gplearn.genetic import SymbolicRegressor

    train, test, parts, _, use, y = baselines._ready(folder, unseen)
    w, own = baselines._weights(train) * use, baselines.parts_matrix(train, parts)
    names = [n for n in train if n not in ("pull_id", "part", "max_pull_force_n") and len(set(train[n])) > 1]

    def numbers(table):
        columns = []
        for n in names:
            if train[n].dtype.kind == "U":
                columns.append(np.searchsorted(sorted(set(train[n])), table[n]).astype(float))
            else:
                columns.append(table[n] / (np.abs(train[n]).mean() + 1e-9))
        return np.column_stack(columns)

    rest = y - own @ _fit([own], y, w)[0]
    x, held = numbers(train), np.random.default_rng(0).permutation(len(y)) % 3 == 0
    search = SymbolicRegressor(population_size=2000, generations=20, metric="pearson", parsimony_coefficient=0.003,
                               function_set=("add", "sub", "mul", "div", "sqrt", "log", "inv"), random_state=0)
    search.fit(x[~held], rest[~held], sample_weight=w[~held] ** 2)

    def error(columns):
        c = _fit([m[~held] for m in columns], y[~held], w[~held])[0]
        return np.sum(((y - np.column_stack(columns) @ c) * w)[held] ** 2)

    found = search._program.execute(x)
    if not np.ptp(found) > 0 or error([own, found]) > 0.97 * error([own]):
        return baselines._finish(Answer(verdict="none"), test, baselines.parts_matrix(test, parts) @ _fit([own], y, w)[0])
    c = _fit([own, found], y, w)[0]
    used = [n for i, n in enumerate(names) if i in {k for k in search._program.program if type(k) is int}]
    design = np.column_stack([baselines.parts_matrix(test, parts), search._program.execute(numbers(test))])
    return baselines._finish(Answer(verdict="unknown", unknown=used), test, design @ c)


def ridge(folder, unseen, work):
    """Quadratic ridge on all columns; names nothing."""
    return Answer(verdict="none", rmse_after_n=regret.ridge(folder, unseen))
