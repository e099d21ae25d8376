"""The pull scene in PyBullet (Bullet's multibody, direct mode). Its default step is 1/240 s, with 50 iterations."""

import importlib.metadata
import math

import pybullet
from scene import (
    BOX_M, CLOSING_DAMPING_N_S_PER_M, JAW_KG, LENGTH_M, PAD_M, RADIUS_M, hull_points_m, main, pad_centre_m,
)  # fmt: skip

VERSION = importlib.metadata.version("pybullet")
CARRIAGE, LEFT, RIGHT = 0, 1, 2
ALONG_X = pybullet.getQuaternionFromEuler((0.0, math.pi / 2, 0.0))


def part_shape(shape, client):
    if shape == "box":
        sides = [side / 2 for side in BOX_M]
        return pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=sides, physicsClientId=client)
    if shape == "hull":
        points = hull_points_m()
        return pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points, physicsClientId=client)
    if shape == "ball":
        return pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=RADIUS_M, physicsClientId=client)
    return pybullet.createCollisionShape(
        pybullet.GEOM_CYLINDER, radius=RADIUS_M, height=LENGTH_M, physicsClientId=client
    )


class Engine:
    """Links: 0 carriage along z, 1 and 2 jaws along y."""

    def __init__(self, shape, mu, grip_force_n, step_s, carriage_kg, iterations=50):
        self.client = client = pybullet.connect(pybullet.DIRECT)
        self.grip_force_n = grip_force_n
        pybullet.setGravity(0, 0, 0, physicsClientId=client)
        pybullet.setTimeStep(step_s, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(numSolverIterations=iterations, physicsClientId=client)
        turn = ALONG_X if shape == "horizontal_shaft" else (0, 0, 0, 1)
        part = pybullet.createMultiBody(0, part_shape(shape, client), -1, (0, 0, 0), turn, physicsClientId=client)
        pad = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=[s / 2 for s in PAD_M], physicsClientId=client
        )
        y_m = pad_centre_m()
        self.rig = pybullet.createMultiBody(
            baseMass=0,
            linkMasses=[carriage_kg, JAW_KG, JAW_KG],
            linkCollisionShapeIndices=[-1, pad, pad],
            linkVisualShapeIndices=[-1] * 3,
            linkPositions=[(0, 0, 0), (0, y_m, 0), (0, -y_m, 0)],
            linkOrientations=[(0, 0, 0, 1)] * 3,
            linkInertialFramePositions=[(0, 0, 0)] * 3,
            linkInertialFrameOrientations=[(0, 0, 0, 1)] * 3,
            linkParentIndices=[0, 1, 1],  # 0 is the base, 1 the first link
            linkJointTypes=[pybullet.JOINT_PRISMATIC] * 3,
            linkJointAxis=[(0, 0, 1), (0, 1, 0), (0, 1, 0)],
            physicsClientId=client,
        )
        still = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "physicsClientId": client}
        for link in (-1, CARRIAGE, LEFT, RIGHT):
            # Bullet multiplies the coefficients of both bodies: the part's is 1.
            pybullet.changeDynamics(self.rig, link, lateralFriction=mu, **still)
        pybullet.changeDynamics(part, -1, lateralFriction=1.0, **still)
        pybullet.setJointMotorControlArray(
            self.rig, range(3), pybullet.VELOCITY_CONTROL, forces=[0] * 3, physicsClientId=client
        )  # the motors that every joint has by default
        self.speeds_m_per_s = [0.0] * 3

    def push(self, applied_n):
        closing = CLOSING_DAMPING_N_S_PER_M
        _, left, right = self.speeds_m_per_s
        forces = [applied_n, -self.grip_force_n - closing * left, self.grip_force_n - closing * right]
        pybullet.setJointMotorControlArray(
            self.rig, (CARRIAGE, LEFT, RIGHT), pybullet.TORQUE_CONTROL, forces=forces, physicsClientId=self.client
        )

    def advance(self):
        pybullet.stepSimulation(physicsClientId=self.client)

    def read(self):
        states = pybullet.getJointStates(self.rig, (CARRIAGE, LEFT, RIGHT), physicsClientId=self.client)
        self.speeds_m_per_s = [state[1] for state in states]
        return states[CARRIAGE][0], states[CARRIAGE][1]

    def close(self):
        pybullet.disconnect(self.client)


def add_options(parser):
    parser.add_argument("--iterations", type=int, default=50, help="of the contact solver")


if __name__ == "__main__":
    main(Engine, add_options)
