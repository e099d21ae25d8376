"""The pull scene in MuJoCo. `--cone pyramidal --impratio 1 --contact-time-s 0.02` are its defaults."""

import mujoco
from scene import (
    BOX_M, CLOSING_DAMPING_N_S_PER_M, JAW_KG, LENGTH_M, PAD_M, RADIUS_M, SHAPES, hull_points_m, main,
    pad_centre_m,
)  # fmt: skip

VERSION = mujoco.__version__

PART = {
    "box": 'type="box" size="{} {} {}"'.format(*(side / 2 for side in BOX_M)),
    "vertical_shaft": f'type="cylinder" size="{RADIUS_M} {LENGTH_M / 2}"',
    "horizontal_shaft": f'type="cylinder" size="{RADIUS_M} {LENGTH_M / 2}" euler="0 90 0"',
    "hull": 'type="mesh" mesh="hull"',
    "ball": f'type="sphere" size="{RADIUS_M}"',
}
assert set(PART) == set(SHAPES)


def jaw(name, side):
    pad = " ".join(str(s / 2) for s in PAD_M)
    return f"""
      <body name="{name}" pos="0 {side * pad_centre_m()} 0">
        <joint name="{name}" type="slide" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="{JAW_KG}" diaginertia="1e-3 1e-3 1e-3"/>
        <geom type="box" size="{pad}"/>
      </body>"""


def model_xml(shape, mu, step_s, carriage_kg, cone, impratio, contact_time_s):
    points = " ".join(f"{c:.9f}" for point in hull_points_m() for c in point)
    return f"""
<mujoco>
  <option timestep="{step_s}" gravity="0 0 0" cone="{cone}" impratio="{impratio}" jacobian="dense"/>
  <default><geom friction="{mu} 0 0" solref="{contact_time_s} 1"/></default>
  <asset><mesh name="hull" vertex="{points}"/></asset>
  <worldbody>
    <geom name="part" {PART[shape]}/>
    <body name="carriage">
      <joint name="pull" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{carriage_kg}" diaginertia="1e-1 1e-1 1e-1"/>
      {jaw("left", 1)}{jaw("right", -1)}
    </body>
  </worldbody>
</mujoco>"""


class Engine:
    """Degrees of freedom: 0 carriage along z, 1 and 2 jaws along y."""

    def __init__(
        self, shape, mu, grip_force_n, step_s, carriage_kg, cone="elliptic", impratio=100.0, contact_time_s=0.02
    ):
        xml = model_xml(shape, mu, step_s, carriage_kg, cone, impratio, contact_time_s)
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        self.grip_force_n = grip_force_n

    def push(self, applied_n):
        _, left, right = self.data.qvel
        closing = CLOSING_DAMPING_N_S_PER_M
        self.data.qfrc_applied[:] = (
            applied_n,
            -self.grip_force_n - closing * left,
            self.grip_force_n - closing * right,
        )

    def advance(self):
        mujoco.mj_step(self.model, self.data)

    def read(self):
        return float(self.data.qpos[0]), float(self.data.qvel[0])

    def close(self):
        pass


def add_options(parser):
    parser.add_argument("--cone", choices=("elliptic", "pyramidal"), default="elliptic")
    parser.add_argument("--impratio", type=float, default=100.0, help="friction over normal stiffness")
    parser.add_argument("--contact-time-s", type=float, default=0.02, help="first number of solref")


if __name__ == "__main__":
    main(Engine, add_options)
