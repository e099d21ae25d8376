"""Thirty pulls, a diagnosis, a corrected twin, a new training set, the same network: `python -m research.transfer.loop --work DIR`.

Worlds of W2 with one effect that no twin declares. Half of the parts are pulled, the other half is predicted. README.md has design and figures.
"""

import argparse
import csv
import json
import pickle
import re
import tomllib
from pathlib import Path

import numpy as np

from research.transfer import features, loop_report, scores, sets
from research.transfer.network import SMALL_N, Network, Prediction, Ridge
from research.transfer.run import Table, kept, rows, table_of, trained
from research.transfer.undeclared import EFFECTS, TYPICAL
from research.transfer.worlds import LOGGED, PARTS, Effect, world

TRAINING_TWIN = "asset:configs/twin-training.toml"
WORLDS, PULLS_PER_PART, DRAWS = 8, 5, 100
STICKS_KPA = (0.0, 0.0, 0.0, 0.0, 0.0, 2.6, 4.5, 7.7, 13.3, 22.9)  # the prior of friction.toml: pulls say nothing of it, images may
STICKS = "effects.adhesion.stress_kpa"
PRESSURE_KPA = 250.0  # 15 N on 60 mm2: what a stress without pressure adds is taken off mu, so that the level stays that of the pulls
MARGIN = 5.0  # a twin is believed if its network makes the pulls likelier by this than the uncorrected one: it has seen their labels before
LEAST_SPREAD, PART_SPREAD = 0.05, 0.15  # of ln mu, from part to part: at least, and as fine-tuning assumes
STRENGTHS = (0.0, 0.1, 0.3, 0.6, 1.0)  # of the last layer that fine-tuning moves, in units of its own weights
# What the lab notes and varies; every training set has these ranges.
CONDITIONS = """
dwell_s = { log_uniform = [0.5, 30.0] }
temperature_c = { uniform = [16.0, 30.0], per = "session" }
pull_index = { one_of = [0, 1, 3, 6, 10, 15, 20, 30, 40, 55, 70, 85, 100, 120] }
"""
# Laws of which any lab may have any, as wide as the sources of docs/model.md say; each rig has its own.
WIDE = """
"effects.load_offset.b_n" = { normal = [0.0, 5.0], per = "rig", limits = [-4.0, 15.0] }
"effects.area_saturation.saturation_per_n" = { uniform = [0.0, 0.03], per = "rig" }
"effects.off_centre.inverse_lever_per_mm" = { uniform = [0.0, 0.2], per = "rig" }
"effects.wear.depth" = { uniform = [0.0, 0.5], per = "rig" }
"effects.wear.n0" = { log_uniform = [10.0, 1000.0], per = "rig" }
"effects.grip_force_loss.loss_n" = { uniform = [0.0, 5.0], per = "rig" }
"effects.anisotropy.amplitude" = { uniform = [0.0, 0.3], per = "rig" }
"effects.anisotropy.axis_deg" = { uniform = [-90.0, 90.0], per = "rig" }
"effects.temperature.k_per_k" = { uniform = [-0.01, 0.05], per = "rig" }
"effects.dwell_ageing.beta" = { uniform = [0.0, 0.15], per = "rig" }
"""
# Of the priors of rigs a corrected twin keeps what pulls say nothing of.
KEPT = """
"effects.grip_split.split" = { normal = [0.0, 0.10], limits = [-0.4, 0.4] }
"effects.jaw_tilt.difference_deg" = { normal = [0.0, 1.4], per = "rig", spread = { grip = 0.4 }, limits = [-5.0, 5.0] }
"parts.*.kinetic_fall_s" = { log_uniform = [0.002, 0.1], per = "gel" }
"""


def told(table: Table) -> np.ndarray:
    """What a network is told of a grip in addition to images: ln F_G and what the lab notes."""
    seen = dict(zip(LOGGED, table["logged"].T))
    turn = 2 * np.radians(seen["grip_angle_deg"])
    columns = [np.log(table["force_n"]), np.abs(seen["grip_offset_mm"]) / 5, np.log(seen["dwell_s"]), seen["temperature_c"] / 4,
               np.log1p(seen["pull_index"]), 2 * np.cos(turn), 2 * np.sin(turn)]
    return np.stack(columns, 1)


def training_text(work: Path, name: str, lines: str, priors: tuple[str, ...], twin: str = TRAINING_TWIN, vary: str = "") -> str:
    """training.toml with these priors, others in `lines`, another twin, and further lines of [vary]."""
    effects = sorted(set(re.findall(r"effects\.(\w+)\.", lines)))
    own = work / f"priors-{name}.toml"
    own.write_text("".join(f'[[effects]]\nname = "{e}"\n\n' for e in effects) + "[vary]" + lines)
    files = ", ".join([*(f'"asset:priors/{p}.toml"' for p in priors), f'"{own.name}"'])
    text = re.sub(r"(?m)^priors = .*$", f"priors = [{files}]", (sets.CONFIGS / "training.toml").read_text())
    return text.replace('"twin-training.toml"', f'"{twin}"') + CONDITIONS + vary


def swept(name: str, text: str, work: Path, samples: int, rig_key: str = "") -> Table:
    """Features of a training set, made once."""
    def make() -> Table:
        """Sweeps, reads, and shows each grip under other lights too."""
        config, run = work / f"{name}.toml", work / f"run-{name}"
        config.write_text(text)
        keys = [f"samples={samples}", "images.storage=clean"]
        sets.gripgen("sweep", str(config), *(a for k in keys for a in ("--set", k)), "-j", "1", "-o", str(run), "--quiet", "--allow-constant")
        found = sets.read(run, rig_key)
        other, rng = [], np.random.default_rng(3)
        for change in np.array_split(found.change, 16):
            other.append(features.of_grips(features.other_lights(change, rng)))
        return table_of(found, False) | {"x_other": np.concatenate(other)}

    return kept(work / f"set-{name}.npz", make)


def pulled(table: Table, half: int) -> np.ndarray:
    """Rows of the thirty pulls: of every other part five, spread over the grip forces."""
    found = []
    for part in range(half, PARTS, 2):
        own = np.flatnonzero(table["part"] == part)
        own = own[np.argsort(table["force_n"][own])]
        found.extend(own[np.linspace(0, len(own) - 1, PULLS_PER_PART).round().astype(int)])
    made = table["logged"][:, [LOGGED.index("session"), LOGGED.index("pull_index")]]
    return np.array(sorted(found, key=lambda i: tuple(made[i])))


def write_campaign(folder: Path, table: Table, few: np.ndarray, without: Effect | None = None) -> None:
    """The pulls as a lab writes them down: labels alone, a gel for two sessions, two minutes a pull, half an hour between sessions.

    `without`: labels divided by an effect that is taken for granted, for a calibration of all else."""
    ledger = dict(zip(LOGGED, table["logged"].T)) | {"grip_force_n": table["force_n"]}
    of_normal, of_friction = without(ledger) if without else (1.0, 1.0)
    label_n = table["label_n"] / (of_normal * of_friction)
    folder.mkdir(exist_ok=True)
    with (folder / "pulls.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["pull_id", "part", "gel_id", "grip_force_n", *LOGGED, "time_s", "pull_direction", "max_pull_force_n"])
        for i in few:
            seen = dict(zip(LOGGED, table["logged"][i]))
            session, index = int(seen["session"]), int(seen["pull_index"])
            cells = [session if k == "session" else index if k == "pull_index" else round(v, 3) for k, v in seen.items()]
            time_s = 120 * index + 1800 * session + 50_000 * (session // 2)
            out.writerow([f"p{i:03d}", f"part{table['part'][i]}", f"g{session // 2}", round(table["force_n"][i], 2), *cells, time_s, 1,
                          round(label_n[i], 3)])
    (folder / "campaign.toml").write_text('force_convention = "per_jaw"\nlabel_tolerance_n = 3.0\nstop_mm = 12.0\nfeedback = "independent"\n')


def fitted_twin(name: str, work: Path, verb: tuple[str, ...]) -> Path:
    """The twin that a diagnosis or a calibration of a campaign writes, with its posterior."""
    out = work / f"twin-{name}.toml"
    if not out.exists():
        sets.gripgen(*verb, str(work / f"campaign-{name}"), "--twin", TRAINING_TWIN, "-o", str(out),
                     "--json", str(work / f"report-{name}.json"), "--force", "--quiet")
    return out


def write_draws(twin: Path, parts: list[str], path: Path, forced: dict[str, float]) -> None:
    """The posterior of the pulled parts for parts that were not pulled: what acts and the rig as drawn, mu of a part by the level of
    the draw and the spread from part to part that the pulls show, and a stress without pressure as in the priors.

    `forced`: parameters of effects that act in every draw."""
    with twin.with_suffix(".posterior.csv").open(encoding="utf-8") as file:
        posterior = list(csv.DictReader(file))
    rng = np.random.default_rng(7)
    weight = np.array([float(r["weight"]) for r in posterior])
    weight /= weight.sum()
    own = [k for k in posterior[0] if re.fullmatch(r"parts\.part\d+\.mu", k)]
    logs = np.log([[float(r[k]) for k in own] for r in posterior])
    level = logs.mean(1)
    apart = logs - level[:, None]
    middle = weight @ apart
    within = float((weight @ (apart - middle) ** 2).mean())
    spread = float(np.sqrt(max(middle.var(ddof=1) - within, LEAST_SPREAD**2)))
    written = tomllib.loads(twin.read_text())["parts"]
    scatter = float(np.median([written[k.split(".")[1]]["scatter"] for k in own]))
    keys = [k for k in posterior[0] if k.startswith("robot.") or k.count(".") == 2 and k.startswith("effects.")]
    at = np.searchsorted(np.cumsum(weight), (np.arange(DRAWS) + rng.uniform()) / DRAWS).clip(max=len(weight) - 1)
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        of_parts = [f"parts.{p}.{k}" for k in ("mu", "kinetic_ratio", "scatter") for p in parts]
        out.writerow(["weight", "cause", *keys, *forced, STICKS, *of_parts])
        for i in at:
            shared = level[i] + spread / np.sqrt(len(own)) * rng.standard_normal()
            sticks_kpa = rng.choice(STICKS_KPA)
            rest = max(1 - sticks_kpa / PRESSURE_KPA / np.exp(shared), 0.3)
            mu = (rest * np.exp(shared + spread * rng.standard_normal(len(parts)))).clip(0.005, 3.0)
            ratio = posterior[i][own[0].replace(".mu", ".kinetic_ratio")]
            shared_values = [posterior[i][k] for k in keys] + [*forced.values(), sticks_kpa]
            out.writerow([1 / DRAWS, posterior[i]["cause"], *shared_values, *mu, *[ratio] * len(parts), *[scatter] * len(parts)])


def corrected_text(work: Path, name: str, twin: Path, table: Table, forced: dict[str, float]) -> tuple[str, str]:
    """The training set of a corrected twin, and the key that tells its draws apart."""
    parts = re.findall(r"(?m)^\[parts\.(\w+)\]", (sets.CONFIGS / "twin-training.toml").read_text())
    write_draws(twin, parts, work / f"draws-{name}.csv", forced)
    steps = {k: table["logged"][0, LOGGED.index(k)] for k in LOGGED[-2:]}
    vary = f'twin = {{ from = "posterior", file = "draws-{name}.csv" }}\npart = {json.dumps(parts)}\n'
    vary += f'"pull.increment_n" = [{steps["force_increment_n"]}]\n"pull.step_s" = [{steps["step_time_s"]}]\n'
    return training_text(work, name, KEPT, ("gel",), twin.name, vary), f"parts.{parts[0]}.mu"


def fine_tuned(network: Network, x: np.ndarray, few: np.ndarray, label_n: np.ndarray, part: np.ndarray) -> tuple[Prediction, float]:
    """A network whose two numbers of the rig and whose last layer are fitted to a few pulls (a Gaussian process on learnt features).

    How far the last layer may move is chosen on pulls of parts that are left out in turn. The largest log-likelihood of the pulls over
    these choices, mean over the members, is handed back too."""
    y, scaled = np.log(label_n + SMALL_N), network.scaled(x)
    members = []
    for p, spread in network.members:
        _, hidden, mean, raw = Network.layers(p, scaled)
        rig = np.stack([np.full(len(x), spread[0]), spread[1] * (scaled @ p[7])], 1)
        layer = np.concatenate([hidden, scaled], 1) / np.sqrt(hidden.shape[1] + scaled.shape[1])
        members.append((mean, np.exp(2 * np.clip(raw, -4, 1)), rig @ rig.T, layer @ layer.T))

    def fitted(given: np.ndarray, strength: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Means and variances of all pulls, one row for each member, and the log-likelihood of the given ones."""
        means, variances, likely = [], [], []
        same = PART_SPREAD**2 * (part[given][:, None] == part[given])
        for mean, variance, of_rig, of_layer in members:
            k = of_rig + strength**2 * of_layer
            s = k[np.ix_(given, given)] + np.diag(variance[given]) + same
            away, gain = y[given] - mean[given], np.linalg.solve(s, k[given])
            means.append(mean + gain.T @ away)
            variances.append(variance + np.diag(k) - (gain * k[given]).sum(0))
            likely.append(-0.5 * away @ np.linalg.solve(s, away) - 0.5 * np.linalg.slogdet(s)[1])
        return np.stack(means), np.stack(variances), float(np.mean(likely))

    def error(strength: float) -> float:
        """Of parts that are left out in turn."""
        found = [(y - fitted(few[part[few] != k], strength)[0].mean(0))[few[part[few] == k]] for k in np.unique(part[few])]
        return scores.rmse(np.concatenate(found))

    means, variances, _ = fitted(few, min(STRENGTHS, key=error))
    likely = max(fitted(few, strength)[2] for strength in STRENGTHS)
    return Prediction(means.mean(0), np.sqrt(variances.mean(0) + means.var(0))), likely


def network_of(table: Table, seed: int, path: Path) -> Network:
    """The network of a training set, made once."""
    if not path.exists():
        usable = rows(table, ~table["trails"])
        told_too = {k: np.concatenate([usable[k], told(usable)], 1) for k in ("x", "x_other")}
        path.write_bytes(pickle.dumps(trained(usable | told_too, "images", seed, True)))
    return pickle.loads(path.read_bytes())


def networks_of(name: str, kind: str, table: Table, few: np.ndarray, wrong: int | None,
                args: argparse.Namespace) -> dict[str, list[Network]]:
    """Networks of the twin that a diagnosis corrects, or on which the effect of world `wrong` is forced: pulls, fit, sweep, training.

    One of all draws, one of the draws that do not stick."""
    work, without = args.work, None if wrong is None else EFFECTS[wrong]
    write_campaign(work / f"campaign-{name}", table, few, without)
    twin = fitted_twin(name, work, ("diagnose",) if wrong is None else ("calibrate", "pulls"))
    text, key = corrected_text(work, name, twin, table, {} if wrong is None else {f"effects.{k}": v for k, v in TYPICAL[wrong].items()})
    data = swept(name, text, work, args.samples, key)
    with (work / f"draws-{name}.csv").open(encoding="utf-8") as file:
        plain = [f"{float(r[key]):.12g}" for r in csv.DictReader(file) if float(r[STICKS]) == 0]
    found = {kind: data, f"{kind}, dry": rows(data, np.isin(data["rig"], plain))}
    return {k: [network_of(t, seed, work / f"network-{name}-{k[-3:]}-{seed}.pkl") for seed in range(args.seeds)]
            for k, t in found.items()}


def errors_of(table: Table, few: np.ndarray, networks: dict[str, list[Network]]) -> tuple[dict[str, float], dict[str, float]]:
    """RMSE in newtons on the parts that were not pulled, mean over the seeds, and how likely each network makes the pulls."""
    part, label_n, force_n = table["part"], table["label_n"], table["force_n"]
    unseen = np.flatnonzero(part % 2 != part[few[0]] % 2)
    x = np.concatenate([table["x"], told(table)], 1)

    def error(p: Prediction) -> float:
        """Of the expected labels."""
        return scores.rmse(p.expected_n()[unseen] - label_n[unseen])

    found, likely = {"mean label": float(label_n[unseen].mean())}, {}
    for kind, seeds in networks.items():
        tuned = [fine_tuned(n, x, few, label_n, part) for n in seeds]
        likely[kind] = float(np.mean([e for _, e in tuned]))
        found[kind] = float(np.mean([error(n(x)) for n in seeds]))
        found[f"{kind}, tuned"] = float(np.mean([error(p) for p, _ in tuned]))
    for twin, result in (("corrected", "loop"), ("wrong", "loop, wrong")):
        if twin in networks:
            best = max((twin, f"{twin}, dry"), key=lambda k: likely[k])
            found[f"{twin}, best"] = found[f"{best}, tuned"]
            found[result] = found[f"{best if likely[best] > likely['no correction'] + MARGIN else 'no correction'}, tuned"]
    found["a F_G"] = scores.rmse(label_n[unseen] - scores.factor(force_n[few], label_n[few]) * force_n[unseen])
    found["line on the pulls"] = error(Ridge(told(table)[few], label_n[few], 3.0)(told(table)))
    found["a F_G per part, of all its other pulls"] = scores.per_part(force_n[unseen], label_n[unseen], part[unseen])
    return found, likely


def answer_of(report: Path) -> str:
    """What a diagnosis says, in its own names."""
    found = json.loads(report.read_text())
    names = [e["name"] for e in found["effects"]] + [f"unnamed, {e['covariate']}" for e in found["unknown"]]
    return " + ".join(names) or found["verdict"]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=1000, help="of each training set")
    parser.add_argument("--seeds", type=int, default=2, help="of the networks")
    parser.add_argument("--world-seed", type=int, default=4001)
    parser.add_argument("--halves", type=int, choices=(1, 2), default=2, help="1: even parts are pulled, and not the odd ones in their turn")
    parser.add_argument("--no-wrong", action="store_true", help="no wrong diagnosis is forced")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)

    networks = {}
    for kind, file, lines in (("no correction", "base", "\n"), ("wide", "wide", WIDE)):
        data = swept(file, training_text(args.work, file, lines, ("friction", "gel", "rig")), args.work, args.samples)
        networks[kind] = [network_of(data, seed, args.work / f"network-{file}-{seed}.pkl") for seed in range(args.seeds)]
    errors, firsts, names, answers = [], [], [], []
    for number, effect in enumerate(EFFECTS):
        table = kept(args.work / f"features-w{number}.npz", lambda: table_of(world(number, args.world_seed, effect), False))
        halves, said = [], []
        for half in range(args.halves):
            name, few = f"w{number}{'ab'[half]}", pulled(table, half)
            corrected = networks_of(name, "corrected", table, few, None, args)
            if half == 0 and not args.no_wrong:
                corrected |= networks_of(f"{name}-wrong", "wrong", table, few, (number + 3) % WORLDS, args)
            found, likely = errors_of(table, few, networks | corrected)
            halves.append(found)
            said.append(answer_of(args.work / f"report-{name}.json"))
            print(number, half, effect.__name__, said[-1], {k: round(v, 1) for k, v in likely.items()}, flush=True)
        errors.append({k: float(np.sqrt(np.mean([h[k] ** 2 for h in halves]))) for k in halves[-1] if "wrong" not in k})
        firsts.append(halves[0])
        names.append(effect.__name__.replace("_", " "))
        answers.append("; ".join(said))
    tables = (loop_report.verdict(errors), loop_report.ratios(errors), loop_report.by_world(errors, names, answers))
    text = "\n\n".join(tables if args.no_wrong else (*tables, loop_report.wrong(firsts)))
    (args.work / "loop.md").write_text(text + "\n")
    (args.work / "loop.json").write_text(json.dumps({"errors_n": errors, "first_half_n": firsts, "diagnoses": answers}, indent=1))
    (args.work / "loop.svg").write_text(loop_report.figure(errors, names))
    print(text)


if __name__ == "__main__":
    main()
