"""Faults, as ur_rtde sees them."""

import json
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .rig import (
    EMERGENCY_STOP,
    HOST,
    PROTECTIVE_STOP,
    ROBOT_EMERGENCY_STOP,
    SAFETY_NORMAL,
    UR_PORTS,
    RtdeReader,
    run_scenario,
)

pytest.importorskip("rtde_receive", reason="ur-rtde is not installed")


def during(name, *arguments, happens):
    """A scenario that looks while something happens."""
    script = Path(__file__).parent / "scenarios.py"
    child = subprocess.Popen([sys.executable, str(script), name, json.dumps(arguments)], stdout=subprocess.PIPE, text=True)
    try:
        assert child.stdout.readline().strip() == "looking"
        happens()
        out, _ = child.communicate(timeout=60)
    finally:
        child.kill()
        child.wait()
    assert child.returncode == 0, f"{name}: {child.returncode}"
    return json.loads(out.splitlines()[-1])


def test_emergency_and_protective_stop_are_seen_in_the_safety_bits(rig):
    def happens():
        for fault in ("protective-stop", "release-estop", "estop"):
            rig.fault(fault)
            time.sleep(0.3)

    seen = during("watch_safety", 1.5, happens=happens)
    assert [(bool(b & SAFETY_NORMAL), protective, emergency) for b, protective, emergency in seen] == [
        (True, False, False), (False, True, False), (True, False, False), (False, False, True),
    ], seen
    assert seen[1][0] & PROTECTIVE_STOP and not seen[1][0] & EMERGENCY_STOP
    assert seen[3][0] & EMERGENCY_STOP and seen[3][0] & ROBOT_EMERGENCY_STOP
    answers = rig.dashboard("robotmode", "safetystatus", "brake release")
    assert answers[:2] == ["Robotmode: POWER_OFF", "Safetystatus: ROBOT_EMERGENCY_STOP"]
    assert answers[2] != "Brake releasing", "not before somebody has released the button"


def test_a_protective_stop_can_be_left_after_five_seconds(rig):
    rig.fault("protective-stop")
    seen = run_scenario("unlock")
    assert seen["stopped"] == "Safetystatus: PROTECTIVE_STOP" and seen["unlocked"] == "Safetystatus: NORMAL"
    assert "5 s are needed" in seen["refused"]


def test_a_dropped_client_knows_and_comes_back(rig):
    seen = during("until_closed", 10.0, happens=lambda: rig.fault("drop rtde"))
    assert seen["closed"] and seen["again"] and seen["later"] > 0.0


def test_a_client_that_never_reads_is_cut_off_and_disturbs_nobody(rig):
    def frame(kind, payload=b""):
        return struct.pack(">HB", 3 + len(payload), kind) + payload

    # A fat recipe, so that its buffers are full after some seconds.
    register = b"input_int_register_30"
    names = ",".join(["actual_TCP_pose"] * 80).encode()
    with RtdeReader("timestamp") as other, socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((HOST, UR_PORTS["rtde"]))
        deaf.sendall(
            frame(86, struct.pack(">H", 2)) + frame(79, struct.pack(">d", 500.0) + names) + frame(73, register) + frame(83)
        )
        answers = deaf.makefile("rb", buffering=0)
        kind = None
        while kind != ord("S"):
            size, kind = struct.unpack(">HB", answers.read(3))
            while size > 3:
                size -= len(answers.read(size - 3))
        # From here on it does not read. What it owns is free when it is gone.
        assert other.ask(73, register)[:1] == b"\x00"
        begun = time.monotonic()
        while other.ask(73, register)[:1] == b"\x00":
            assert time.monotonic() < begun + 40, "it is never cut off"
            time.sleep(0.2)
        assert time.monotonic() - begun > 0.5, "it had some time"
        stamps = other.column("timestamp")
        # What the system had taken over comes, then the end.
        deaf.settimeout(5)
        total = 0
        try:
            while piece := deaf.recv(1 << 20):
                total += len(piece)
        except ConnectionResetError:
            pass
        assert total < 16 << 20
    steps = {round(1e6 * (b - a)) for a, b in zip(stamps, stamps[1:], strict=False)}
    assert steps == {2000}, f"microseconds between two packages of the other client: {sorted(steps)}"
