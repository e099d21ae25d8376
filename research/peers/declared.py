"""Least squares over declared parameters: every effect of the library in one model of the label, all fitted together.

The way of `mujoco.sysid`: bounded least squares with a linear loss from one start, then intervals from the Jacobian and
Student's t. The formulas and bounds are those of docs/model.md. An effect is named when the interval of one of its sizes
excludes the neutral value, which is 0 for all of them.
"""

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from research.blind.baselines import _answer_of, _finish, _weights, parts_matrix, read

# effect.parameter: start, lowest, highest. Those in SHAPES have no neutral value.
DECLARED = {
    "load_offset.b_n": (0, -50, 50), "load_power_law.n": (0, -0.9, 0.5), "area_saturation.per_n": (0, 0, 0.1),
    "regime_transition.step": (0, -0.8, 2), "regime_transition.f_c_n": (20, 1, 100), "regime_transition.width_n": (2, 0.1, 20),
    "rate_dependence.k": (0, -0.1, 0.3), "dwell_ageing.beta": (0, 0, 0.2), "anisotropy.cos": (0, -0.6, 0.6),
    "anisotropy.sin": (0, -0.6, 0.6), "contamination.drop": (0, -1.5, 0.9), "contamination.at_pull": (None, 0, 1e7),
    "wear.depth": (0, 0, 0.9), "wear.n0": (100, 5, 1e5), "conditioning.depth": (0, -0.6, 0.6), "conditioning.n0": (5, 0.5, 100),
    "temperature.k_per_k": (0, -0.05, 0.1), "grip_relaxation.depth": (0, 0, 0.6), "grip_relaxation.tau_s": (10, 0.05, 1000),
    "jaw_tilt.deg": (0, -10, 10), "off_centre.per_mm2": (0, 0, 4), "grip_force_loss.n": (0, -10, 20),
    "sensor_gain.minus_1": (0, -0.7, 2), "controller_gain.minus_1": (0, -0.5, 0.5), "sensor_bias.n": (0, -30, 30),
    "sensor_drift.n_per_h": (0, -30, 30), "sensor_gain_drift.per_h": (0, -1, 1), "sensor_hysteresis.n": (0, 0, 10),
    "sensor_hysteresis.scale_n": (10, 0.1, 100), "sensor_quadratic.per_n": (0, -0.01, 0.01), "sensor_saturation.share": (0, -0.5, 0.9),
    "sensor_lowpass.tau_s": (0, 0, 2), "sensor_creep.fraction": (0, -0.6, 1.5), "sensor_creep.tau_s": (10, 0.1, 3600),
    "deadband.n": (0, 0, 5), "arm.lag_s": (0.05, 0, 0.5),
}
# Not declared where the design leaves this column alone.
NEEDS = {"anisotropy": "grip_angle_deg", "off_centre": "grip_offset_mm", "dwell_ageing": "dwell_s", "grip_relaxation": "dwell_s",
         "jaw_tilt": "pull_direction", "rate_dependence": "rate_n_per_s"}
SHAPES = {"regime_transition.f_c_n", "regime_transition.width_n", "contamination.at_pull", "wear.n0", "conditioning.n0",
          "grip_relaxation.tau_s", "sensor_hysteresis.scale_n", "sensor_creep.tau_s", "arm.lag_s"}
IDLE = {n: 1.0 if n in SHAPES else 0.0 for n in DECLARED}


def sensed(p, c, force):
    """What the sensor makes of a force along the pull that rose at the rate of the staircase."""
    time_h, side, rate = c["time_s"] / 3600, c["pull_direction"], c["rate_n_per_s"]
    slow = p["sensor_creep.tau_s"] * rate
    f = force + p["sensor_creep.fraction"] * (force - slow * -np.expm1(-np.maximum(force, 0) / slow))
    f = f - p["sensor_hysteresis.n"] * -np.expm1(-np.maximum(f, 0) / p["sensor_hysteresis.scale_n"])
    f = f * (1 + p["sensor_gain.minus_1"]) * (1 + p["sensor_gain_drift.per_h"] * time_h) + p["sensor_quadratic.per_n"] * f**2
    # Clipped so far below the largest labels, softly: a sharp limit has no derivative where no pull reaches it.
    f = f - 0.02 * c["top"] * np.logaddexp(0, (f / c["top"] - 1 + p["sensor_saturation.share"]) / 0.02)
    return f + side * (p["sensor_bias.n"] + p["sensor_drift.n_per_h"] * time_h)


def slip(p, c, mu):
    """Force at which the part slips."""
    f, n, dwell = c["grip_force_n"], c["pull_index"], c["dwell_s"]
    mu = mu * (1 + p["load_offset.b_n"] / f) * (f / 40) ** p["load_power_law.n"] / (1 + p["area_saturation.per_n"] * f)
    above = np.clip((f - p["regime_transition.f_c_n"]) / p["regime_transition.width_n"], -50, 50)
    mu = mu * (1 + p["regime_transition.step"] / (1 + np.exp(-above)))
    mu = mu * (1 + p["rate_dependence.k"] * np.log(c["rate_n_per_s"] / 10))
    mu = mu * (1 + p["dwell_ageing.beta"] * np.log1p(dwell))
    angle = np.radians(2 * c["grip_angle_deg"])
    mu = mu * (1 + p["anisotropy.cos"] * np.cos(angle) + p["anisotropy.sin"] * np.sin(angle))
    # The step is three pulls wide: a sharp one has no derivative by its place.
    mu = mu * (1 - p["contamination.drop"] / (1 + np.exp(-np.clip((n - p["contamination.at_pull"]) / 3, -50, 50))))
    mu = mu * (1 + p["wear.depth"] * np.expm1(-n / p["wear.n0"]))
    mu = mu * (1 - p["conditioning.depth"] * np.exp(-c["since_rest"] / p["conditioning.n0"]))
    mu = mu * np.exp(-p["temperature.k_per_k"] * (c["temperature_c"] - 23))
    tilt = c["pull_direction"] * np.tan(np.radians(p["jaw_tilt.deg"]))
    mu = (mu + tilt) / (1 - mu * tilt)
    mu = mu / np.sqrt(1 + p["off_centre.per_mm2"] * c["grip_offset_mm"] ** 2)
    held = 1 + p["grip_relaxation.depth"] * np.expm1(-dwell / p["grip_relaxation.tau_s"])
    return mu * np.maximum(f - p["grip_force_loss.n"], 0) * held


def windows(folder, train):
    """Of each trace the mean reading at rest, and mean command and reading in two windows on the way up."""
    rest, rise = [], []
    for i, name in enumerate(train["pull_id"]):
        path = folder / "traces" / f"{name}.csv"
        if not path.is_file():
            continue
        time, desired, force, _ = np.loadtxt(path, delimiter=",", skiprows=1).T
        rest.append((i, force[time < 0].mean()))
        end = train["max_pull_force_n"][i] * train["step_time_s"][i] / train["force_increment_n"][i]
        for low, high in ((0.2, 0.45), (0.45, 0.7)):
            inside = (time > low * end) & (time < high * end)
            if end * (high - low) > 3 * train["step_time_s"][i] and inside.any():
                rise.append((i, desired[inside].mean(), force[inside].mean()))
    return np.array(rest).reshape(-1, 2), np.array(rise).reshape(-1, 3)


def intervals(jacobian, residual, level):
    """Half widths of the intervals; huge along what the data leave free."""
    scale = np.linalg.norm(jacobian, axis=0)
    scale = np.where(scale > 1e-9 * scale.max(), scale, np.inf)
    values, vectors = np.linalg.eigh((j := jacobian / scale).T @ j)
    left = max(len(residual) - jacobian.shape[1], 1)
    variance = np.sum(vectors**2 / np.maximum(values, 1e-15 * values[-1]), axis=1) * (residual @ residual) / left
    return np.where(np.isinf(scale), np.inf, np.sqrt(variance) / scale) * student.ppf((1 + level) / 2, left)


def declared(folder, unseen, work, level=0.95):
    """All declared parameters at once."""
    train, test = read(folder), read(unseen)
    parts = sorted(set(train["part"]))
    first = {s: train["pull_index"][train["session"] == s].min() for s in set(train["session"])}
    for table in (train, test):
        table["rate_n_per_s"] = table["force_increment_n"] / table["step_time_s"]
        table["top"] = np.full(len(table["session"]), np.quantile(train["max_pull_force_n"], 0.95))
        table["since_rest"] = table["pull_index"] - np.array([first.get(s, 0) for s in table["session"]])
    rest, rise = windows(folder, train)
    at_rest, on_rise = ({k: v[m[:, 0].astype(int)] for k, v in train.items()} for m in (rest, rise))
    label, weight = train["max_pull_force_n"], _weights(train) / np.maximum(train["max_pull_force_n"], 0.3)
    member, later = parts_matrix(train, parts), parts_matrix(test, parts)
    varied = {k for k, v in train.items() if len(set(v)) > 1}
    names = [n for n in DECLARED if NEEDS.get(n.split(".")[0], "pull_index") in varied]
    start, low, high = ([DECLARED[n][i] for n in names] for i in range(3))
    start[names.index("contamination.at_pull")] = train["pull_index"].mean()
    first_mu = np.array([np.median((label / train["grip_force_n"])[train["part"] == p]) for p in parts]).clip(0.01, 1.9)

    def residual(x):
        p, mu = IDLE | dict(zip(names, x)), x[len(names):]
        rows = [(sensed(p, train, slip(p, train, member @ mu)) - label) * weight]
        if len(rest):
            rows.append((sensed(p, at_rest, 0.0) - rest[:, 1]) / 0.1)
        if len(rise):
            lag = on_rise["rate_n_per_s"] * (p["arm.lag_s"] + p["sensor_lowpass.tau_s"])
            command = (1 + p["controller_gain.minus_1"]) * rise[:, 1] - p["deadband.n"]
            rows.append((sensed(p, on_rise, command - lag) - rise[:, 2]) / (0.1 + 0.1 * on_rise["force_increment_n"]))
        return np.concatenate(rows)

    bounds = [np.concatenate([b, np.full(len(parts), v)]).astype(float) for b, v in ((low, 1e-3), (high, 2.0))]
    x0 = np.concatenate([start, first_mu]).astype(float)
    fit = least_squares(residual, x0, bounds=bounds, x_scale="jac", max_nfev=200)
    width = intervals(least_squares(residual, fit.x, bounds=bounds, jac="3-point", max_nfev=1).jac, fit.fun, level)
    said = {n.split(".")[0]: abs(v) / h for n, v, h in zip(names, fit.x, width) if n not in SHAPES
            and (v if n == "sensor_saturation.share" else abs(v)) > h}
    answer = _answer_of(sorted(said, key=lambda k: -said[k]))
    p = IDLE | dict(zip(names, fit.x))
    predicted = sensed(p, test, slip(p, test, later @ fit.x[len(names):]))
    return _finish(answer, test, np.log(np.maximum(predicted, 0.01) / test["grip_force_n"]))
