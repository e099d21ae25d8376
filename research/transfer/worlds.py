"""Worlds of other code: own parts, an elastic gel, own friction, own pulls, other lights. Nothing here comes from gripgen.

A world has one rig, two gels, four sessions, twelve parts and 20 grips of each. Sizes are those of the priors of the literature
(README.md); which world sticks, and which law it has, was set before anything was trained.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from research.transfer import contact
from research.transfer.pulls import Arm, Slide, pull

PARTS, GRIPS, BATCH = 12, 20, 16


@dataclass
class Samples:
    """What a predictor may see of grips, their labels, and what only a world knows."""

    change: np.ndarray  # [N, 2, rows, columns, 3] image less the frame at rest, grey levels, cells of 0.35 mm
    force_n: np.ndarray  # asked of one jaw
    label_n: np.ndarray
    censored: np.ndarray  # the label is a lower bound
    part: np.ndarray
    rig: np.ndarray
    area_mm2: np.ndarray  # [N, 2] true contact
    depth_mm: np.ndarray  # [N, 2]
    trails: np.ndarray  # the force trails its command by more than half the tolerance of the rule: the label may be from before the slip
    logged: np.ndarray | None = None  # [N, LOGGED] what a lab notes of each pull; loop.py alone asks for it

    def rows(self, keep: np.ndarray) -> "Samples":
        """Some of them."""
        return Samples(**{k: None if v is None else v[keep] for k, v in vars(self).items()})


LOGGED = ("grip_offset_mm", "grip_angle_deg", "dwell_s", "temperature_c", "pull_index", "session", "force_increment_n", "step_time_s")
Ledger = dict[str, np.ndarray]  # LOGGED and grip_force_n, by name
Effect = Callable[[Ledger], tuple[np.ndarray | float, np.ndarray | float]]  # factors of the normal force and of the friction


def conditions(session: np.ndarray, rng: np.random.Generator) -> Ledger:
    """What changes from pull to pull in a lab that varies its conditions: dwell, room, pulls since the gel was new."""
    n = len(session)
    made = np.argsort(np.argsort(session + rng.uniform(0, 1, n)))  # sessions one after the other
    gel = session // 2
    index = made - np.where(gel == 0, 0, (gel == 0).sum())
    room = rng.uniform(18, 28, 4)[session] + rng.normal(0, 1, n)
    return {"dwell_s": np.exp(rng.uniform(np.log(0.5), np.log(30), n)), "temperature_c": room, "pull_index": index, "session": session}


class Lights:
    """A camera and three lights: Lambert's law, with mixed colours, uneven light and blur."""

    def __init__(self, rng: np.random.Generator) -> None:
        turn = rng.uniform(0, 360) + np.array([0, 120, 240]) + rng.normal(0, 15, 3)
        rise = np.radians(rng.uniform(15, 45, 3))
        self.to = np.stack([np.cos(np.radians(turn)) * np.cos(rise), np.sin(np.radians(turn)) * np.cos(rise), np.sin(rise)], 1)
        self.mix = (np.eye(3) + rng.uniform(0, 0.4, (3, 3))) * rng.uniform(70, 150, (3, 1))  # light, channel
        self.uneven = rng.uniform(-0.3, 0.3, (3, 2))
        self.dark = rng.uniform(10, 50, 3)
        self.blur = rng.uniform(0.2, 0.7)

    def frame(self, height_mm: np.ndarray) -> np.ndarray:
        """Grey levels of a gel's surface [N, rows, columns], blurred."""
        soft = gaussian_filter(height_mm, (0, self.blur / contact.CELL_MM, self.blur / contact.CELL_MM), mode="nearest")
        down, right = np.gradient(soft, contact.CELL_MM, axis=(1, 2))
        normal = np.stack([-right, down, np.ones_like(right)], -1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        shade = np.clip(normal @ self.to.T, 0, None)
        rows, columns = height_mm.shape[1:]
        v, u = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
        shade = shade * (1 + self.uneven[:, 0] * u[..., None] + self.uneven[:, 1] * v[..., None])
        return np.clip(self.dark + shade @ self.mix, 0, 255)


def unevenness(rng: np.random.Generator) -> np.ndarray:
    """A smooth change of the frame at rest, 1.3 grey levels rms."""
    smooth = gaussian_filter(rng.standard_normal((*contact.VIEW, 3)), (6, 6, 0))
    return 1.3 * smooth / smooth.std()


def draw_arm(rng: np.random.Generator) -> Arm:
    """A robot whose force trails its command by at most half the tolerance of the label rule."""
    while True:
        arm = draw_any_arm(rng)
        if arm.increment_n / arm.step_s * (arm.lag_s + arm.dead_s) <= 1.5:
            return arm


def draw_any_arm(rng: np.random.Generator) -> Arm:
    """A robot."""
    return Arm(
        lag_s=float(np.clip(rng.lognormal(np.log(0.1), 0.5), 0.02, 0.4)), dead_s=rng.uniform(0, 0.06), settle_s=0.02, speed_mm_s=20.0,
        increment_n=float(np.exp(rng.uniform(np.log(0.5), np.log(2)))), step_s=rng.uniform(0.07, 0.15),
        noise_n=rng.uniform(0.07, 0.25), noise_time_s=rng.uniform(0.005, 0.015), gain=rng.normal(1, 0.02))


def world(number: int, seed: int = 2026, effect: Effect | None = None) -> Samples:
    """World `number`: odd ones stick (a stress without pressure), 4 to 7 have rate and state, 2, 3, 6 and 7 parts of several materials.

    With an `effect` its lab varies its conditions and logs them, and the effect acts in addition."""
    rng = np.random.default_rng([seed, number])
    sticks, by_state, materials = number % 2 == 1, number % 8 >= 4, number % 4 >= 2
    parts = [contact.draw_part(contact.KINDS[k % len(contact.KINDS)], rng) for k in range(PARTS)]
    arm, lights = draw_arm(rng), [Lights(rng), Lights(rng)]
    mu_part = rng.lognormal(np.log(0.20), 0.40) * rng.lognormal(0, 0.25 if materials else 0.10, PARTS)
    tilt = rng.normal(0, 1.0, (2, 2))
    gain = rng.normal(0, 0.06)
    # Gels: modulus, thickness and stress of each jaw's pad; a pair wears and is soiled together.
    modulus = np.clip(rng.lognormal(np.log(0.25), 0.4, (2, 1)) * rng.lognormal(0, 0.1, (2, 2)), 0.12, 0.5)
    thickness = rng.uniform(4.0, 5.5, (2, 1)) * np.ones((1, 2))
    mu_gel = rng.lognormal(0, 0.12, 2)
    tau_a = np.exp(rng.uniform(np.log(0.002), np.log(0.030), 2)) * sticks
    ratio, fall = np.clip(rng.normal(0.84, 0.09, 2), 0.55, 1.0), np.exp(rng.uniform(np.log(0.002), np.log(0.1), 2))
    rate, ageing, way = rng.uniform(0.0, 0.03, 2), rng.uniform(0.02, 0.07, 2), np.exp(rng.uniform(np.log(0.02), np.log(0.2), 2))
    shear = rng.lognormal(np.log(6), 0.4, 2) * (modulus.mean(1) / 0.25)
    mu_session, loss = rng.lognormal(0, 0.08, 4), np.abs(rng.normal(0, 2.0, 4))
    zero, dwell = rng.normal(0, 0.7, 4), np.exp(rng.uniform(np.log(0.5), np.log(10), 4))

    n = PARTS * GRIPS
    part, session = np.repeat(np.arange(PARTS), GRIPS), rng.integers(0, 4, n)
    gel = session // 2
    asked = np.exp(rng.uniform(np.log(5), np.log(40), n))
    true = np.maximum(((1 + gain) * asked - loss[session]) * rng.normal(1, 0.03, n) + rng.normal(0, 0.3, n), 0.5)
    split = np.clip(rng.normal(0, 0.10, n), -0.4, 0.4)
    reach = np.array([p["length"] for p in parts])[part] / 2 + 4
    offset = np.clip(rng.normal(0, 6, n), -reach, reach)
    angle, side = rng.uniform(-180, 180, n), rng.normal(0, 1.0, n)
    lean = tilt[None] + rng.normal(0, 0.3, (n, 2, 2))
    logged, of_normal, of_friction, rest_s = None, 1.0, 1.0, dwell[session]
    if effect is not None:
        ledger = conditions(session, np.random.default_rng([seed, number, 1]))
        ledger |= {"grip_force_n": asked, "grip_offset_mm": offset, "grip_angle_deg": angle}
        ledger |= {"force_increment_n": np.full(n, arm.increment_n), "step_time_s": np.full(n, arm.step_s)}
        logged, rest_s = np.stack([ledger[k] for k in LOGGED], 1), ledger["dwell_s"]
        of_normal, of_friction = effect(ledger)
    normal = (true * of_normal)[:, None] * np.stack([1 + split, 1 - split], 1)

    limit, area, depth = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    change = np.zeros((n, 2, *contact.VIEW, 3), np.float16)
    rest = [lights[j].frame(np.zeros((1, *contact.VIEW))) for j in range(2)]
    drift = [[unevenness(rng) for _ in range(4)] for _ in range(2)]
    for jaw in range(2):
        for first in range(0, n, BATCH):
            ids = np.arange(first, min(first + BATCH, n))
            sign = 1 if jaw == 0 else -1  # the other side of the part is its mirror image
            gap = np.stack([contact.gap_of(parts[part[i]], offset[i], sign * angle[i], sign * side[i], tuple(lean[i, jaw])) for i in ids])
            p, u = contact.press(gap, normal[ids, jaw], modulus[gel[ids], jaw], thickness[gel[ids], jaw])
            stress = tau_a[gel[ids], None, None] + (mu_part[part[ids]] * mu_gel[gel[ids]] * mu_session[session[ids]])[:, None, None] * p
            limit[ids, jaw] = np.where(p > 0, stress, 0).sum((1, 2)) * contact.CELL_MM**2
            area[ids, jaw], depth[ids, jaw] = (p > 0).sum((1, 2)) * contact.CELL_MM**2, u.max((1, 2))
            seen = lights[jaw].frame(contact.view_of(-u)) - rest[jaw]
            seen += np.stack([drift[jaw][s] for s in session[ids]]) + rng.uniform(-3, 3, (len(ids), 1, 1, 1))
            change[ids, jaw] = np.round(seen + rng.normal(0, 0.5, seen.shape), 1)
    grip = rng.lognormal(0, 0.08, n) * rng.lognormal(0, 0.04, n)
    slide = Slide(np.full(n, float(by_state)), ratio[gel], fall[gel], rate[gel], ageing[gel], way[gel], rest_s)
    labels = pull(limit.sum(1) * grip * of_friction, 2 * shear[gel], slide, zero[session], arm, rng)
    good = np.isfinite(labels)
    found = Samples(change, asked, np.maximum(labels, 0.0), np.zeros(n, bool), part, np.zeros(n, int), area, depth, np.zeros(n, bool), logged)
    return found.rows(good)
