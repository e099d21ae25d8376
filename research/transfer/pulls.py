"""Pulls of worlds of other code: an arm behind a lag, two pads, friction that falls after the slip, and the label rule.

Forces in N, lengths in mm, times in s. All pulls of a call advance together, one 500 Hz tick at a time.
"""

from dataclasses import dataclass

import numpy as np

TICK_S = 0.002
TOLERANCE_N = 3.0
STOP_MM = 12.0  # soft gels shear by some millimetres before they slip
LONGEST_S = 40.0


@dataclass
class Arm:
    """A robot's force loop and force sensor."""

    lag_s: float
    dead_s: float
    settle_s: float  # in which the loop takes up the shear of the pads, whatever their stiffness: a lab tunes its gain
    speed_mm_s: float
    increment_n: float
    step_s: float
    noise_n: float
    noise_time_s: float
    gain: float


@dataclass
class Slide:
    """What happens to friction when the pads move; one value for each pull."""

    state: np.ndarray  # 1: rate and state, 0: a ratio that is reached after fall_s
    ratio: np.ndarray
    fall_s: np.ndarray
    rate: np.ndarray  # per e-fold of speed
    ageing: np.ndarray  # per e-fold of the age of the contact
    way_mm: np.ndarray  # over which a contact is renewed
    dwell_s: np.ndarray


def label(measured: np.ndarray, command: np.ndarray, used: np.ndarray) -> np.ndarray:
    """The last reading that lies within the tolerance of the command."""
    near = (np.abs(command - measured) <= TOLERANCE_N) & used
    last = near.shape[1] - 1 - np.argmax(near[:, ::-1], 1)
    found = measured[np.arange(len(measured)), last]
    return np.where(near.any(1), found, np.nan)


def pull(limit_n: np.ndarray, stiffness: np.ndarray, slide: Slide, zero_n: np.ndarray, arm: Arm,
         rng: np.random.Generator) -> np.ndarray:
    """Labels of pulls whose pads hold `limit_n` together when they have rested for a second."""
    count = len(limit_n)
    rate = arm.increment_n / arm.step_s
    ticks = int(min(LONGEST_S, (limit_n.max() * 1.6 + 10) / rate + 2) / TICK_S)
    t = np.arange(ticks) * TICK_S
    command = arm.increment_n * (np.floor(t / arm.step_s + 1e-9) + 1)
    late = np.interp(t - arm.dead_s, t, command, left=0.0)
    x, anchor, follow = np.zeros(count), np.zeros(count), np.zeros(count)
    age, sliding_s, sliding = slide.dwell_s.copy(), np.zeros(count), np.zeros(count, bool)
    force = np.zeros(count)
    measured, way = np.zeros((count, ticks), np.float32), np.zeros((count, ticks), np.float32)
    noise = np.zeros(count)
    keep = np.exp(-TICK_S / arm.noise_time_s)
    for i in range(ticks):
        follow += (late[i] - follow) * (1 - np.exp(-TICK_S / arm.lag_s))
        v = np.clip((follow - force) / (arm.settle_s * stiffness), -arm.speed_mm_s, arm.speed_mm_s)
        x = x + v * TICK_S
        speed = np.where(sliding, np.abs(v), 0.0)
        # An age that grows at rest and goes to way / speed in motion.
        falls = np.exp(-speed * TICK_S / slide.way_mm)
        age = np.where(speed > 1e-6, age * falls + (1 - falls) * slide.way_mm / np.maximum(speed, 1e-6), age + TICK_S)
        by_state = 1 + slide.rate * np.log1p(speed / 0.1) + slide.ageing * np.log((1 + age) / 2)
        by_ratio = slide.ratio + (1 - slide.ratio) * np.exp(-sliding_s / slide.fall_s)
        holds = limit_n * np.where(slide.state > 0, by_state, by_ratio)
        elastic = stiffness * (x - anchor)
        sliding = elastic >= holds
        sliding_s = np.where(sliding, sliding_s + TICK_S, np.where(v > 0, sliding_s, 0.0))
        anchor = np.where(sliding, x - holds / stiffness, anchor)
        force = np.minimum(elastic, holds)
        noise = keep * noise + np.sqrt(1 - keep**2) * arm.noise_n * rng.standard_normal(count)
        measured[:, i] = arm.gain * force + zero_n + noise
        way[:, i] = x
    return label(measured, np.broadcast_to(command, measured.shape), way < STOP_MM)
