"""Runs a campaign: ledger and effects in, labels and traces out; detectable sizes."""

from dataclasses import dataclass, field

import numpy as np

from . import effects, engines, literature, physics, unknowns

# Hidden in the labels by the free friction coefficient (or nearly so); the size is set by
# convention from what a handful of traces show.
BY_TRACE = {"sensor_gain": 0.03, "controller_gain": 0.02, "sensor_lowpass": 0.020}
NEED = 11.68  # noncentrality of one degree of freedom: 1 % level, 80 % power


@dataclass
class Acting:
    """An effect (or unknown) with its size and constants."""

    name: str
    size: float
    constants: dict = field(default_factory=dict)

    def apply(self, pulls):
        book_of(self.name)[self.name][0](pulls, self.size, self.constants)


def book_of(name):
    """The table of functions that holds a name."""
    return next(b for b in (effects.LIBRARY, unknowns.UNKNOWN, literature.BOOK) if name in b)


def friction_of_parts(design, rng):
    """One coefficient a part."""
    low, high = design.get("mu_range", (0.10, 0.30))
    values = np.sort(rng.uniform(low, high, len(design["names"])))
    if design.get("mu_spread") and len(values) > 1:
        values = np.linspace(0.09, 0.28, len(values)) * rng.uniform(0.92, 1.08, len(values))
    return dict(zip(design["names"], rng.permutation(values)))


def run(world, mu, ledger, acting, factor=1.0):
    """Noise-free sensor force and the rest of the traces; `factor` (P,): friction scatter."""
    n = len(ledger["pull_index"])
    f = ledger["grip_force_n"].astype(float)
    base = np.array([mu[p] for p in ledger["part"]])
    pulls = effects.Pulls(
        ledger=ledger,
        mu=np.repeat(base[:, None], 2, axis=1),
        normal_n=np.repeat(f[:, None], 2, axis=1),
        extra_n=np.zeros(n),
        loop_gain=np.ones(n),
        dead_band=np.zeros(n),
    )
    for act in acting:
        act.apply(pulls)
    limit = pulls.mu * pulls.normal_n * np.asarray(factor).reshape(-1, 1) + pulls.extra_n[:, None] / 2
    limit = np.maximum(limit, 0.02)
    fade = None
    if pulls.fade:
        fade = lambda t, ids: np.prod([g(t, ids) for g in pulls.fade], axis=0)
    inc, step = ledger["force_increment_n"].astype(float), ledger["step_time_s"].astype(float)
    if world.engine:
        force, travel, ends = engines.simulate(world, limit, ledger)
    else:
        force, travel, ends = physics.simulate(world, limit, inc, step, fade, pulls.loop_gain, pulls.dead_band)
    desired = physics.desired_of(inc, step, force.shape[1])
    times = np.arange(force.shape[1]) * physics.TICK_S
    idle = np.zeros((n, int(physics.IDLE_S / physics.TICK_S)), np.float32)
    for chain in pulls.sensor:
        force, idle = chain(force, times, ledger), chain(idle, times[: idle.shape[1]], ledger)
    return {
        "force": force.astype(np.float32), "idle": idle.astype(np.float32),
        "travel": travel, "desired": desired, "ends": ends,
    }


def labels(world, out, rng):
    """Labels from one draw of the sensor noise; also the noisy force."""
    noisy = out["force"] + np.float32(world.noise_n) * rng.standard_normal(out["force"].shape, dtype=np.float32)
    return physics.label(noisy, out["desired"], out["ends"]), noisy


def scatter_factors(world, n, rng, kind="white"):
    """Friction from repetition to repetition; `kind`: white or autocorrelated."""
    z = rng.standard_normal(n)
    if kind == "autocorrelated":
        keep = rng.uniform(0.4, 0.75)
        for i in range(1, n):
            z[i] = keep * z[i - 1] + np.sqrt(1 - keep**2) * z[i]
    return np.exp(world.scatter * z - world.scatter**2 / 2)


def expected(world, mu, ledger, acting, factors, rng, draws=3):
    """Mean label over the given friction scatters (K, P) and draws of the sensor noise.

    Without the scatter the label would stand on the steps of the staircase.
    """
    total = 0.0
    for factor in factors:
        out = run(world, mu, ledger, acting, factor)
        total = total + np.mean([labels(world, out, rng)[0] for _ in range(draws)], axis=0)
    return total / len(factors)


def shift_of(world, plain, full, ledger):
    """Label shift over its noise, with the coefficient of every part fitted again."""
    sigma = np.hypot(world.scatter * np.maximum(plain, 0.5), world.noise_n + 0.08)
    shift = (full - plain) / sigma
    base = np.stack([np.where(ledger["part"] == p, plain, 0) / sigma for p in np.unique(ledger["part"])], axis=1)
    return shift - base @ np.linalg.lstsq(base, shift, rcond=None)[0]


def detectable_size(world, mu, ledger, name, constant, rng, others=(), sign=1):
    """Size at which a test of the true form at 1 % has 80 % power (labels only)."""
    book = effects.LIBRARY if name in effects.LIBRARY else unknowns.UNKNOWN
    low, high = book[name][1], book[name][2]
    if name in BY_TRACE:
        return BY_TRACE[name], low, high
    factors = np.stack([scatter_factors(world, len(ledger["pull_index"]), rng) for _ in range(3)])
    others = list(others)
    plain = expected(world, mu, ledger, others, factors, rng)

    def information(size):
        full = expected(world, mu, ledger, others + [Acting(name, sign * size, constant)], factors, rng)
        rest = shift_of(world, plain, full, ledger)
        return float(rest @ rest)

    sizes = np.geomspace(high, low, 4)
    # Noise and the steps of the label rule leave a little even where there is no effect.
    info = np.maximum(np.array([information(s) for s in sizes]) - information(high * 1e-6), 1e-3)
    use = info > 8 * NEED  # below, that little dominates: carry the slope on
    use[:2] = True
    log_size, log_info = np.log(sizes[use][::-1]), np.log(info[use][::-1])
    slope = np.clip((log_info[1] - log_info[0]) / (log_size[1] - log_size[0]), 1.5, 4.0)
    if log_info[0] < np.log(NEED) < log_info[-1]:
        slope = (log_info[1] - log_info[0]) / (log_size[1] - log_size[0])
    return float(np.exp(log_size[0] + (np.log(NEED) - log_info[0]) / slope)), low, high
