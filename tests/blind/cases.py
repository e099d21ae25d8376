"""The cases of the benchmark: which group, which effect, which design.

A none, B one library effect, C two, D outside the library, T tied by design, E few data.
"""

import numpy as np

from . import effects, unknowns

SLOW_FAST = {"increments": [0.25, 1.0, 2.0], "steps": [0.104, 0.208]}
# What a design needs so that the effect can show at all.
EXCITES = {
    "load_offset": {"parts": 2, "mu_spread": True, "forces": "low"},
    "load_power_law": {"forces": "wide", "increments": [0.5, 2.0]},
    "area_saturation": {"forces": "nine"},
    "regime_transition": {"forces": "low"},
    "rate_dependence": dict(SLOW_FAST, forces="few"),
    "dwell_ageing": {"dwells": [0.5, 3.0, 20.0, 90.0], "forces": "few"},
    "anisotropy": {"angles": [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0], "forces": "few"},
    "contamination": {"count": 160},
    "wear": {"count": 220},
    "conditioning": {"count": 220, "block": 24},
    "temperature": {"count": 160},
    "grip_relaxation": {"dwells": [0.5, 3.0, 20.0, 90.0], "forces": "few"},
    "jaw_tilt": {"directions": [1, -1], "parts": 1},
    "off_centre": {"offsets": [0.0, 1.0, 2.0, 3.0, 5.0], "forces": "few"},
    "asymmetric_jaws": {"traces": "all"},
    "grip_force_loss": {"parts": 3, "mu_spread": True, "forces": "low", "count": 220},
    "sensor_gain": {"directions": [1, -1]},
    "sensor_bias": {"directions": [1, -1]},
    "sensor_drift": {"directions": [1, -1], "count": 160},
    "sensor_gain_drift": {"count": 220},
    "sensor_hysteresis": {"forces": "nine"},
    "sensor_quadratic": {"directions": [1, -1], "parts": 2},
    "sensor_saturation": {"parts": 2},
    "sensor_lowpass": dict(SLOW_FAST),
    "sensor_creep": dict(SLOW_FAST),
    "controller_gain": {},
    "deadband": {"increments": [0.5, 2.0], "steps": [0.104]},
}
# What labels and traces of this experiment cannot separate even by a good design.
ALWAYS_TIED = {
    "sensor_gain": ["controller_gain"],
    "controller_gain": ["sensor_gain"],
}
CLASSES = {
    "C1": ["load_offset", "sensor_bias", "grip_force_loss", "deadband", "sensor_lowpass", "sensor_hysteresis"],
    "C2": ["load_power_law", "rate_dependence", "sensor_creep"],
    "C3": ["area_saturation", "sensor_quadratic", "sensor_saturation"],
    "C4": ["sensor_gain", "controller_gain", "jaw_tilt", "asymmetric_jaws"],
    "C5": ["dwell_ageing", "grip_relaxation"],
    "C6": ["wear", "sensor_drift", "sensor_gain_drift", "temperature", "conditioning", "contamination"],
}
PAIRS = [
    ("load_offset", "dwell_ageing"), ("wear", "rate_dependence"), ("area_saturation", "temperature"),
    ("anisotropy", "contamination"), ("sensor_bias", "load_power_law"), ("jaw_tilt", "dwell_ageing"),
    ("off_centre", "regime_transition"), ("sensor_drift", "rate_dependence"), ("grip_relaxation", "anisotropy"),
    ("sensor_gain_drift", "off_centre"), ("deadband", "dwell_ageing"), ("temperature", "jaw_tilt"),
    ("sensor_bias", "wear"), ("conditioning", "rate_dependence"), ("sensor_quadratic", "dwell_ageing"),
]
NONE_KINDS = ["plain", "outliers", "autocorrelated", "sorted", "columns", "plain"]
FREE_COLUMNS = ["humidity_pct", "table_mm", "operator", "supplier"]


def mix(count):
    """How many cases of each group."""
    share = {"A": 0.20, "B": 0.45, "C": 0.11, "D": 0.13, "T": 0.06}
    numbers = {k: int(round(v * count)) for k, v in share.items()}
    numbers["E"] = count - sum(numbers.values())
    return numbers


def draw_cases(count, rng):
    """Plain descriptions, in mixed order so that a name says nothing."""
    cases = []
    for group, number in mix(count).items():
        cases += [MAKERS[group](i, rng) for i in range(number)]
    return [cases[i] for i in rng.permutation(len(cases))]


def _extras(rng):
    """Further settings that vary although nothing depends on them."""
    extra = {}
    if rng.random() < 0.35:
        extra["dwells"] = [1.0, 10.0, 60.0] if rng.random() < 0.5 else [0.5, 20.0]
    if rng.random() < 0.3:
        extra["directions"] = [1, -1]
    if rng.random() < 0.25:
        extra["angles"] = [0.0, 45.0, 90.0]
    if rng.random() < 0.2:
        extra["offsets"] = [0.0, 2.0, 4.0]
    if rng.random() < 0.25:
        extra["steps"] = [0.104, 0.208]
    return extra


def none(i, rng):
    kind = NONE_KINDS[i % len(NONE_KINDS)]
    fixed = _extras(rng)
    if kind == "sorted":
        fixed = {"order": "sorted", "forces": "paper"}
    if kind == "columns":
        fixed["distractors"] = [str(c) for c in rng.choice(FREE_COLUMNS, 2, replace=False)]
    return {"group": "A", "kind": kind, "acts": [], "design": fixed}


def one(i, rng):
    names = list(EXCITES)
    names.remove("asymmetric_jaws")
    name = names[i % len(names)]
    multiple = [2, 4, 2, 1][(i + i // len(names)) % 4]
    fixed = dict(_extras(rng), **EXCITES[name])
    if rng.random() < 0.2:
        fixed["distractors"] = [str(rng.choice(FREE_COLUMNS))]
    return {"group": "B", "kind": "one", "acts": [(name, multiple)], "design": fixed}


def two(i, rng):
    first, second = PAIRS[i % len(PAIRS)]
    fixed = {"count": 220}
    for name in (first, second):
        for key, value in EXCITES[name].items():
            if key == "count":
                fixed["count"] = max(fixed["count"], value)
            else:
                fixed[key] = value
    multiple = [3, 4][i % 2]
    return {"group": "C", "kind": "two", "acts": [(first, multiple), (second, multiple)], "design": fixed}


def outside(i, rng):
    names = list(unknowns.UNKNOWN)
    name = names[i % len(names)]
    multiple = [3, 4, 2][i % 3]
    fixed = dict(_extras(rng), count=220, distractors=list(unknowns.UNKNOWN[name][4]))
    if name == "force_rate":
        fixed.update(increments=[0.25, 1.0, 2.0], steps=[0.104, 0.208], forces="wide")
    if name == "gel":
        fixed["gels"] = "blocks"
    return {"group": "D", "kind": name, "acts": [(name, multiple)], "design": fixed}


TIED = [
    ("load_offset", {"forces": "nine"}, ["load_offset", "sensor_bias", "grip_force_loss"]),
    ("grip_force_loss", {"forces": "wide"}, ["load_offset", "sensor_bias", "grip_force_loss"]),
    ("sensor_bias", {"forces": "low"}, ["load_offset", "sensor_bias", "grip_force_loss"]),
    ("area_saturation", {"order": "sorted", "forces": "nine"}, ["area_saturation", "sensor_quadratic"]),
    ("sensor_quadratic", {"order": "sorted", "forces": "nine"}, ["area_saturation", "sensor_quadratic"]),
    ("wear", {"block": 10_000}, ["wear", "sensor_gain_drift"]),
    ("sensor_gain_drift", {"block": 10_000}, ["wear", "sensor_gain_drift"]),
]


def tied(i, rng):
    name, design, members = TIED[i % len(TIED)]
    fixed = dict({"parts": 1, "increments": [1.0], "steps": [0.104], "traces": "none"}, **design)
    return {"group": "T", "kind": "tied", "acts": [(name, 4)], "design": fixed, "tied": members}


FEW = ["load_offset", "load_power_law", "area_saturation", "grip_force_loss", "sensor_bias", "regime_transition"]


def few(i, rng):
    name = FEW[i % len(FEW)]
    shape = i % 3
    fixed = {"parts": 1, "increments": [1.0], "steps": [0.104]}
    if shape == 0:
        fixed.update(forces="three", count=30, traces="all")
    elif shape == 1:
        fixed.update(forces=[5.0, 20.0, 80.0], count=9, traces="all")
    else:
        fixed.update(forces="wide", count=24)
    return {"group": "E", "kind": "few", "acts": [(name, 2)], "design": fixed}


MAKERS = {"A": none, "B": one, "C": two, "D": outside, "T": tied, "E": few}


def class_of(name):
    """Names that share a confusion class with `name`, itself included."""
    members = {name}
    for group in CLASSES.values():
        if name in group:
            members |= set(group)
    return sorted(members)


def check():
    """Every library effect has a design."""
    return set(EXCITES) == set(effects.LIBRARY)


def size_sign(name, rng):
    """Sign of the size."""
    signs = effects.LIBRARY[name][3] if name in effects.LIBRARY else (1, -1)
    return int(np.random.default_rng(rng.integers(1 << 31)).choice(signs))
