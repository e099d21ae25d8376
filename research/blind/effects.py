"""What a campaign may hold: effects on friction, jaws, arm and force sensor.

The formulas are deliberately of other shape than the textbook one (stretched
exponential for the log law of ageing, arcsinh for the log law of rate, ...): a tool that
only finds its own formula again proves nothing. Each effect changes a `Pulls`
record in place; `size` is its one free size, drawn in units of the detectable size.
"""

from dataclasses import dataclass, field

import numpy as np

from .physics import eccentric_share


@dataclass
class Pulls:
    """Working state of a batch: true covariates and what acts on each pull."""

    ledger: dict  # true covariates, (P,) each
    mu: np.ndarray  # (P, 2) friction coefficient per jaw
    normal_n: np.ndarray  # (P, 2)
    extra_n: np.ndarray  # (P,) additive friction force, both jaws
    loop_gain: np.ndarray
    dead_band: np.ndarray
    fade: list = field(default_factory=list)  # f(t, ids) -> factor of the normal force
    sensor: list = field(default_factory=list)  # f(force, times, ledger) -> force


def load_offset(p, size, q):
    """Adhesion: a constant once the pad touches."""
    p.extra_n += size * (1 - np.exp(-p.ledger["grip_force_n"] / 1.5))


def load_power_law(p, size, q):
    """A share of the contact shears at constant stress over a Hertz area."""
    f = p.ledger["grip_force_n"] / 25.0
    p.mu *= ((1 - size) + size * f ** (-1 / 3))[:, None]


def area_saturation(p, size, q):
    """Limit approaches a ceiling as a hyperbolic tangent; size = 1 / ceiling load."""
    f = p.ledger["grip_force_n"] * size
    p.mu *= (np.tanh(f) / np.maximum(f, 1e-9))[:, None]


def regime_transition(p, size, q):
    """Another coefficient above a load, with a smooth step of finite width."""
    u = np.clip((p.ledger["grip_force_n"] - q["load_n"]) / q["width_n"] + 0.5, 0, 1)
    p.mu *= (1 + size * (3 * u**2 - 2 * u**3))[:, None]


def rate_dependence(p, size, q):
    """Thermally activated shear: arcsinh of the load rate."""
    rate = p.ledger["force_increment_n"] / p.ledger["step_time_s"]
    p.mu *= (1 + size * (np.arcsinh(rate / q["rate_n_s"]) - np.arcsinh(10 / q["rate_n_s"])))[:, None]


def dwell_ageing(p, size, q):
    """Contact grows as a stretched exponential of the dwell."""
    grown = 1 - np.exp(-((p.ledger["dwell_s"] / q["tau_s"]) ** 0.45))
    p.mu *= (1 + size * grown)[:, None]


def anisotropy(p, size, q):
    """Friction ellipse: axes 1 and 1 - size, turned by the lay of the texture."""
    a = np.radians(p.ledger["grip_angle_deg"] - q["lay_deg"])
    p.mu *= (1 / np.hypot(np.cos(a), np.sin(a) / (1 - size)))[:, None]


def contamination(p, size, q):
    """Something on the gel from one pull on, spread within two pulls."""
    n = p.ledger["pull_index"] - q["pull"]
    p.mu *= np.where(n < 0, 1.0, 1 - size * (1 - 0.4 * np.exp(-2.0 * np.maximum(n, 0))))[:, None]


def wear(p, size, q):
    """Coating loss, fast at first: n / (n + n0)."""
    n = p.ledger["pull_index"]
    p.mu *= (1 - size * n / (n + q["pulls"]))[:, None]


def conditioning(p, size, q):
    """The first grips after a rest differ; fades with the square of the count."""
    p.mu *= (1 + size / (1 + p.ledger["since_rest"] / q["pulls"]) ** 2)[:, None]


def temperature(p, size, q):
    """Arrhenius softening about 22 degC; size = share per kelvin there."""
    t = p.ledger["temperature_c"] + 273.15
    p.mu *= np.exp(size * 295.15**2 * (1 / t - 1 / 295.15))[:, None]


def grip_relaxation(p, size, q):
    """Force at held width falls as a power of time, on through the pull."""
    dwell = p.ledger["dwell_s"]
    p.fade.append(lambda t, ids: (1 + (dwell[ids] + t) / q["tau_s"]) ** (-size))


def jaw_tilt(p, size, q):
    """Wedge, averaged over a slightly crowned pad; size in degrees."""
    side = p.ledger["pull_direction"][:, None]
    crown = np.radians(np.linspace(-0.4, 0.4, 5))
    tilt = np.radians(size)
    p.mu[:] = np.mean([np.tan(np.arctan(p.mu) + side * (tilt + c)) for c in crown], axis=0)
    p.mu[:] = np.maximum(p.mu, 0.01)


def off_centre(p, size, q):
    """Turning about a moving centre, integrated over the pad; size = 10 mm / radius."""
    p.mu *= eccentric_share(p.ledger["grip_offset_mm"], 10.0 / size)[:, None]


def asymmetric_jaws(p, size, q):
    """One jaw grips worse than the other."""
    p.mu *= np.array([[1 + size / 2, 1 - size / 2]])


def grip_force_loss(p, size, q):
    """Drive friction eats a part of the command, above a small breakaway."""
    f = p.ledger["grip_force_n"]
    p.normal_n *= ((f - size * np.tanh(f / (2 * abs(size) + 0.5))) / f)[:, None]


def sensor_gain(p, size, q):
    """Wrong by a constant factor."""
    p.sensor.append(lambda f, t, led: f * (1 + size))


def sensor_bias(p, size, q):
    """A constant along the axis; its sign follows the direction of the pull."""
    p.sensor.append(lambda f, t, led: f + (size * led["pull_direction"])[:, None])


def sensor_drift(p, size, q):
    """Zero creeps with the clock and saturates; size = N at the end of the campaign."""
    end = q["end_s"]

    def chain(f, t, led):
        b = size * (1 - np.exp(-2 * led["time_s"] / end)) / (1 - np.exp(-2))
        return f + (b * led["pull_direction"])[:, None]

    p.sensor.append(chain)


def sensor_gain_drift(p, size, q):
    """Sensitivity creeps with the clock and saturates; size = share at the end."""
    end = q["end_s"]
    p.sensor.append(lambda f, t, led: f * (1 + size * np.tanh(1.2 * led["time_s"] / end) / np.tanh(1.2))[:, None])


def sensor_hysteresis(p, size, q):
    """Play elements (Prandtl-Ishlinskii) of three widths; size = share of the force."""

    def chain(f, t, led):
        f = np.nan_to_num(f)
        out = f * (1 - size)
        for width in q["widths_n"]:
            play = np.zeros(len(f), f.dtype)
            for i in range(f.shape[1]):
                play = np.clip(play, f[:, i] - width, f[:, i] + width)
                out[:, i] += size / len(q["widths_n"]) * play
        return out

    p.sensor.append(chain)


def sensor_quadratic(p, size, q):
    """Convex (or concave) characteristic, an exponential; size = share at 20 N."""
    s = 20.0 / (2 * size)
    p.sensor.append(lambda f, t, led: s * np.expm1(np.clip(f / s, -5, 5)))


def sensor_saturation(p, size, q):
    """Soft clip; size = how far below the largest force, as a share of it."""
    level, soft = q["largest_n"] * (1 - size), 0.4
    p.sensor.append(lambda f, t, led: level - soft * np.logaddexp(0, (level - np.nan_to_num(f)) / soft))


def _one_pole(f, tau):
    out = np.empty_like(f)
    state = np.zeros(len(f), f.dtype)
    share = 1 - np.exp(-0.002 / tau)
    for i in range(f.shape[1]):
        state = state + share * (np.nan_to_num(f[:, i]) - state)
        out[:, i] = state
    return out


def sensor_lowpass(p, size, q):
    """Two equal poles; size = sum of their time constants in s."""
    p.sensor.append(lambda f, t, led: _one_pole(_one_pole(f, size / 2), size / 2))


def sensor_creep(p, size, q):
    """Late part of the response, two branches; size = share that comes late."""

    def chain(f, t, led):
        late = 0.6 * _one_pole(f, q["tau_s"] / 2) + 0.4 * _one_pole(f, q["tau_s"] * 2)
        return f + size * late

    p.sensor.append(chain)


def controller_gain(p, size, q):
    """The arm gives a constant share of the force asked for."""
    p.loop_gain *= 1 + size


def deadband(p, size, q):
    """The arm answers only beyond an error."""
    p.dead_band += size


# name: (function, smallest and largest size used, signs)
LIBRARY = {
    "load_offset": (load_offset, 0.2, 3.0, (1, -1)),
    "load_power_law": (load_power_law, 0.05, 1.0, (1,)),
    "area_saturation": (area_saturation, 1 / 400, 1 / 45, (1,)),
    "regime_transition": (regime_transition, 0.05, 0.6, (1, -1)),
    "rate_dependence": (rate_dependence, 0.01, 0.2, (1,)),
    "dwell_ageing": (dwell_ageing, 0.03, 0.6, (1,)),
    "anisotropy": (anisotropy, 0.03, 0.5, (1,)),
    "contamination": (contamination, 0.03, 0.6, (1,)),
    "wear": (wear, 0.04, 0.8, (1,)),
    "conditioning": (conditioning, 0.05, 0.6, (1, -1)),
    "temperature": (temperature, 0.004, 0.05, (1,)),
    "grip_relaxation": (grip_relaxation, 0.01, 0.15, (1,)),
    "jaw_tilt": (jaw_tilt, 0.2, 4.0, (1, -1)),
    "off_centre": (off_centre, 0.08, 1.6, (1,)),
    "asymmetric_jaws": (asymmetric_jaws, 0.1, 0.5, (1, -1)),
    "grip_force_loss": (grip_force_loss, 0.5, 4.0, (1,)),
    "sensor_gain": (sensor_gain, 0.02, 0.3, (1, -1)),
    "sensor_bias": (sensor_bias, 0.1, 2.5, (1, -1)),
    "sensor_drift": (sensor_drift, 0.2, 2.5, (1, -1)),
    "sensor_gain_drift": (sensor_gain_drift, 0.02, 0.25, (1, -1)),
    "sensor_hysteresis": (sensor_hysteresis, 0.02, 0.25, (1,)),
    "sensor_quadratic": (sensor_quadratic, 0.02, 0.25, (1, -1)),
    "sensor_saturation": (sensor_saturation, 0.05, 0.6, (1,)),
    "sensor_lowpass": (sensor_lowpass, 0.03, 0.30, (1,)),
    "sensor_creep": (sensor_creep, 0.02, 0.20, (1,)),
    "controller_gain": (controller_gain, 0.02, 0.10, (1, -1)),
    "deadband": (deadband, 0.4, 2.4, (1,)),
}


def constants(name, rng, design):
    """The constants of an effect that are not its size."""
    last = design["count"]
    return {
        "regime_transition": lambda: {"load_n": rng.uniform(12, 30), "width_n": rng.uniform(2, 10)},
        "rate_dependence": lambda: {"rate_n_s": rng.uniform(0.3, 2.0)},
        "dwell_ageing": lambda: {"tau_s": rng.uniform(10, 40)},
        "anisotropy": lambda: {"lay_deg": rng.choice([0.0, 90.0, 20.0, 65.0])},
        "contamination": lambda: {"pull": int(rng.uniform(0.3, 0.7) * last)},
        "wear": lambda: {"pulls": rng.uniform(0.15, 0.8) * last},
        "conditioning": lambda: {"pulls": rng.uniform(4, 10)},
        "grip_relaxation": lambda: {"tau_s": rng.uniform(0.5, 5)},
        "sensor_drift": lambda: {"end_s": design["end_s"]},
        "sensor_gain_drift": lambda: {"end_s": design["end_s"]},
        "sensor_hysteresis": lambda: {"widths_n": [2.0, 8.0, 20.0]},
        "sensor_saturation": lambda: {"largest_n": design["largest_n"]},
        "sensor_creep": lambda: {"tau_s": rng.uniform(1.0, 4.0)},
    }.get(name, dict)()
