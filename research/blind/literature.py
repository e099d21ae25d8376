"""Formulas of the literature that the library does not hold as they stand, and what else disturbs a rig.

As in `unknowns.py` each acts on the pulls; `accepted` are names or covariates whose naming counts as right, none where
nothing that was written down shows it. Sizes are drawn from the given range, not from what a test would see.
"""

import numpy as np

from .effects import _one_pole


def rate_and_state(p, size, q):
    """Ageing and slip rate together (Dieterich 1979): mu0 + a ln V + b ln theta."""
    rate = p.ledger["force_increment_n"] / p.ledger["step_time_s"]
    state = np.log1p(p.ledger["dwell_s"] / q["theta_s"])
    p.mu *= (1 + size * (state - 0.6 * np.log(rate / 10.0) / 2.3))[:, None]


def stribeck(p, size, q):
    """LuGre's steady state (Canudas de Wit 1995): from static to Coulomb friction with the speed of loading."""
    rate = p.ledger["force_increment_n"] / p.ledger["step_time_s"]
    p.mu *= (1 + size * np.exp(-((rate / q["rate_n_s"]) ** 1.5)) + 0.1 * size * rate / 20.0)[:, None]


def jkr(p, size, q):
    """Adhesion of a soft ball (Johnson, Kendall and Roberts 1971): F + 2 W + 2 sqrt(W F + W^2)."""
    f = p.ledger["grip_force_n"]
    p.mu *= ((f + 2 * size + 2 * np.sqrt(size * f + size**2)) / f)[:, None]


def two_relaxations(p, size, q):
    """The grip loses force by two exponentials of the dwell."""
    d = p.ledger["dwell_s"]
    p.normal_n *= (1 - size * (0.5 * (1 - np.exp(-d / 2.0)) + 0.5 * (1 - np.exp(-d / 60.0))))[:, None]


def archard(p, size, q):
    """Wear by the work that was done (Archard 1953): the sum of all earlier grip forces."""
    done = p.ledger["grip_force_n"].mean() * p.ledger["pull_index"]
    p.mu *= np.exp(-size * done / (q["last"] * p.ledger["grip_force_n"].mean()))[:, None]


def arrhenius(p, size, q):
    """Thermally activated: a share of 0.1 to 0.3 over five kelvin."""
    t = p.ledger["temperature_c"] + 273.15
    p.mu *= np.exp(size * 59.0 * (295.15 / t - 1))[:, None]


def cross_talk(p, size, q):
    """The grip force leaks into the wrist's zero; size = share of it."""
    p.sensor.append(lambda f, t, led: f + (size * led["grip_force_n"])[:, None])


def warming(p, size, q):
    """A sensor warms up: its zero and, less, its gain follow one exponential of the clock."""
    tau = 0.25 * q["end_s"]

    def chain(f, t, led):
        warm = 1 - np.exp(-led["time_s"] / tau)
        return f * (1 + 0.01 * warm)[:, None] + (size * warm * led["pull_direction"])[:, None]

    p.sensor.append(chain)


def hidden_humidity(p, size, q):
    """Nobody wrote the humidity down."""
    p.mu *= (1 + size * (p.ledger["humidity_pct"] - 47) / 18)[:, None]


def humid_heat(p, size, q):
    """Two columns at once, curved in both, and their product."""
    h = (p.ledger["humidity_pct"] - 47) / 18
    t = (p.ledger["temperature_c"] - 22) / 2
    p.mu *= np.exp(size * (0.6 * h + 0.4 * t + 0.5 * h * t - 0.3 * h**2))[:, None]


def table_and_humidity(p, size, q):
    """A stiff place of the table and moist air, each with its own curve."""
    h = (p.ledger["humidity_pct"] - 47) / 18
    p.mu *= np.exp(size * (0.7 * np.tanh(1.5 * h) + 0.7 * np.sin(p.ledger["table_mm"] / 110)))[:, None]


def sticking_then_creep(p, size, q):
    """The late part of the response of a soft mount."""
    p.sensor.append(lambda f, t, led: f - size * _one_pole(f, 1.5))


# name: (function, smallest and largest size, accepted, columns added, what the design needs)
BOOK = {
    "rate_and_state": (rate_and_state, 0.02, 0.06, ["rate_dependence", "dwell_ageing", "dwell_s"], [],
                       {"increments": [0.25, 1.0, 2.0], "dwells": [0.5, 3.0, 20.0, 90.0]}),
    "stribeck": (stribeck, 0.10, 0.25, ["rate_dependence", "force_increment_n"], [], {"increments": [0.25, 1.0, 2.0]}),
    "jkr": (jkr, 0.15, 0.8, ["load_offset", "load_power_law", "grip_force_loss", "sensor_bias", "area_saturation"], [],
            {"forces": "low"}),
    "two_relaxations": (two_relaxations, 0.08, 0.25, ["grip_relaxation", "dwell_ageing", "dwell_s"], [],
                        {"dwells": [0.5, 3.0, 20.0, 90.0]}),
    "archard": (archard, 0.12, 0.4, ["wear", "sensor_gain_drift", "pull_index", "time_s", "session"], [], {}),
    "arrhenius": (arrhenius, 0.15, 0.5, ["temperature", "temperature_c"], [], {}),
    "cross_talk": (cross_talk, 0.008, 0.02, ["grip_force_n", "load_offset", "area_saturation"], [], {"traces": "fourth"}),
    "warming": (warming, 0.3, 0.9, ["sensor_drift", "sensor_bias"], [], {"directions": [1, -1], "traces": "fourth"}),
    "hidden_humidity": (hidden_humidity, 0.06, 0.15, [], [], {}),
    "humid_heat": (humid_heat, 0.08, 0.2, ["humidity_pct", "temperature_c", "temperature", "humidity_pct*temperature_c"],
                   ["humidity_pct"], {}),
    "table_and_humidity": (table_and_humidity, 0.08, 0.2, ["humidity_pct", "table_mm"], ["humidity_pct", "table_mm"], {}),
    "soft_mount": (sticking_then_creep, 0.03, 0.10, ["sensor_creep", "sensor_gain", "controller_gain", "sensor_hysteresis"], [],
                   {"increments": [0.25, 1.0, 2.0], "traces": "fourth"}),
}


def constants(name, rng, design):
    """The constants of a formula that are not its size."""
    return {
        "rate_and_state": lambda: {"theta_s": rng.uniform(0.5, 3.0)},
        "stribeck": lambda: {"rate_n_s": rng.uniform(4, 12)},
        "archard": lambda: {"last": design["count"]},
        "warming": lambda: {"end_s": design["end_s"]},
    }.get(name, dict)()
