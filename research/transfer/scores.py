"""Errors of predictors in one world, and means over worlds."""

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import spearmanr

from research.transfer.network import Prediction

KS, DRAWS, RESAMPLES = (0, 3, 10), 10, 2000


def rmse(error: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(error))))


def factor(x: np.ndarray, y: np.ndarray) -> float:
    """The factor by which x comes nearest to y."""
    return float((x * y).sum() / max((x * x).sum(), 1e-9))


def draws(count: int) -> list[np.ndarray]:
    """Orders of the pulls of a world: the first k are given."""
    return [np.random.default_rng([count, d]).permutation(count) for d in range(DRAWS)]


def one_number(force_n: np.ndarray, label_n: np.ndarray) -> float:
    """RMSE of a F_G with a of ten pulls, on the others."""
    found = [label_n[o[10:]] - factor(force_n[o[:10]], label_n[o[:10]]) * force_n[o[10:]] for o in draws(len(label_n))]
    return rmse(np.concatenate(found))


def per_part(force_n: np.ndarray, label_n: np.ndarray, part: np.ndarray) -> float:
    """RMSE of a F_G with a of each part, from all its other pulls: more than any k is told."""
    errors = []
    for name in np.unique(part):
        f, y = force_n[part == name], label_n[part == name]
        if len(y) < 2:
            continue
        a = ((f * y).sum() - f * y) / ((f * f).sum() - f * f)
        errors.append(y - a * f)
    return rmse(np.concatenate(errors))


def rank(predicted_n: np.ndarray, force_n: np.ndarray, label_n: np.ndarray) -> float:
    """Spearman of label / F_G and prediction / F_G at nearly equal F_G: mean over six classes."""
    order = np.argsort(force_n)
    found = [spearmanr(predicted_n[i] / force_n[i], label_n[i] / force_n[i])[0] for i in np.array_split(order, 6)]
    return float(np.nan_to_num(found).mean())


@dataclass
class Score:
    """A predictor in a world."""

    rmse_n: dict[int, float] = field(default_factory=dict)  # by k
    relative: float = 0.0  # of the mean label, k = 10
    within50: dict[int, float] = field(default_factory=dict)
    within90: dict[int, float] = field(default_factory=dict)
    rank: float = 0.0
    ln_mse: dict[int, float] = field(default_factory=dict)


def score(p: Prediction, force_n: np.ndarray, label_n: np.ndarray) -> Score:
    """All figures of one predictor in one world."""
    out = Score()
    for k in KS:
        errors, logs, half, most = [], [], [], []
        for order in draws(len(label_n)):
            few, rest = order[:k], order[10:]
            told = p.given(few, label_n[few])
            errors.append((label_n - told.expected_n())[rest])
            logs.append((np.log(label_n + 0.5) - told.mean - np.log(told.factor))[rest])
            half.append(told.within(label_n, 0.5)[rest])
            most.append(told.within(label_n, 0.9)[rest])
        out.rmse_n[k], out.ln_mse[k] = rmse(np.concatenate(errors)), rmse(np.concatenate(logs)) ** 2
        out.within50[k], out.within90[k] = float(np.mean(np.concatenate(half))), float(np.mean(np.concatenate(most)))
    out.relative = out.rmse_n[10] / float(label_n.mean())
    out.rank = rank(p.expected_n(), force_n, label_n)
    return out


def mean_of(scores: list[Score]) -> Score:
    """Mean over seeds."""
    def over(name: str) -> dict[int, float]:
        return {k: float(np.mean([getattr(s, name)[k] for s in scores])) for k in KS}

    return Score(over("rmse_n"), float(np.mean([s.relative for s in scores])), over("within50"), over("within90"),
                 float(np.mean([s.rank for s in scores])), over("ln_mse"))


def interval(ratios: np.ndarray) -> tuple[float, float, float]:
    """Geometric mean of ratios over worlds and its 90 % interval by bootstrap over worlds."""
    logs = np.log(ratios)
    rng = np.random.default_rng(0)
    found = logs[rng.integers(0, len(logs), (RESAMPLES, len(logs)))].mean(1)
    return float(np.exp(logs.mean())), float(np.exp(np.quantile(found, 0.05))), float(np.exp(np.quantile(found, 0.95)))


def share(error_told: np.ndarray, error_seen: np.ndarray, error_oracle: np.ndarray) -> tuple[float, float, float]:
    """Share of the oracle's gain over F_G alone, from mean squares of worlds, with a bootstrap over worlds."""
    rng = np.random.default_rng(0)
    at = rng.integers(0, len(error_told), (RESAMPLES, len(error_told)))
    gains = [(t.mean(-1) - s.mean(-1)) / (t.mean(-1) - o.mean(-1)) for t, s, o in
             ((error_told, error_seen, error_oracle), (error_told[at], error_seen[at], error_oracle[at]))]
    return float(gains[0]), float(np.quantile(gains[1], 0.05)), float(np.quantile(gains[1], 0.95))
