"""One case in, one campaign folder, its unseen pulls and its sealed truth out."""

from pathlib import Path

import numpy as np

from . import campaigns, cases, effects, engines, folders, ledger, literature, physics, unknowns

UNSEEN = 120
REPLICAS = 5


def build(case, seed, name, open_folder, sealed_folder):
    """Writes `open_folder/name` and `sealed_folder/name`; returns the truth's hash."""
    rng = np.random.default_rng(seed)
    world = physics.draw_world(rng)
    world.engine = case.get("engine", "")
    design = ledger.draw_design(rng, **case["design"])
    led = ledger.draw_ledger(design, rng)
    mu = campaigns.friction_of_parts(design, rng)
    plain = campaigns.expected(world, mu, led, [], np.ones((1, len(led["part"]))), rng, draws=1)
    design["largest_n"] = float(np.max(plain))
    acting, sizes = _acting(case, world, mu, led, design, rng)
    if world.engine:
        sizes.append({"name": world.engine, "library": False, "size": 1.0, "constants": {}, "multiple": float("nan"), "class": [],
                      "always_tied": [], "accepted": sorted(engines.ADMISSIBLE)})

    n = len(led["pull_index"])
    factor = campaigns.scatter_factors(world, n, rng, case["kind"])
    bad = np.zeros(n, bool)
    share = case.get("bad_share", 0.04 if case["kind"] == "outliers" else 0.0)
    if share:
        bad = rng.random(n) < share
        factor = np.where(bad, factor * rng.uniform(0.45, 0.75, n), factor)
    out = campaigns.run(world, mu, _as_made(case, led, rng), acting, factor)
    if case.get("wander_n"):
        _wander(out, case["wander_n"] * ledger._slow(n, rng, 0.9))
    label, noisy = campaigns.labels(world, out, rng)
    label = label * case.get("label_scale", 1.0) + case.get("label_shift_n", 0.0)
    if case.get("rounded_n"):
        label = np.round(label / case["rounded_n"]) * case["rounded_n"]
    seen = folders.measured_ledger(led, rng)
    place = Path(open_folder) / name
    folders.write_campaign(place, seen, label, design["distractors"], feedback=engines.feedback(world))
    which = {"fourth": range(0, n, 4), "all": range(n), "few": range(0, n, 8), "none": []}[design["traces"]]
    if len(which):
        folders.write_traces(place, which, out, noisy, world, rng)

    hidden = Path(sealed_folder) / name
    floor = _unseen(world, mu, design, acting, case, rng, hidden / "unseen")
    truth = {
        "group": case["group"], "kind": case["kind"], "seed": seed,
        "acts": sizes, "tied": case.get("tied", []), "outliers": [f"p{i:04d}" for i in np.flatnonzero(bad)],
        "floor_rmse_n": floor, "pulls": n, "design": {k: v for k, v in design.items()},
        "world": {
            "lag_s": world.lag_s, "dead_s": float(world.dead_s), "kinetic_ratio": world.kinetic_ratio,
            "stiffness_n_per_mm": world.stiffness_n_per_mm, "noise_n": float(world.noise_n),
            "scatter": world.scatter, "mu": {k: float(v) for k, v in mu.items()},
        },
    }
    return folders.write_truth(hidden / "truth.json", _plain(truth))


def _as_made(case, led, rng):
    """The pulls as they were made, which is not quite what was written down: steps of another length."""
    if not case.get("jitter"):
        return led
    spread = 1 + case["jitter"] * rng.standard_normal(len(led["pull_index"]))
    return dict(led, step_time_s=led["step_time_s"] * np.clip(spread, 0.7, 1.3))


def _wander(out, zero_n):
    """The zero of the sensor, another one in each pull."""
    out["force"] += zero_n[:, None].astype(np.float32)
    out["idle"] += zero_n[:, None].astype(np.float32)


def _acting(case, world, mu, led, design, rng):
    """Draws constants and sizes: the asked multiple of the detectable size, within bounds."""
    acting, told = [], []
    for name, multiple in case["acts"]:
        if name in literature.BOOK:
            acting.append(_formula(name, rng, design))
            told.append({"name": name, "library": False, "size": acting[-1].size, "constants": acting[-1].constants,
                         "multiple": float("nan"), "class": [], "always_tied": [], "accepted": literature.BOOK[name][3]})
            continue
        known = name in effects.LIBRARY
        constant = (effects if known else unknowns).constants(name, rng, design)
        sign = cases.size_sign(name, rng)
        unit, low, high = campaigns.detectable_size(world, mu, led, name, constant, rng, acting, sign)
        size = float(np.clip(multiple * unit, low, high))
        acting.append(campaigns.Acting(name, sign * size, constant))
        told.append({
            "name": name, "library": known, "size": sign * size, "constants": constant,
            "detectable": unit, "multiple": size / unit, "asked": multiple,
            "class": cases.class_of(name) if known else [],
            "always_tied": cases.ALWAYS_TIED.get(name, []),
            "accepted": [] if known else unknowns.UNKNOWN[name][3],
        })
    return acting, told


def _formula(name, rng, design):
    """A formula of the literature, its size drawn from its range."""
    low, high = literature.BOOK[name][1:3]
    return campaigns.Acting(name, float(rng.uniform(low, high)), literature.constants(name, rng, design))


def _unseen(world, mu, design, acting, case, rng, place):
    """The same campaign made again; returns the error of an oracle that knows the truth.

    Every pull is drawn `REPLICAS` times with the same covariates. The first draw is
    written; the mean of the others is the oracle's prediction.
    """
    tables = []
    # An engine takes a quarter of a second for a pull.
    unseen, replicas = (60, 3) if world.engine else (UNSEEN, REPLICAS)
    while sum(len(t["pull_index"]) for t in tables) < unseen:
        again = dict(design)
        fresh = ledger.draw_ledger(again, rng)
        tables.append(fresh)
    table = {k: np.concatenate([t[k] for t in tables]) for k in tables[0]}
    total = len(table["pull_index"])
    keep = np.sort(rng.permutation(total)[:unseen])
    table = {k: v[keep] for k, v in table.items()}
    draws = []
    for _ in range(replicas):
        factor = campaigns.scatter_factors(world, unseen, rng)
        draws.append(campaigns.labels(world, campaigns.run(world, mu, table, acting, factor), rng)[0])
    oracle = np.mean(draws[1:], axis=0)
    folders.write_campaign(place, folders.measured_ledger(table, rng), draws[0], design["distractors"], "u", engines.feedback(world))
    if case.get("expected"):
        few = {k: v[::2] for k, v in table.items()}
        seen = folders.measured_ledger(few, rng)
        mean = expected_labels(world, mu, few, acting, case, rng)
        folders.write_campaign(place.parent / "expected", seen, mean, design["distractors"], "e", engines.feedback(world))
    others = replicas - 1
    return float(np.sqrt(np.mean((draws[0] - oracle) ** 2) * others / (others + 1)))


# Places of a standard normal variable that stand for a fifth of its values each.
FIFTHS = [-1.3998, -0.5319, 0.0, 0.5319, 1.3998]


def expected_labels(world, mu, table, acting, case, rng, draws=6):
    """The mean label of each pull over scatter and noise: what nobody can predict better than."""
    n = len(table["pull_index"])
    total = np.zeros(n)
    for z in FIFTHS:
        factor = np.full(n, np.exp(1.04 * world.scatter * z - world.scatter**2 / 2))
        out = campaigns.run(world, mu, table, acting, factor)
        total += np.mean([campaigns.labels(world, out, rng)[0] for _ in range(draws)], axis=0)
    mean = total / len(FIFTHS)
    return mean * case.get("label_scale", 1.0) + case.get("label_shift_n", 0.0)


def _plain(value):
    """Numpy scalars out of nested plain data."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    return value
