"""What acts in the worlds of loop.py and no twin declares. The formulas are not those of gripgen.

Each returns factors of the normal force and of the friction of pulls, from what their lab notes.
"""

import numpy as np

from research.transfer.worlds import Effect, Ledger


def light_grips_hold_more(p: Ledger) -> tuple[float, np.ndarray]:
    """A force that is there once the pad touches: 5 N of grip force more, at most."""
    return 1.0, 1 + 5.0 / p["grip_force_n"] * (1 - np.exp(-p["grip_force_n"] / 3))


def firm_grips_hold_less(p: Ledger) -> tuple[float, np.ndarray]:
    """The area of contact nears a ceiling."""
    return 1.0, np.tanh(p["grip_force_n"] / 30) / (p["grip_force_n"] / 30)


def off_centre_grips_hold_less(p: Ledger) -> tuple[float, np.ndarray]:
    """A grip away from the middle turns."""
    return 1.0, np.exp(-0.5 * (np.abs(p["grip_offset_mm"]) / 9) ** 1.5)


def gel_wears(p: Ledger) -> tuple[float, np.ndarray]:
    """Fast at first."""
    return 1.0, 1 - 0.5 * p["pull_index"] / (p["pull_index"] + 30)


def gripper_gives_less(p: Ledger) -> tuple[np.ndarray, float]:
    """Its drive keeps up to 4 N of each jaw's force."""
    return 1 - 4.0 * np.tanh(p["grip_force_n"] / 6) / p["grip_force_n"], 1.0


def lay_of_the_gel(p: Ledger) -> tuple[float, np.ndarray]:
    """Friction is an ellipse of the angle of the grip."""
    turn = np.radians(p["grip_angle_deg"] - 25)
    return 1.0, 1 / np.hypot(np.cos(turn) / 1.2, np.sin(turn) / 0.7)


def warm_gel_holds_less(p: Ledger) -> tuple[float, np.ndarray]:
    """Arrhenius, 4 % per kelvin at 23 degrees."""
    kelvin = p["temperature_c"] + 273.15
    return 1.0, np.exp(0.04 * 296.15**2 * (1 / kelvin - 1 / 296.15))


def contact_ages(p: Ledger) -> tuple[float, np.ndarray]:
    """A stretched exponential of the dwell."""
    return 1.0, 1 + 0.8 * (1 - np.exp(-((p["dwell_s"] / 10) ** 0.6)))


EFFECTS: tuple[Effect, ...] = (light_grips_hold_more, firm_grips_hold_less, off_centre_grips_hold_less, gel_wears, gripper_gives_less,
                               lay_of_the_gel, warm_gel_holds_less, contact_ages)
# In gripgen's words, of typical size: the wrong diagnosis of world w is what acts in world w + 3.
TYPICAL: tuple[dict[str, float], ...] = (
    {"load_offset.b_n": 5.0},
    {"area_saturation.saturation_per_n": 0.02},
    {"off_centre.inverse_lever_per_mm": 0.1},
    {"wear.depth": 0.45, "wear.n0": 40.0},
    {"grip_force_loss.loss_n": 3.8},
    {"anisotropy.amplitude": 0.26, "anisotropy.axis_deg": 25.0},
    {"temperature.k_per_k": 0.04},
    {"dwell_ageing.beta": 0.13},
)
