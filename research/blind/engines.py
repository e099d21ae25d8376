"""Pulls made by an engine for rigid bodies in the place of the brush: its contact is what nobody declared.

The scenes are those of `benches/peers` (MuJoCo and PyBullet from PyPI, `pip install -r benches/peers/requirements.txt`). Contacts of
such engines are soft in ways of their own: they creep below the friction limit, hold more or less than mu times the normal force, and
depend on shape, load and time step. The arm is that of the scenes, with the lag and dead time of this world.
"""

import sys
from pathlib import Path

import numpy as np

from . import physics

PEERS = Path(__file__).parents[2] / "benches" / "peers"
#: Shapes that stand for the parts; the engines treat a face, an edge and a point each in their own way.
SHAPES = {"ball_bearing": "box", "long_shaft": "vertical_shaft", "gear": "hull", "roller_bearing": "horizontal_shaft"}
#: name: (module, options of its engine)
BOOK = {
    "mujoco_as_shipped": ("mujoco_pull", {"cone": "pyramidal", "impratio": 1.0, "contact_time_s": 0.02}),
    "mujoco_elliptic": ("mujoco_pull", {"cone": "elliptic", "impratio": 10.0, "contact_time_s": 0.02}),
    "mujoco_firm": ("mujoco_pull", {"cone": "pyramidal", "impratio": 10.0, "contact_time_s": 0.02}),
    "pybullet_as_shipped": ("pybullet_pull", {"iterations": 50}),
}
#: What may be named, fixed before any tool was scored: of a contact that creeps below its limit, that it does (an effect of the library
#: since 2026-11-28, added here before salts 22005 and later were made), the rate at which it is loaded and what a reading that lags or
#: falls behind under load looks like; of a limit that is not in proportion to the normal force, a law of
#: the load; the columns of both.
ADMISSIBLE = {
    "rate_dependence", "force_increment_n", "step_time_s", "grip_force_n", "load_offset", "load_power_law", "area_saturation",
    "regime_transition", "shear_strength", "grip_force_loss", "sensor_creep", "shear_creep",
}


def _modules(name):
    """The scene and an engine's module, from their folder."""
    if str(PEERS) not in sys.path:
        sys.path.insert(0, str(PEERS))
    import importlib

    return importlib.import_module("scene"), importlib.import_module(name)


def feedback(world):
    """What the force loop of a world closes on: that of the scenes on the force of the contact, that of the brush on its own."""
    return "measured" if world.engine else "independent"


def simulate(world, limit, ledger):
    """As `physics.simulate`: force (N) and displacement (mm) of each pull at its ticks, NaN after the end, and their number."""
    module, options = BOOK[world.engine]
    scene, engines = _modules(module)
    rows = [_pull(world, scene, engines.Engine, options, limit[i].sum(), i, ledger) for i in range(len(limit))]
    ends = np.array([len(row) for row in rows])
    force, travel = np.full((2, len(rows), ends.max()), np.nan, np.float32)
    for i, row in enumerate(rows):
        force[i, : ends[i]], travel[i, : ends[i]] = np.transpose(row)
    return force, travel, ends


def _pull(world, scene, engine, options, limit_n, i, ledger):
    """(force in N, displacement in mm) at every tick until the stop, or until nothing can be in its way any more."""
    grip_n, rise_n, wait_s = (float(ledger[k][i]) for k in ("grip_force_n", "force_increment_n", "step_time_s"))
    made = engine(SHAPES[str(ledger["part"][i])], limit_n / (2 * grip_n), grip_n, physics.TICK_S, scene.CARRIAGE_KG, **options)
    pull = scene.Pull(made, physics.TICK_S)
    pull.share = -np.expm1(-physics.TICK_S / world.lag_s)
    longest_s = min((1.5 * limit_n + 12) / rise_n * wait_s + 2, 60)
    rows = []
    try:
        for tick in range(int(longest_s / physics.TICK_S)):
            after_s = tick * physics.TICK_S - world.dead_s
            force_n, moved_m = pull.step(float(physics.staircase(after_s, rise_n, wait_s)))
            rows.append((force_n, 1e3 * moved_m))
            if 1e3 * moved_m > physics.STOP_MM:
                break
    finally:
        made.close()
    return rows
