"""The pull scene and what is the same for every engine: force loop, staircase, slip force, label, creep, timing.

An engine is an object with `push(applied_n)` (sets all forces), `advance()` (one step), `read()` -> (position in m,
speed in m/s of the carriage along the pull) and `close()`. Its scene: a fixed part, a carriage that slides along z, two
jaws that slide along y on it, one pad each, no gravity.
"""

import argparse
import json
import math
import statistics
import time
from collections import deque

SHAPES = ("box", "vertical_shaft", "horizontal_shaft", "hull", "ball")
BOX_M = (0.060, 0.020, 0.120)  # x, y, z
RADIUS_M = 0.010
LENGTH_M = 0.120
PAD_M = (0.028, 0.004, 0.021)  # x, y (thickness), z
CARRIAGE_KG = 9.2  # arm 8.0, gripper 1.2
JAW_KG = 0.2
CLOSING_GAP_M = 0.2e-3
CLOSING_DAMPING_N_S_PER_M = 100.0 * JAW_KG

SETTLE_S = 0.5
LAG_S = 0.05
DAMPING_N_S_PER_M = 2000.0
SPEED_LIMIT_M_PER_S = 0.02
INCREMENT_N, INCREMENT_S = 1.0, 0.104
STOP_M = 5e-3
TOLERANCE_N = 3.0
FILTER_S = 0.010
CREEP_SHARE, CREEP_WAIT_S, CREEP_S = 0.9, 1.0, 2.0


def hull_points_m():
    """A prism over a regular 64-gon, axis along z; a corner lies on the jaw axis, as in gripgen's tests."""
    turns = [math.tau * i / 64 for i in range(64)]
    ends = (-LENGTH_M / 2, LENGTH_M / 2)
    return [(RADIUS_M * math.sin(t), RADIUS_M * math.cos(t), z) for z in ends for t in turns]


def pad_centre_m():
    """Distance of an open pad's centre from the grip centre; every shape is 20 mm wide along the jaws."""
    return RADIUS_M + CLOSING_GAP_M + PAD_M[1] / 2


class Pull:
    """What drives the carriage, and the wrist sensor, around an engine.

    Drive "loop" is the arm of gripgen's carriage scene: the force follows the command with a lag and the carriage is
    damped. Drive "bare" applies the commanded force as it is.
    """

    def __init__(self, engine, step_s, carriage_kg=CARRIAGE_KG, drive="loop"):
        self.engine, self.step_s, self.drive = engine, step_s, drive
        self.total_kg = carriage_kg + 2 * JAW_KG
        self.force_n = self.contact_n = self.speed_m_per_s = 0.0
        self.share = -math.expm1(-step_s / LAG_S)
        for _ in range(round(SETTLE_S / step_s)):
            engine.push(0.0)
            engine.advance()
            self.start_m, self.speed_m_per_s = engine.read()

    def step(self, desired_n):
        """One step; returns (contact force in N, displacement in m)."""
        applied_n = desired_n if self.drive == "bare" else self.loop_n(desired_n)
        self.engine.push(applied_n)
        self.engine.advance()
        position_m, speed_m_per_s = self.engine.read()
        # What was applied and did not become momentum went into the contact.
        self.contact_n = applied_n - self.total_kg * (speed_m_per_s - self.speed_m_per_s) / self.step_s
        self.speed_m_per_s = speed_m_per_s
        return self.contact_n, position_m - self.start_m

    def loop_n(self, desired_n):
        """tau dF/dt = F_des - F_measured, bounded so that the damped carriage keeps below the speed limit."""
        excess_n = DAMPING_N_S_PER_M * SPEED_LIMIT_M_PER_S
        force_n = self.force_n + self.share * (desired_n - self.contact_n)
        self.force_n = min(max(force_n, self.contact_n - excess_n), self.contact_n + excess_n)
        return self.force_n - DAMPING_N_S_PER_M * self.speed_m_per_s


def slip(pull, limit_n):
    """Runs the staircase to the displacement stop; returns slip force, label, steps, and whether the stop was met."""
    step_s, window = pull.step_s, max(1, round(FILTER_S / pull.step_s))
    last, total_n, peak_n, label_n = deque(), 0.0, 0.0, math.nan
    contact_n = moved_m = 0.0
    longest = math.ceil((limit_n + 60.0) / INCREMENT_N * INCREMENT_S / step_s)
    for tick in range(longest):
        desired_n = INCREMENT_N * (math.floor((tick * step_s + 1e-9) / INCREMENT_S) + 1)
        if abs(contact_n - desired_n) < TOLERANCE_N:
            label_n = contact_n
        if moved_m > STOP_M:
            return {"slip_force_n": peak_n, "label_n": label_n, "steps": tick, "stopped": True}
        contact_n, moved_m = pull.step(desired_n)
        last.append(contact_n)
        total_n += contact_n
        if len(last) > window:
            total_n -= last.popleft()
        peak_n = max(peak_n, total_n / window)
    return {"slip_force_n": peak_n, "label_n": label_n, "steps": longest, "stopped": False}


def creep_mm_per_s(pull, limit_n):
    """Speed at a held force: a wait until the loop has settled, then 2 s, or until the displacement stop."""
    wait, ticks = round(CREEP_WAIT_S / pull.step_s), round(CREEP_S / pull.step_s)
    for tick in range(1, wait + ticks + 1):
        _, moved_m = pull.step(CREEP_SHARE * limit_n)
        if tick == wait:
            from_m = moved_m
        if moved_m > STOP_M and tick > wait:
            break
        if moved_m > STOP_M:  # gone before the wait was over
            return moved_m / (tick * pull.step_s) * 1e3
    return (moved_m - from_m) / ((tick - wait) * pull.step_s) * 1e3


def step_times_us(pull, limit_n, steps=2000):
    """CPU time of a step at half the limit: with forces and read-back through the binding, and the engine alone."""
    engine, applied_n = pull.engine, 0.5 * limit_n
    for _ in range(round(1.0 / pull.step_s)):
        pull.step(applied_n)
    begin = time.process_time()
    for _ in range(steps):
        engine.push(applied_n)
        engine.advance()
        engine.read()
    middle = time.process_time()
    for _ in range(steps):
        engine.push(applied_n)
        engine.read()
    end = time.process_time()
    whole = (middle - begin) / steps * 1e6
    return whole, whole - (end - middle) / steps * 1e6


def measure(
    make, shape, mu, grip_force_n, step_s=1 / 500, carriage_kg=CARRIAGE_KG, drive="loop", timing_repeats=0, **options
):
    """All results of one case; `make(shape, mu, grip_force_n, step_s, carriage_kg, **options)` builds the engine."""
    limit_n = 2.0 * mu * grip_force_n

    def run(what):
        engine = make(shape, mu, grip_force_n, step_s, carriage_kg, **options)
        try:
            return what(Pull(engine, step_s, carriage_kg, drive), limit_n)
        finally:
            engine.close()

    result = {"shape": shape, "mu": mu, "grip_force_n": grip_force_n, "step_s": step_s}
    result.update({"carriage_kg": carriage_kg, "drive": drive, **options})
    result.update(run(slip))
    result["ratio"] = result["slip_force_n"] / limit_n
    result["label_ratio"] = result["label_n"] / limit_n
    result["creep_mm_per_s"] = run(creep_mm_per_s)
    if timing_repeats:
        pulls, steps = [], []
        for _ in range(timing_repeats):
            begin = time.process_time()
            run(slip)
            pulls.append(time.process_time() - begin)
            steps.append(run(step_times_us))
        result["pulls_per_s"] = 1.0 / statistics.median(pulls)
        result["us_per_step"] = statistics.median(whole for whole, _ in steps)
        result["engine_us_per_step"] = statistics.median(engine for _, engine in steps)
    return result


def main(make, add_options):
    """The command line of one engine."""
    parser = argparse.ArgumentParser(description="One pull until the jaws slip; noise off.")
    parser.add_argument("--shape", choices=SHAPES, default="box")
    parser.add_argument("--mu", type=float, default=0.168)
    parser.add_argument("--grip-force-n", type=float, default=40.0, help="normal force of one jaw")
    parser.add_argument("--step-s", type=float, default=1 / 500)
    parser.add_argument("--carriage-kg", type=float, default=CARRIAGE_KG)
    parser.add_argument("--drive", choices=("loop", "bare"), default="loop", help="force loop and damping, or none")
    parser.add_argument("--timing-repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_options(parser)
    arguments = vars(parser.parse_args())
    as_json = arguments.pop("json")
    result = measure(make, **arguments)
    if as_json:
        print(json.dumps(result))
    else:
        for key, value in result.items():
            print(f"{key:20} {value:.6g}" if isinstance(value, float) else f"{key:20} {value}")
