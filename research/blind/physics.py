"""The pull experiment with a physics of its own: bristle brush, lagging arm, label rule.

Nothing here comes from gripgen. All pulls of a call advance together, one
500 Hz tick at a time; a pull leaves the batch when its displacement passes the stop.
Forces in N, lengths in mm, times in s.
"""

from dataclasses import dataclass, field

import numpy as np

TICK_S = 0.002
TOLERANCE_N = 3.0
STOP_MM = 5.0
IDLE_S = 0.5
GRID = (8, 7)  # bristles of one jaw, along and across the pull


@dataclass
class World:
    """What stays the same through a campaign and is not declared to anybody."""

    stiffness_n_per_mm: float  # both pads together
    kinetic_ratio: float
    lag_s: float
    dead_s: float
    damping_ns_per_mm: float
    speed_limit_mm_s: float
    noise_n: float
    scatter: float  # relative sd of friction between repetitions
    brush_spread: float  # relative sd of the limit from bristle to bristle
    weights: np.ndarray = field(repr=False)  # (2, bristles), share of a jaw's limit
    stiff: np.ndarray = field(repr=False)  # (2, bristles), share of the stiffness
    engine: str = ""  # in the place of the brush, a name of `engines.BOOK`


def draw_world(rng):
    """Nuisance parameters of one campaign."""
    along = np.linspace(-1, 1, GRID[0])[:, None]
    across = np.linspace(-1, 1, GRID[1])[None, :]
    spread = rng.uniform(0.02, 0.09)
    crown = rng.uniform(0.0, 0.5)
    pressure = (1.0 - crown * (along**2 + across**2) / 2).ravel()
    weights = pressure * (1 + spread * rng.standard_normal((2, pressure.size)))
    weights /= weights.sum(axis=1, keepdims=True)
    # A bristle under more pressure is stiffer as well, so slip is nearly together.
    stiff = np.tile(pressure, (2, 1))
    stiff /= stiff.sum()
    return World(
        stiffness_n_per_mm=rng.uniform(12, 34),
        kinetic_ratio=rng.uniform(0.80, 1.0),
        lag_s=rng.uniform(0.020, 0.120),
        dead_s=rng.choice([0.004, 0.008, 0.016, 0.030]),
        damping_ns_per_mm=rng.uniform(0.07, 0.13),
        speed_limit_mm_s=rng.uniform(60, 150),
        noise_n=np.exp(rng.uniform(np.log(0.08), np.log(0.4))),
        scatter=rng.uniform(0.03, 0.06),
        brush_spread=spread,
        weights=weights,
        stiff=stiff,
    )


def staircase(t, increment, step):
    """Desired force at time t: the first step is made at time 0."""
    return np.where(t >= 0, increment * (np.floor(t / step + 1e-9) + 1), 0.0)


def simulate(world, limit, increment, step, fade=None, loop_gain=None, dead_band=None):
    """Runs the pulls. `limit` (P, 2): static friction limit per jaw in N.

    `fade(t, ids)` scales the normal force while pulling (relaxation), `loop_gain`
    and `dead_band` (P,) belong to the arm. Returns force and displacement
    (P, ticks), NaN after the end, and the number of ticks of each pull.
    """
    count = len(limit)
    rate = increment / step
    loop_gain = np.ones(count) if loop_gain is None else loop_gain
    dead_band = np.zeros(count) if dead_band is None else dead_band
    longest_s = np.max((limit.sum(axis=1) * 1.5 + 12) / rate / loop_gain) + 2.0
    ticks = int(min(longest_s, 60.0) / TICK_S)
    force = np.full((count, ticks), np.nan, np.float32)
    travel = np.full((count, ticks), np.nan, np.float32)
    ends = np.full(count, ticks)

    ids = np.arange(count)
    static = (limit[:, :, None] * world.weights[None]).reshape(count, -1).astype(np.float32)
    kinetic = static * np.float32(world.kinetic_ratio)
    k = (world.stiff * world.stiffness_n_per_mm).reshape(1, -1).astype(np.float32)
    anchor = np.zeros_like(static)
    sliding = np.zeros(static.shape, bool)
    x = np.zeros(count)
    total = np.zeros(count)
    reference = np.zeros(count)
    follow = 1 - np.exp(-TICK_S / world.lag_s)
    scale = np.ones(count)
    inc, stp, gain, band = increment, step, loop_gain, dead_band
    for tick in range(ticks):
        t = tick * TICK_S
        reference += follow * (gain * staircase(t - world.dead_s, inc, stp) - reference)
        error = reference - total
        error = np.sign(error) * np.maximum(np.abs(error) - band, 0)
        v = np.clip(error / world.damping_ns_per_mm, -world.speed_limit_mm_s, world.speed_limit_mm_s)
        x = x + v * TICK_S
        pull = k * (x[:, None].astype(np.float32) - anchor)
        bound = np.where(sliding, kinetic, static)
        if fade is not None:
            if tick % 50 == 0:
                scale = fade(t, ids)
            bound = bound * scale[:, None].astype(np.float32)
        broke = pull > bound
        sliding |= broke
        if broke.any():
            held = kinetic if fade is None else kinetic * scale[:, None].astype(np.float32)
            pull = np.where(broke, held, pull)
            anchor = np.where(broke, x[:, None].astype(np.float32) - pull / k, anchor)
        sliding &= (v > 0)[:, None]
        total = pull.sum(axis=1, dtype=np.float64)
        force[ids, tick] = total
        travel[ids, tick] = x
        done = x > STOP_MM
        if done.any():
            ends[ids[done]] = tick + 1
            keep = ~done
            if not keep.any():
                break
            ids, x, total, reference, scale = ids[keep], x[keep], total[keep], reference[keep], scale[keep]
            static, kinetic, anchor, sliding = static[keep], kinetic[keep], anchor[keep], sliding[keep]
            inc, stp, gain, band = inc[keep], stp[keep], gain[keep], band[keep]
    used = int(ends.max())
    return force[:, :used], travel[:, :used], ends


def desired_of(increment, step, ticks):
    """Desired force (P, ticks)."""
    t = np.arange(ticks) * TICK_S
    return staircase(t[None, :], increment[:, None], step[:, None]).astype(np.float32)


def label(measured, desired, ends):
    """Last sample with abs(measured - desired) below 3 N: its measured force."""
    near = np.abs(measured - desired) < TOLERANCE_N
    near &= np.arange(measured.shape[1])[None, :] < ends[:, None]
    last = measured.shape[1] - 1 - np.argmax(near[:, ::-1], axis=1)
    value = measured[np.arange(len(measured)), last].astype(float)
    return np.where(near.any(axis=1), value, 0.0)


def eccentric_share(lever_mm, radius_mm, pressure_power=0.5):
    """Share of the sliding limit that is left when the pull line passes `lever_mm`
    beside a round pad: sliding about a centre of rotation, force and moment
    integrated over the pad, the lever of the two met by bisection."""
    r = np.sqrt((np.arange(24) + 0.5) / 24) * radius_mm
    a = (np.arange(48) + 0.5) / 48 * 2 * np.pi
    px, py = (r[:, None] * np.cos(a)).ravel(), (r[:, None] * np.sin(a)).ravel()
    p = np.repeat((1 - (r / radius_mm) ** 2 + 0.02) ** pressure_power, 48)
    p /= p.sum()
    centres = np.concatenate([np.linspace(0.0, 3, 150), np.geomspace(3.05, 300, 80)]) * radius_mm
    dx = px[None, :] - centres[:, None]
    size = np.hypot(dx, py[None, :]) + 1e-9
    push = -(p * dx / size).sum(axis=1)
    moment = (p * (dx * px[None, :] + py[None, :] ** 2) / size).sum(axis=1)
    ratio = moment / np.maximum(push, 1e-9)
    order = np.argsort(ratio)
    return np.interp(np.abs(lever_mm), ratio[order], push[order])
