"""Joints of the virtual arm beside a solver of others: ur-analytic-ik, whose lengths of a UR5e are those of the maker."""

import random

import pytest

from .rig import run_scenario

pytest.importorskip("rtde_control", reason="ur-rtde is not installed")
numpy = pytest.importorskip("numpy")
ur5e = pytest.importorskip("ur_analytic_ik", reason="ur-analytic-ik is not installed").ur5e


def matrix(pose):
    """Of metres and a rotation vector (Rodrigues)."""
    axis = numpy.array(pose[3:])
    angle = numpy.linalg.norm(axis)
    x, y, z = axis / angle if angle > 0 else axis
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    full = numpy.eye(4)
    full[:3, :3] += numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross
    full[:3, 3] = pose[:3]
    return full


def rotation_vector(turn):
    """Of a rotation by less than half a turn."""
    angle = numpy.arccos(numpy.clip((numpy.trace(turn) - 1) / 2, -1, 1))
    return angle / (2 * numpy.sin(angle)) * numpy.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])


def nearest(ways, near):
    """The way with the least sum of squares, angles within half a turn of those that are near."""
    turned = [[n + (a - n + numpy.pi) % (2 * numpy.pi) - numpy.pi for a, n in zip(way, near, strict=True)] for way in ways]
    return min(turned, key=lambda way: sum((a - n) ** 2 for a, n in zip(way, near, strict=True)))


def test_poses_and_joints_are_those_of_another_solver(rig):
    draw = random.Random(5)
    near = [0.1, -1.3, 1.4, -1.6, -1.5, 0.2]
    tool = numpy.eye(4)
    tool[2, 3] = 0.2
    flanges = [ur5e.forward_kinematics(*(draw.uniform(-3, 3) for _ in range(6))) for _ in range(40)]
    poses = [[*(f @ tool)[:3, 3], *rotation_vector(f[:3, :3])] for f in flanges]
    seen = run_scenario("joints", poses, near, rig.start_pose)
    for flange, joints in zip(flanges, seen["inverse"], strict=True):
        assert joints == pytest.approx(nearest(ur5e.inverse_kinematics(flange), near), abs=1e-5)
    assert seen["reachable"] == [True, False]
    assert seen["turned"] is True and max(map(abs, seen["off"])) < 1e-9 and seen["back"] is True
    # 0.3 rad at 0.5 rad/s with 1 rad/s^2: 0.5 s up and down cover 0.25 of them.
    assert 1.05 < seen["seconds"] < 1.6
    reached = ur5e.forward_kinematics(*seen["joints"]) @ tool
    for pose in (seen["pose"], seen["forward"]):
        assert numpy.allclose(matrix(pose), reached, atol=1e-6)
