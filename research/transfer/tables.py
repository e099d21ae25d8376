"""The tables of a run, as text."""

import numpy as np

from research.transfer.network import Prediction
from research.transfer.scores import Score, interval, mean_of, one_number, per_part, score, share

LEAST = 0.15  # a F_G errs by so much of the mean label in a world that counts
SHOWN = ("old", "new", "new-all", "new-plain", "new-less", "w1-native", "no-friction", "no-gel", "no-rig", "one-family")
Key = tuple[str, str, int, str]


def line(*cells: object) -> str:
    """A row of a table."""
    return "| " + " | ".join(f"{c:.2f}" if isinstance(c, float) else str(c) for c in cells) + " |\n"


def head(*cells: str) -> str:
    """The head of a table."""
    return "\n" + line(*cells) + line(*["---"] * len(cells))


def of(ratios: list[float] | np.ndarray) -> str:
    """A geometric mean and its interval."""
    middle, low, high = interval(np.array(ratios))
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


def report(worlds: dict[str, dict[str, np.ndarray]], predictions: dict[Key, Prediction], seeds: int) -> tuple[str, dict]:
    """Text, and figures for a file."""
    scores: dict[tuple[str, str, str], Score] = {}
    for variant, kind, seed, w in predictions:
        if seed == 0:
            t = worlds[w]
            scores[variant, kind, w] = mean_of([score(predictions[variant, kind, s, w], t["force_n"], t["label_n"]) for s in range(seeds)])
    line_n = {w: one_number(t["force_n"], t["label_n"]) for w, t in worlds.items()}
    part_n = {w: per_part(t["force_n"], t["label_n"], t["part"]) for w, t in worlds.items()}
    mean_n = {w: float(t["label_n"].mean()) for w, t in worlds.items()}
    oracle = {w: min((scores[k, "both", w] for k in ("oracle-ridge", "oracle-network")), key=lambda s: s.rmse_n[0])
              for w in worlds if w.startswith("W2")}
    second = [w for w in worlds if w.startswith("W2") and line_n[w] / mean_n[w] >= LEAST]
    first = [w for w in worlds if w.startswith("W1")]

    text = "\n### W2 by world, trained on `training.toml`, images and F_G, k = 10\n"
    text += head("world", "mean label, N", "a F_G, N (%)", "network, N (%)", "of a F_G", "oracle, N", "of oracle", "native, N", "a F_G per part, N",
                 "skill", "skill per part", "Spearman")
    for w in (w for w in worlds if w.startswith("W2")):
        s, r = scores["new", "both", w], scores["new", "both", w].rmse_n[10]
        text += line(w + ("" if w in second else " (does not count)"), mean_n[w], f"{line_n[w]:.2f} ({100 * line_n[w] / mean_n[w]:.0f})",
                     f"{r:.2f} ({100 * s.relative:.0f})", r / line_n[w], oracle[w].rmse_n[0], r / oracle[w].rmse_n[0],
                     scores["native", "both", w].rmse_n[0], part_n[w], 1 - (r / line_n[w]) ** 2, 1 - (r / part_n[w]) ** 2, s.rank)
    figures: dict = {"line_n": line_n, "part_n": part_n, "mean_n": mean_n, "oracle_n": {w: o.rmse_n[0] for w, o in oracle.items()}}

    for name, group in (("W2", second), ("W1", first)):
        text += f"\n### {name}, {len(group)} worlds: RMSE over that of a F_G (ten pulls), geometric mean (90 % interval)\n"
        text += head("trained on", "input", "k = 0", "k = 3", "k = 10", "worst world, k = 10", "inside 50 %, k = 0, 10", "inside 90 %, k = 0, 10", "Spearman",
                     "RMSE, %, k = 10")
        for variant in SHOWN:
            for kind in ("force", "images", "both", "contact"):
                if (variant, kind, group[0]) not in scores:
                    continue
                found = {w: scores[variant, kind, w] for w in group}
                ratios = {k: [found[w].rmse_n[k] / line_n[w] for w in group] for k in (0, 3, 10)}
                worst = group[int(np.argmax(ratios[10]))]
                cover = [f"{100 * np.mean([getattr(s, f)[0] for s in found.values()]):.0f}, {100 * np.mean([getattr(s, f)[10] for s in found.values()]):.0f}"
                         for f in ("within50", "within90")]
                text += line(variant, {"force": "F_G", "both": "images, F_G", "contact": "true contact, F_G"}.get(kind, kind),
                             *(of(ratios[k]) for k in (0, 3, 10)), f"{worst[3:]}: {max(ratios[10]):.2f}", *cover,
                             float(np.mean([s.rank for s in found.values()])), f"{100 * np.mean([s.relative for s in found.values()]):.0f}")
                figures[f"{name} {variant} {kind}"] = {str(k): v for k, v in ratios.items()}
    text += targets(scores, line_n, oracle, first, second)
    return text, figures


def targets(scores: dict[tuple[str, str, str], Score], line_n: dict[str, float], oracle: dict[str, Score],
            first: list[str], second: list[str]) -> str:
    """What was aimed at, and what came out."""
    text = "\n### Targets\n" + head("target", "wanted", "`training.toml`", "old set", "`training.toml`, all rows")
    by = ("new", "old", "new-all")

    def row(title: str, wanted: str, group: list[str], k: int, under) -> str:
        return line(title, wanted, *(of([scores[v, "both", w].rmse_n[k] / under(w) for w in group]) for v in by))

    text += row("W2: RMSE over a F_G, k = 10", "<= 0.75", second, 10, lambda w: line_n[w])
    text += row("W2: RMSE over the oracle, k = 10", "<= 1.5", second, 10, lambda w: oracle[w].rmse_n[0])
    less = [scores["new-less", "both", w].rmse_n[0] / scores["w1-native", "both", w].rmse_n[0] for w in first]
    text += line("W1: the same, `training.toml` with as many rows as the native network", "<= 1.1", of(less), "", "")
    text += row("W1: RMSE over the native network, k = 0", "<= 1.1", first, 0, lambda w: scores["w1-native", "both", w].rmse_n[0])
    for unit, k in (("N^2", 0), ("ln^2", 0), ("N^2", 10), ("ln^2", 10)):
        cells = []
        for variant in ("new", "new-less", "w1-native"):
            errors = [np.array([scores[variant, kind, w].rmse_n[k] ** 2 if unit == "N^2" else scores[variant, kind, w].ln_mse[k] for w in first])
                      for kind in ("force", "both", "contact")]
            middle, low, high = share(*errors)
            cells.append(f"{middle:.2f} ({low:.2f} to {high:.2f}); {errors[0].mean():.3f}, {errors[1].mean():.3f}, {errors[2].mean():.3f}")
        text += line(f"W1: share of the oracle's gain in {unit}, k = {k}; errors of F_G, images and F_G, true contact", ">= 0.67", cells[0], "",
                     f"fewer rows: {cells[1]}; native: {cells[2]}")
    text += "\n### The new set against the old one, images and F_G, RMSE new over old\n" + head("worlds", "k = 0", "k = 3", "k = 10")
    for name, group in (("W1", first), ("W2", second)):
        text += line(name, *(of([scores["new", "both", w].rmse_n[k] / scores["old", "both", w].rmse_n[k] for w in group]) for k in (0, 3, 10)))
    return text
