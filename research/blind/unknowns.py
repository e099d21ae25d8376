"""Dependences that no effect of the library describes.

Each adds its columns to the ledger and acts on the pulls; `accepted` are the
covariates whose naming counts as right.
"""

import numpy as np


def humidity(p, size, q):
    h = (p.ledger["humidity_pct"] - 47) / 18
    p.mu *= (1 + size * np.where(h > 0, h, 0.6 * h + 0.15 * h**2))[:, None]


def cable(p, size, q):
    """Drag of the cable by table position, once the arm pulls; size = share of 20 N."""
    p.sensor.append(lambda f, t, led: f + (20 * size * np.sin(1.3 * led["table_mm"] / 100))[:, None] * np.tanh(f / 1.5))


def operator(p, size, q):
    p.mu *= (1 + size * p.ledger["operator"])[:, None]


def batch(p, size, q):
    """A text column."""
    p.mu *= (1 + size * np.isin(p.ledger["supplier"], ["b"]))[:, None]


def session(p, size, q):
    levels = np.array(q["levels"])
    p.mu *= (1 + size * levels[p.ledger["session"] - 1])[:, None]


def gel(p, size, q):
    levels = np.array(q["levels"])
    p.mu *= (1 + size * levels[p.ledger["gel_number"] - 1])[:, None]


def force_rate(p, size, q):
    f = np.log(p.ledger["grip_force_n"] / 25.0)
    r = np.log(p.ledger["force_increment_n"] / p.ledger["step_time_s"] / 10.0)
    p.mu *= np.clip(1 + size * np.tanh(0.8 * f * r) / 0.8, 0.3, 2.0)[:, None]


def periodic(p, size, q):
    phase = 2 * np.pi * p.ledger["time_s"] / q["period_s"] + q["phase_rad"]
    wave = np.sin(phase) + 0.3 * np.sin(2 * phase)
    p.mu *= (1 + size * wave)[:, None]


def session_ageing(p, size, q):
    """Ageing with the dwell in one session alone: another gel cleaner, say."""
    grown = 1 - np.exp(-((p.ledger["dwell_s"] / 20.0) ** 0.45))
    p.mu *= (1 + size * grown * (p.ledger["session"] == q["session"]))[:, None]


def part_humidity(p, size, q):
    """One part takes up water, the other does not."""
    h = (p.ledger["humidity_pct"] - 47) / 18
    p.mu *= (1 + size * h * (p.ledger["part"] == q["part"]))[:, None]


FORCE = ["grip_force_n"]
RATE = ["force_increment_n", "step_time_s", "rate_n_s", "rate_n_per_s", "force_rate_n_s"]
# name: (function, smallest and largest size, accepted covariates, columns added)
UNKNOWN = {
    "humidity": (humidity, 0.03, 0.35, ["humidity_pct"], ["humidity_pct"]),
    "cable": (cable, 0.01, 0.12, ["table_mm"], ["table_mm"]),
    "operator": (operator, 0.03, 0.4, ["operator"], ["operator"]),
    "batch": (batch, 0.03, 0.4, ["supplier"], ["supplier"]),
    "session": (session, 0.03, 0.4, ["session"], []),
    "gel": (gel, 0.03, 0.4, ["gel_id"], []),
    "force_rate": (force_rate, 0.03, 0.3, [f"{a}*{b}" for f in FORCE for r in RATE for a, b in ((f, r), (r, f))], []),
    "session_ageing": (session_ageing, 0.03, 0.6, ["dwell_s*session", "session*dwell_s", "session"], []),
    "part_humidity": (part_humidity, 0.03, 0.5, ["humidity_pct*part", "part*humidity_pct", "humidity_pct"], ["humidity_pct"]),
    "periodic": (periodic, 0.03, 0.3, ["time_s"], []),
}


def constants(name, rng, design):
    """The constants of a dependence that are not its size."""
    if name == "session":
        count = max(design["sessions"], 2)
        levels = rng.permutation(np.linspace(-1, 1, count)) if count > 2 else np.array([0.0, 1.0])
        # No trend: neighbours must not look like a slow drift.
        for _ in range(200):
            if abs(np.corrcoef(levels, np.arange(count))[0, 1]) < 0.4 or count < 4:
                break
            levels = rng.permutation(levels)
        return {"levels": levels.tolist()}
    if name == "session_ageing":
        return {"session": int(rng.integers(1, design["sessions"] + 1))}
    if name == "part_humidity":
        return {"part": design["names"][0]}
    if name == "gel":
        return {"levels": [0.0, 1.0, -0.6]}
    if name == "periodic":
        return {"period_s": rng.uniform(0.12, 0.3) * design["end_s"], "phase_rad": rng.uniform(0, 6.28)}
    return {}
