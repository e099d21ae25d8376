"""Checks whether the label rule with kinetic friction yields the law a + b / F_G of Wucherer et al. 2023.

    python research/paper_law.py labels      # simulated labels against max(r S, S - (3 - l)), and a, b for each kinetic ratio
    python research/paper_law.py rows        # the paper's four rows, fitted by this and by other explanations
    python research/paper_law.py tolerance   # whether other tolerances tell the label rule from a law of friction
    python research/paper_law.py all

Plain friction: the jaws hold S = c mu F_G, c = 2 where F_G is the force of one jaw and 1 where it is the sum, and r S while they slide.
The label is the last reading within 3 N of the command, which leads by l at the slip. Needs numpy and gripgen (environment variable GRIPGEN_BIN).
Prints tables in Markdown (docs/paper-law.md). The same arguments print the same numbers.
"""

import argparse
import csv
import io
import itertools
import math
import os
import subprocess
import tarfile
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

Array = np.ndarray
TOLERANCE_N = 3.0
GRIP_FORCES_N = np.arange(20.0, 81.0, 5.0)
# mu, a, b in N: Wucherer et al. 2023, table of fits.
ROWS = {"ball bearing": (0.14, 1.20, -4.34), "shaft": (0.168, 1.05, -3.20), "gear": (0.15, 1.36, -12.15), "roller bearing": (0.14, 1.10, 10.15)}
ROW_FORCES_N = np.array([20.0, 40.0, 80.0])
# A row fits if it is nowhere farther off: the error after correction that the paper states.
FITS_PCT = 5.0
RELABEL_N = (1.0, 2.0, 3.0, 5.0)
# Time between two readings of the shipped twin.
READING_S = 0.002
# Where labels are tabled for the rows: kinetic ratios that friction may have, forces that the jaws may hold.
RATIOS = np.arange(0.5, 1.001, 0.01)
HELD_N = np.arange(1.0, 61.0, 0.5)

TWIN = """schema = "gripgen.twin/1"
[wrist]
noise_n = {noise_n}
[robot]
lag_s = {lag_s}
[parts.shaft]
mesh = "asset:parts/long_shaft/part.stl"
mu = {mu}
kinetic_ratio = {ratio}
kinetic_fall_s = {fall_s}
scatter = {scatter}
imprint_mm3_per_n = 1.5
{effects}"""

LAW = """[[effects]]
name = "load_offset"
part = "shaft"
a = {}
b_n = {}
outside_fit = "extrapolate"
"""

SWEEP = """twin = "twin.toml"
design = "grid"
repetitions = {repetitions}
seed = {seed}
mechanics = "reduced"
images = "none"
trace = "full"
[vary]
part = ["shaft"]
grip_force_n = {forces}
{vary}
[pull]
stop_mm = 5.0
label_tolerance_n = 3.0
"""


@dataclass
class World:
    """What is simulated; `law` is (a, b in N) of a load_offset effect."""

    mu: float = 0.168
    ratio: float = 1.0
    fall_s: float = 0.03
    noise_n: float = 0.12
    scatter: float = 0.04
    lag_s: float = 0.1
    increment_n: float = 1.0
    step_s: float = 0.104
    law: tuple[float, float] | None = None
    vary: dict[str, Sequence[float]] = field(default_factory=dict)

    def effects(self) -> str:
        return LAW.format(*self.law) if self.law else ""


@dataclass
class Pull:
    """One simulated pull: its row of index.csv and its trace."""

    row: dict[str, str]
    time_s: Array
    desired_n: Array
    measured_n: Array

    def number(self, column: str) -> float:
        return float(self.row[column])


def gripgen(*arguments: str) -> None:
    binary = os.environ.get("GRIPGEN_BIN", "target/release/gripgen")
    done = subprocess.run([binary, *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"gripgen {' '.join(arguments)}: exit status {done.returncode}\n{done.stderr}")


def simulate(world: World, repetitions: int, seed: int, forces_n: Sequence[float] = tuple(GRIP_FORCES_N.tolist())) -> list[Pull]:
    """Runs a sweep of the world and reads labels and traces back."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        (work / "twin.toml").write_text(TWIN.format(effects=world.effects(), **vars(world)))
        vary = "\n".join(f'"{key}" = {list(values)}' for key, values in world.vary.items())
        (work / "sweep.toml").write_text(SWEEP.format(repetitions=repetitions, seed=seed, forces=list(forces_n), vary=vary))
        staircase = ["--set", f"pull.increment_n={world.increment_n}", "--set", f"pull.step_s={world.step_s}"]
        gripgen("sweep", str(work / "sweep.toml"), "-o", str(work / "run"), "-q", "--jobs", "1", *staircase)
        gripgen("export", str(work / "run"), "--to", "webdataset", "--no-images", "-o", str(work / "run.tar"), "-q")
        with (work / "run" / "index.csv").open(newline="") as index:
            rows = {int(row["index"]): row for row in csv.DictReader(index)}
        pulls = []
        with tarfile.open(work / "run.tar") as tar:
            for member in tar:
                if not member.name.endswith(".trace.npy"):
                    continue
                row = rows[int(member.name.split(".")[0])]
                if row["status"] == "slipped":
                    data = np.load(io.BytesIO(tar.extractfile(member).read())).astype(float)
                    pulls.append(Pull(row, *data[:, :3].T))
    return pulls


def label_n(pull: Pull, tolerance_n: float) -> float:
    """The label rule: the last reading within the tolerance of the command."""
    near = np.flatnonzero((np.abs(pull.measured_n - pull.desired_n) < tolerance_n) & (pull.time_s >= 0.0))
    return float(pull.measured_n[near[-1]]) if len(near) else math.nan


def lead_n(pull: Pull) -> float:
    """How far the command leads what the jaws hold when the whole contact slips."""
    at = int(np.searchsorted(pull.time_s, pull.number("slip_s") + 1e-9, side="right")) - 1
    return float(pull.desired_n[at]) - pull.number("limit_force_n")


def mean_lead_n(lag_s: float, increment_n: float, step_s: float) -> float:
    """Lead of a staircase over a first-order loop, averaged over the force at which the slip comes."""
    return 0.5 * increment_n / math.tanh(step_s / (2.0 * lag_s))


def formula_n(static_n: Array, ratio: Array | float, lead: Array | float) -> Array:
    """The label by the claim."""
    return np.maximum(np.multiply(ratio, static_n), static_n - (TOLERANCE_N - lead))


def walked_n(pull: Pull, ratio: float, fall_s: float) -> float:
    """The label rule on an exponential fall that begins with the slip, reading by reading, while the command goes on."""
    after_s = pull.time_s - pull.number("slip_s")
    force = pull.number("limit_force_n") * (ratio + (1.0 - ratio) * np.exp(-np.maximum(after_s, 0.0) / fall_s))
    return float(force[np.flatnonzero((after_s >= 0.0) & (np.abs(force - pull.desired_n) < TOLERANCE_N))[-1]])


def walked_mean_n(static_n: Array, ratio: float, fall_s: float, lag_s: float, increment_n: float, step_s: float) -> Array:
    """The same for each force that the jaws hold, without a simulation, averaged over where in a step the slip comes."""
    left = math.exp(-step_s / lag_s)
    most_n = increment_n / (1.0 - left)
    leads = most_n * (1.0 - (1.0 - left) * (np.arange(20) + 0.5) / 20)[:, None]
    after_s = np.arange(0.0, 6.0 * step_s / increment_n + 0.1, READING_S)
    ahead_n = leads + increment_n * np.floor((after_s + lag_s * np.log(most_n / leads)) / step_s)
    lost_n = static_n[:, None, None] * (1.0 - ratio) * (1.0 - np.exp(-after_s / fall_s))
    last = np.maximum(np.sum(ahead_n + lost_n < TOLERANCE_N, axis=-1, keepdims=True) - 1, 0)
    return static_n - np.take_along_axis(np.broadcast_to(lost_n, (*last.shape[:2], len(after_s))), last, axis=-1)[..., 0].mean(axis=1)


def line(forces_n: Array, ratios: Array) -> tuple[float, float, float, float]:
    """a, b, the standard error of b and the largest misfit in percent, of ratio = a + b / F_G by least squares."""
    design = np.column_stack([np.ones_like(forces_n), 1.0 / forces_n])
    (a, b_n), *_ = np.linalg.lstsq(design, ratios, rcond=None)
    left = ratios - design @ np.array([a, b_n])
    variance = float(left @ left) / max(len(ratios) - 2, 1)
    off = [abs(float(np.mean(left[forces_n == f])) / (a + b_n / f)) for f in np.unique(forces_n)]
    return float(a), float(b_n), math.sqrt(variance * np.linalg.inv(design.T @ design)[1, 1]), 100.0 * max(off)


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print(flush=True)


def size(off_n: Array) -> list[str]:
    return [f"{np.median(np.abs(off_n)):.2f}", f"{np.mean(np.abs(off_n) <= 0.3):.2f}", f"{np.max(np.abs(off_n)):.2f}"]


def study_labels(args: argparse.Namespace) -> None:
    keys = {"parts.shaft.kinetic_ratio": args.ratios, "robot.lag_s": args.lags_s, "parts.shaft.kinetic_fall_s": args.falls_s}
    clean = World(noise_n=0.0, scatter=0.0, mu=args.mu, increment_n=args.increment_n, step_s=args.step_s, vary=keys)
    noisy = World(mu=args.mu, increment_n=args.increment_n, step_s=args.step_s, vary=keys)
    runs = {"none": simulate(clean, 1, 1), "0.12 N, 4 %": simulate(noisy, args.repetitions, 2)}
    fits, errors = [], []
    for noise, pulls in runs.items():
        every: list[Array] = []
        for lag_s, fall_s in itertools.product(args.lags_s, args.falls_s):
            mean_lead = mean_lead_n(lag_s, args.increment_n, args.step_s)
            mine = [p for p in pulls if p.number("robot.lag_s") == lag_s and p.number("parts.shaft.kinetic_fall_s") == fall_s]
            columns = ("max_pull_force_n", "limit_force_n", "parts.shaft.kinetic_ratio", "grip_force_n")
            label, static, ratio, forces = (np.array([p.number(column) for p in mine]) for column in columns)
            leads = np.array([lead_n(p) for p in mine])
            walked = np.array([walked_n(p, r, fall_s) for p, r in zip(mine, ratio, strict=True)])
            off = [label - formula_n(static, ratio, leads), label - formula_n(static, ratio, mean_lead), label - walked]
            every.append(np.array(off))
            errors.append([noise, lag_s, fall_s, f"{mean_lead:.2f}", len(label), *size(off[0]), *size(off[1]), *size(off[2])])
            for r in args.ratios if noise != "none" else []:
                at = ratio == r
                a, b_n, error_n, worst = line(forces[at], label[at] / (2.0 * args.mu * forces[at]))
                holds = 2.0 * args.mu * GRIP_FORCES_N
                walks = walked_mean_n(holds, r, fall_s, lag_s, args.increment_n, args.step_s)
                said = [line(GRIP_FORCES_N, x / holds) for x in (formula_n(holds, r, mean_lead), walks)]
                knee = f"{(TOLERANCE_N - mean_lead) / (2.0 * args.mu * (1.0 - r)):.0f}"
                found = [f"{a:.3f}", f"{b_n:.2f} +- {error_n:.2f}", f"{b_n / a:.2f}"]
                fits.append([lag_s, fall_s, r, knee, *found, *[f"{x[1] / x[0]:.2f}" for x in said], f"{worst:.1f}"])
        both = np.concatenate(every, axis=1)
        errors.append([noise, "all", "all", "", both.shape[1], *size(both[0]), *size(both[1]), *size(both[2])])
    print(f"mu {args.mu}, c 2, steps of {args.increment_n} N each {args.step_s} s, {GRIP_FORCES_N[0]:.0f} to {GRIP_FORCES_N[-1]:.0f} N, r {args.ratios}.")
    print("Label less formula, N: median of size, share within 0.3 N, largest; l of each pull, mean l, and the rule walked over the fall.")
    table(["noise, scatter", "lag_s", "fall_s", "mean l", "pulls", *["median", "within 0.3", "largest"] * 3], errors)
    table(["lag_s", "fall_s", "r", "F*, N", "a", "b, N", "b/a, N", "b/a of formula", "b/a walked", "largest misfit, %"], fits)
    light(args)


def light(args: argparse.Namespace) -> None:
    """Labels over c mu F_G below the forces that the laws are fitted to."""
    rule = World(mu=args.mu, ratio=0.8)
    pulls = simulate(rule, 10, 3)
    forces, label = (np.array([p.number(column) for p in pulls]) for column in ("grip_force_n", "max_pull_force_n"))
    a, b_n, _, _ = line(forces, label / (2.0 * args.mu * forces))
    few = (5.0, 7.5, 10.0, 15.0, 20.0)
    rows = []
    for name, world, seed in (("label rule, r 0.8", rule, 4), ("load_offset", World(mu=args.mu, law=(a, b_n)), 5)):
        mine = simulate(world, 10, seed, few)
        at = {f: [p.number("max_pull_force_n") for p in mine if p.number("grip_force_n") == f] for f in few}
        rows.append([name, *[f"{np.mean(x) / (2.0 * args.mu * f):.2f}" for f, x in at.items()]])
    rows.append([f"fit to 20 to 80 N, a {a:.3f}, b {b_n:.2f} N", *[f"{a + b_n / f:.2f}" for f in few]])
    print("Mean label over 2 mu F_G, ten pulls each:")
    table(["", *[f"{f:g} N" for f in few]], rows)


def misfit(predicted: Array, wanted: Array) -> Array:
    return np.sqrt(np.mean((predicted / wanted - 1.0) ** 2, axis=-1))


def best_linear(wanted: Array, columns: list[Array]) -> tuple[Array, Array]:
    """Least squares in relative errors; returns prediction and coefficients."""
    design = np.column_stack(columns)
    coefficients, *_ = np.linalg.lstsq(design / wanted[:, None], np.ones_like(wanted), rcond=None)
    return design @ coefficients, coefficients


def rule_row(wanted: Array, c: int, labels: Array) -> tuple[Array, float, float]:
    """Best mu and r of a row, from labels for each of RATIOS and HELD_N."""
    mus = np.linspace(0.7, 1.5, 401) * wanted.mean()
    held = c * mus[:, None] * ROW_FORCES_N
    predicted = np.array([np.interp(held, HELD_N, of_ratio) for of_ratio in labels]) / (c * ROW_FORCES_N)
    i, j = np.unravel_index(np.argmin(misfit(predicted, wanted)), predicted.shape[:2])
    return predicted[i, j], float(mus[j]), float(RATIOS[i])


def study_rows(args: argparse.Namespace) -> None:
    f = ROW_FORCES_N
    wanted = {part: mu * (a + b_n / f) for part, (mu, a, b_n) in ROWS.items()}
    summary, details = [], []

    def squares(predicted: dict[str, Array]) -> float:
        return sum(float(misfit(predicted[part], wanted[part])) ** 2 for part in predicted)

    def add(name: str, free: str, predicted: dict[str, Array], said: dict[str, str]) -> None:
        off = {part: 100.0 * np.abs(x / wanted[part] - 1.0) for part, x in predicted.items()}
        cells = [f"{math.sqrt(np.mean(off[part] ** 2)):.1f} ({np.max(off[part]):.1f})" if part in off else "" for part in wanted]
        rms = 100.0 * math.sqrt(squares(predicted) / len(predicted))
        summary.append([name, free, *cells, f"{rms:.1f}", sum(bool(np.max(d) < FITS_PCT) for d in off.values())])
        details.extend([name, part, *[f"{x:.3f}" for x in predicted[part]], text] for part, text in said.items())

    def rule(name: str, free: str, c: int, tables: dict[str, Array], parts: Iterable[str] = ROWS) -> None:
        """The table of labels, one for each value of what all parts share, that fits best."""
        fits = {shared: {part: rule_row(wanted[part], c, labels) for part in parts} for shared, labels in tables.items()}
        best = min(fits, key=lambda shared: squares({part: x[0] for part, x in fits[shared].items()}))
        said = {part: f"{best}, mu {mu:.3f}, r {ratio:.2f}" for part, (_, mu, ratio) in fits[best].items()}
        add(f"{name}, c = {c}", free, {part: x[0] for part, x in fits[best].items()}, said)

    by_lead = {f"l {x:.2f} N": formula_n(HELD_N, RATIOS[:, None], x) for x in np.arange(0.0, 2.95, 0.05)}
    by_rig = {
        f"lag {lag} s, fall {fall} s": np.array([walked_mean_n(HELD_N, r, fall, lag, args.increment_n, args.step_s) for r in RATIOS])
        for lag, fall in itertools.product((0.02, 0.05, 0.08, 0.12, 0.16, 0.2), (0.005, 0.01, 0.03, 0.1))
    }
    no_less = {shared: x for shared, x in by_lead.items() if float(shared.split()[1]) > 0.59}
    two = ("ball bearing", "shaft")
    for c in (2, 1):
        rule("label rule", "9: l; mu, r each", c, by_lead)
        rule("label rule, l >= 0.6 N", "9: l; mu, r each", c, no_less)
        rule("label rule, two rows", "5: l; mu, r each", c, by_lead, two)
        rule("rule walked", "10: lag, fall; mu, r each", c, by_rig)
        rule("rule walked, two rows", "6: lag, fall; mu, r each", c, by_rig, two)

    def linear(name: str, free: str, column: Callable[[Array], Array], note: Callable[[Array], str]) -> None:
        fits = {part: best_linear(w, [np.ones_like(f), column(f)]) for part, w in wanted.items()}
        add(name, free, {p: v[0] for p, v in fits.items()}, {p: note(v[1]) for p, v in fits.items()})

    linear("grip force loss F0 of each part", "8: mu, F0 each", lambda x: 1.0 / x, lambda k: f"mu {k[0]:.3f}, F0 {-k[1] / k[0]:+.1f} N")
    linear("wrist zero z of each part", "8: mu, z each", lambda x: 1.0 / x, lambda k: f"mu {k[0]:.3f}, z {2 * k[1]:+.2f} N (c 2), {k[1]:+.2f} N (c 1)")
    linear("interlock, mu_eff = mu (1 + s F_G)", "8: mu, s each", lambda x: x, lambda k: f"mu {k[0]:.3f}, s {1e3 * k[1] / k[0]:+.2f} per kN")

    losses = [(f"one grip force loss, {x:+.2f} N", {p: best_linear(w, [1.0 - x / f])[0] for p, w in wanted.items()}) for x in np.arange(-3.0, 12.0, 0.05)]
    zeros = []
    for z in np.arange(-3.0, 3.0, 0.02):
        zeros.append((f"one wrist zero, {z:+.2f} N (c 2)", {p: best_linear(w - z / (2 * f), [f**0])[0] + z / (2 * f) for p, w in wanted.items()}))
    for free, tried in (("5: F0; mu each", losses), ("5: z; mu each", zeros)):
        add(*min(((name, free, fits) for name, fits in tried), key=lambda x: squares(x[2])), {})
    add("plain friction", "4: mu each", {part: best_linear(w, [np.ones_like(f)])[0] for part, w in wanted.items()}, {})
    print(f"Misfit of mu_eff at 20, 40 and 80 N: rms (largest), %. A row fits below {FITS_PCT:.0f} % everywhere. r from 0.5 to 1.")
    table(["explanation", "free parameters", *ROWS, "all, rms", "rows that fit"], summary)
    table(["explanation", "part", "at 20 N", "40 N", "80 N", "found"], details)


def relabelled(pulls: list[Pull], mu: float) -> dict[str, tuple[float, float, float]]:
    """a, b, and the standard error of b for each rule."""
    forces = np.array([p.number("grip_force_n") for p in pulls])
    labels = {f"{t:.0f} N": np.array([label_n(p, t) for p in pulls]) for t in RELABEL_N}
    stored = np.array([p.number("max_pull_force_n") for p in pulls])
    if np.max(np.abs(labels["3 N"] - stored)) > 1e-3:
        raise SystemExit("labels from the traces differ from those of index.csv")
    labels["peak"] = np.array([p.number("peak_force_n") for p in pulls])
    return {rule: line(forces[np.isfinite(x)], x[np.isfinite(x)] / (2.0 * mu * forces[np.isfinite(x)]))[:3] for rule, x in labels.items()}


def campaigns(world: World, seed: int, args: argparse.Namespace) -> list[dict[str, tuple[float, float, float]]]:
    return [relabelled(simulate(world, args.pulls, seed + k), args.mu) for k in range(args.campaigns)]


def study_tolerance(args: argparse.Namespace) -> None:
    print(f"{args.campaigns} campaigns a world, 13 forces x {args.pulls} pulls; noise 0.12 N, scatter 4 %, fall 30 ms, steps of {args.increment_n} N.")
    counts, means = [], []
    for ratio, lag_s in itertools.product(args.worlds_r, args.worlds_lag_s):
        plain = World(mu=args.mu, ratio=ratio, lag_s=lag_s, increment_n=args.increment_n, step_s=args.step_s)
        worlds = {"label rule": campaigns(plain, 100, args)}
        law = tuple(float(np.mean([x["3 N"][i] for x in worlds["label rule"]])) for i in (0, 1))
        for r in args.laws_r:
            worlds[f"load_offset, r {r}"] = campaigns(replace(plain, ratio=r, law=law), 200, args)
        for name, fits in worlds.items():
            of_rule = {rule: [x[rule][1] / x[rule][0] for x in fits] for rule in fits[0]}
            means.append([ratio, lag_s, name, *[f"{np.mean(x):.2f} +- {np.std(x, ddof=1):.2f}" for x in of_rule.values()]])
            for other in ("1 N", "2 N", "5 N", "peak"):
                # Threshold: three standard errors of the difference, from the scatter of this campaign's own labels.
                change = [x["3 N"][1] - x[other][1] for x in fits]
                limit = [3.0 * math.hypot(x["3 N"][2], x[other][2]) for x in fits]
                moved = sum(abs(d) > t for d, t in zip(change, limit, strict=True))
                right = moved if name == "label rule" else len(fits) - moved
                span = f"{np.mean(change):+.2f} ({min(change):+.2f} to {max(change):+.2f})"
                counts.append([ratio, lag_s, name, f"b(3 N) - b({other})", span, f"{np.mean(limit):.2f}", f"{right} of {len(fits)}"])
    table(["r", "lag_s", "world", "b/a, N: 1 N", "2 N", "3 N", "5 N", "peak"], means)
    table(["r", "lag_s", "world", "change", "mean (range), N", "threshold, N", "told rightly"], counts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", choices=["labels", "rows", "tolerance", "all"])
    parser.add_argument("--mu", type=float, default=0.168)
    parser.add_argument("--increment-n", type=float, default=1.0, help="step of the command")
    parser.add_argument("--step-s", type=float, default=0.104, help="time of a step")
    parser.add_argument("--ratios", type=float, nargs="+", default=[0.6, 0.7, 0.8, 0.85, 0.9, 0.95], help="kinetic ratios of `labels`")
    parser.add_argument("--lags-s", type=float, nargs="+", default=[0.05, 0.12], help="lags of `labels`")
    parser.add_argument("--falls-s", type=float, nargs="+", default=[0.03, 0.1], help="fall times of `labels`")
    parser.add_argument("--repetitions", type=int, default=10, help="noisy pulls a setting of `labels`")
    parser.add_argument("--worlds-r", type=float, nargs="+", default=[0.6, 0.8], help="kinetic ratios of `tolerance`")
    parser.add_argument("--worlds-lag-s", type=float, nargs="+", default=[0.1], help="lags of `tolerance`")
    parser.add_argument("--laws-r", type=float, nargs="+", default=[1.0, 0.9], help="kinetic ratios of the worlds with the law")
    parser.add_argument("--campaigns", type=int, default=10)
    parser.add_argument("--pulls", type=int, default=10, help="pulls at each force of a campaign of `tolerance`")
    args = parser.parse_args()
    for name, study in (("labels", study_labels), ("rows", study_rows), ("tolerance", study_tolerance)):
        if args.study in (name, "all"):
            study(args)


if __name__ == "__main__":
    main()
