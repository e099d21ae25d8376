"""ur_rtde 1.6.5 and UR's ports. What a rig must answer is what this client, written for real robots, demands."""

import math
import threading

import pytest

from .rig import PROGRAM_RUNS, UR_PORTS, Gripper, RtdeReader, run_scenario, wait_for

pytest.importorskip("rtde_control", reason="ur-rtde is not installed")


def test_it_is_ready_within_two_seconds_on_the_ports_that_ur_has(served):
    assert served.start_s < 2.0
    assert {what: served.ports[what] for what in UR_PORTS} == UR_PORTS


def test_named_fields_come_every_two_milliseconds_without_a_gap(rig):
    with RtdeReader("timestamp", "actual_q", "actual_TCP_pose") as every:
        seen = run_scenario("receive_named", 2.0)
        stamps = every.column("timestamp")
    steps = {round(1e6 * (b - a)) for a, b in zip(stamps, stamps[1:], strict=False)}
    assert steps == {2000} and len(stamps) > 1000, f"microseconds between two packages: {sorted(steps)}"
    # ur_rtde keeps the newest package alone: what it missed is its own affair, not that time goes on at the wall's rate.
    mine = seen["stamps"]
    passed = [b - a for a, b in zip(mine, mine[1:], strict=False)]
    assert min(passed) > 0.0019 and all(abs(p / 0.002 - round(p / 0.002)) < 1e-3 for p in passed)
    assert mine[-1] - mine[0] == pytest.approx(seen["wall_s"], abs=0.3) and seen["wall_s"] > 1.5
    assert mine[0] > 40.0, "URCL does not trust a controller that has just booted"
    assert seen["connected"] and seen["runtime"] == 1 and seen["safety"] == 1
    assert max(map(abs, seen["force"])) < 2.0 and all(map(math.isfinite, seen["pose"]))


def test_a_slower_rate_is_kept(rig):
    with RtdeReader("timestamp", frequency_hz=50.0) as reader:
        wait_for(lambda: len(reader.rows) > 25, "26 packages at 50 Hz")
        stamps = reader.column("timestamp")
    assert {round(1e3 * (b - a)) for a, b in zip(stamps, stamps[1:], strict=False)} == {20}


def test_all_fields_of_its_own_recipe_make_sense(rig):
    """It decodes by a table of its own: one wrong size would shift everything that follows."""
    seen = run_scenario("receive_all")
    for name in ("getActualQd", "getTargetQd", "getActualTCPSpeed", "getTargetTCPSpeed", "getPayloadInertia"):
        assert seen[name] == [0.0] * 6, name
    assert seen["getActualQ"] == seen["getTargetQ"] and max(map(abs, seen["getActualQ"])) < 2 * math.pi
    assert seen["getActualTCPPose"] == seen["getTargetTCPPose"]
    assert math.dist(seen["getActualTCPPose"][:3], [0, 0, 0]) < 0.85, "the UR5e's reach"
    assert max(map(abs, seen["getActualTCPForce"])) < 2.0 and max(map(abs, seen["getFtRawWrench"])) < 50.0
    assert all(20 < c < 60 for c in seen["getJointTemperatures"])
    assert all(v == pytest.approx(48, abs=5) for v in [*seen["getActualJointVoltage"], seen["getActualMainVoltage"]])
    assert seen["getJointMode"] == [253] * 6 and seen["getRobotMode"] == 7 and seen["getSafetyMode"] == 1
    assert (seen["getRobotStatus"], seen["getSafetyStatusBits"], seen["getRuntimeState"]) == (1, 1, 1)
    assert seen["getSpeedScaling"] == seen["getTargetSpeedFraction"] == seen["getSpeedScalingCombined"] == 1.0
    assert math.hypot(*seen["getActualToolAccelerometer"]) == pytest.approx(9.81, abs=0.1)
    assert seen["getActualDigitalInputBits"] == seen["getActualDigitalOutputBits"] == 0
    assert 40.0 < seen["getTimestamp"] < 1e5
    assert seen["isConnected"] and not seen["isEmergencyStopped"] and not seen["isProtectiveStopped"]


@pytest.mark.parametrize(("upper", "first"), [(False, 18), (True, 42)])
def test_its_io_interface_writes_without_a_start_and_owns_what_it_writes(rig, upper, first):
    fields = (f"input_int_register_{first}", f"input_double_register_{first + 1}")
    answers = {}
    with RtdeReader(*fields) as reader:

        def write():
            answers["done"] = run_scenario("write_inputs", upper, first, 1.0)

        writer = threading.Thread(target=write)
        writer.start()
        wait_for(lambda: reader.newest() == (-42, 0.125), "the registers that ur_rtde writes")
        assert reader.ask(73, fields[0].encode())[:1] == b"\x00", "it is in use"
        writer.join(30)
        assert answers["done"] == [True] * 5
        assert reader.newest() == (-42, 0.125), "inputs keep their last value"
        wait_for(lambda: reader.ask(73, fields[0].encode()) == b"\x01INT32", "a register that nobody has any more")


def test_force_mode_moves_a_free_arm_and_lines_arrive(rig):
    with RtdeReader("runtime_state", "robot_status_bits") as reader:
        seen = run_scenario("move_and_force", rig.start_pose)
        states = reader.column("runtime_state")
    assert PROGRAM_RUNS in states and seen["runtime at the end"] == 1
    for done in ("running", "at start", "zeroed", "force", "force stop", "moved", "payload", "another tool"):
        assert seen[done] is True, done
    assert seen["speed"] == pytest.approx(0.05), "the limit, with nothing that holds it back"
    assert 0.02 < seen["rise"][2] < 0.1 and seen["rise"][:2] == [0, 0] and seen["rise"][3:] == [0] * 3
    assert seen["drift"] == 0.0, "it stands after forceModeStop"
    assert max(map(abs, seen["arrived"])) < 1e-6
    # The tool points down.
    assert seen["flange"] == pytest.approx([0, 0, 0.2, 0, 0, 0], abs=1e-6)
    assert 0.49 < seen["seconds for 50 mm at 0.1 m/s"] < 1.5


def test_the_program_with_the_upper_registers(rig):
    assert run_scenario("upper_range", rig.start_pose) == [True, True, True]


def test_a_watchdog_that_is_not_kicked_stops_the_program(rig):
    seen = run_scenario("watchdog")
    assert seen["set"] and seen["kicked"] and seen["runs while kicked"]
    assert 0.2 < seen["stopped after"] < 0.6, "4 Hz: a quarter of a second after the last kick"
    assert not seen["runs without"] and seen["runs again"]


@pytest.fixture
def gripped(rig):
    """The shaft between the jaws: 40 N in the gripper's own count, 20 N per jaw."""
    assert run_scenario("go_to", rig.start_pose)
    with Gripper(rig.ports["gripper"]) as gripper:
        gripper.move("GRIP(40)")
        assert gripper.ask("GRIPSTATE?") == "GRIPSTATE=4"
        yield rig


def test_a_gripped_part_holds_the_arm_up_to_friction(gripped):
    """Up and down below friction, then beyond it."""
    up, down, more, beyond = run_scenario("pull", [4.0, -4.0, 5.0, 12.0], 0.5, 0.02)
    for seen, force in ((up, 4.0), (down, -4.0), (more, 5.0)):
        # The load on the tool is against what the arm applies.
        assert seen["force"] == pytest.approx(-force, abs=0.2)
        assert 0.0 < math.copysign(seen["rise"], force * seen["rise"]) < 3e-4, "gel gives way by a fraction of a millimetre"
        assert abs(seen["speed"]) < 1e-3
    assert beyond["rise"] > 3e-3 and beyond["speed"] == pytest.approx(0.02, abs=1e-3), "it slips, at the speed limit"
    # Two jaws of 20 N; the twin's shaft has a coefficient of about 0.17.
    assert -beyond["force"] == pytest.approx(2 * 0.17 * 20, abs=0.7)


def test_every_command_of_the_dashboard(rig):
    seen = run_scenario("dashboard")
    assert seen["connected"] and not seen["connected after quit"]
    assert (seen["robotmode"], seen["safetystatus"]) == ("Robotmode: RUNNING", "Safetystatus: NORMAL")
    assert seen["programState"].startswith("STOPPED") and seen["running"] is False and seen["isInRemoteControl"] is True
    assert seen["polyscopeVersion"].split(".")[:2] == ["5", "12"]
    assert seen["getSerialNumber"].isdigit() and seen["getRobotModel"] == "UR5"
    assert seen["getLoadedProgram"] == "No program loaded"
    playing, paused, stopped = ["PLAYING rtde_control", True], ["PAUSED rtde_control", False], ["STOPPED", False]
    assert [seen[name] for name in ("pause", "play", "stop")] == [[playing, paused], [paused, playing], [playing, stopped]]
    assert "Failed to execute: play" in seen["play nothing"]
    modes = [seen[name] for name in ("powerOff", "powerOn", "brakeRelease")]
    assert modes == ["Robotmode: POWER_OFF", "Robotmode: IDLE", "Robotmode: RUNNING"]
    assert seen["restartSafety"] == ["Robotmode: POWER_OFF", "Safetystatus: NORMAL"]
