"""The list of pulls of a campaign: what is set, in which order, and the clocks."""

import numpy as np

PARTS = ["ball_bearing", "long_shaft", "gear", "roller_bearing"]
FORCES = {
    "wide": [5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 80.0],
    "few": [8.0, 15.0, 30.0, 50.0, 75.0],
    "nine": [5.0, 10.0, 15.0, 20.0, 25.0, 40.0, 50.0, 60.0, 80.0],
    "paper": [20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0],
    "three": [25.0, 40.0, 55.0],
    "low": [5.0, 8.0, 11.0, 14.0, 17.0, 20.0, 30.0, 40.0, 60.0, 80.0],
}
BLOCK = 37
PAUSE_S = 1500.0


def draw_design(rng, **fixed):
    """Settings of a campaign; anything fixed by the case wins."""
    design = {
        "parts": int(rng.choice([1, 1, 2, 3])),
        "forces": str(rng.choice(["wide", "few", "nine", "low"])),
        "increments": [1.0] if rng.random() < 0.5 else [0.5, 1.0],
        "steps": [0.104],
        "dwells": [1.0],
        "directions": [1],
        "angles": [0.0],
        "offsets": [0.0],
        "count": int(rng.choice([80, 110, 160, 220])),
        "order": "random",
        "block": BLOCK,
        "gels": "one",
        "traces": "fourth",
        "distractors": [],
    }
    design.update(fixed)
    if design["count"] <= 80 and "traces" not in fixed:
        design["traces"] = "all"
    return design


def draw_ledger(design, rng):
    """True covariates, one array per column; `design` gets sessions and end."""
    n = design["count"]
    names = design.get("names") or [str(x) for x in rng.permutation(PARTS)[: design["parts"]]]
    design["names"] = names
    forces = design["forces"]
    levels = FORCES[forces] if isinstance(forces, str) else forces
    factors = {
        "part": names,
        "grip_force_n": levels,
        "force_increment_n": design["increments"],
        "step_time_s": design["steps"],
        "dwell_s": design["dwells"],
        "pull_direction": design["directions"],
        "grip_angle_deg": design["angles"],
        "grip_offset_mm": design["offsets"],
    }
    led = _factorial(factors, n, rng)
    if design["order"] == "sorted":
        order = np.lexsort((rng.random(n), led["grip_force_n"]))
        led = {k: v[order] for k, v in led.items()}
    index = np.arange(n)
    led["pull_index"] = index
    led["session"] = index // design["block"] + 1
    led["since_rest"] = index % design["block"]
    pause = np.where((index % design["block"] == 0) & (index > 0), PAUSE_S, 0.0)
    led["time_s"] = np.cumsum(rng.uniform(35, 75, n) + led["dwell_s"] * 0.8 + pause)
    led["temperature_c"] = _walk(n, led["session"], rng)
    led["gel_number"] = _gels(design, n, rng)
    led["humidity_pct"] = np.clip(47 + 18 * _slow(n, rng, 0.55), 25, 75)
    led["table_mm"] = rng.uniform(-250, 250, n).round(0)
    led["operator"] = rng.integers(0, 2, n)
    led["supplier"] = rng.choice(["a", "b", "c"], n)
    design["sessions"] = int(led["session"][-1])
    design["end_s"] = float(led["time_s"][-1])
    return led


def _factorial(factors, n, rng):
    """Balanced draw: each factor's levels appear equally often and the pairs nearly so."""
    names = list(factors)
    sizes = [len(factors[k]) for k in names]
    whole = int(np.prod(sizes))
    picks = np.concatenate([rng.permutation(whole) for _ in range(n // whole + 1)])[:n]
    columns = {}
    for name, size in zip(names, sizes):
        code = picks % size
        picks = picks // size
        columns[name] = np.array(factors[name])[code]
    return columns


def _slow(n, rng, keep):
    """Stationary walk of unit variance; `keep` is its lag-one correlation."""
    z = np.empty(n)
    z[0] = rng.standard_normal()
    for i in range(1, n):
        z[i] = keep * z[i - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
    return z


def _walk(n, session, rng):
    """Room temperature: reflected walk with jumps over the pauses."""
    t = np.empty(n)
    now = rng.uniform(20, 24)
    for i in range(n):
        step = rng.normal(0, 0.32)
        if i and session[i] != session[i - 1]:
            step += rng.normal(0, 1.5)
        now += step
        if now < 19.3:
            now = 38.6 - now
        if now > 24.8:
            now = 49.6 - now
        t[i] = np.clip(now, 19.3, 24.8)
    return t


def _gels(design, n, rng):
    if design["gels"] == "one":
        return np.ones(n, int)
    if design["gels"] == "blocks":  # changed in the middle of sessions
        return (np.arange(n) // 25) % 3 + 1
    return rng.integers(1, 3, n)
