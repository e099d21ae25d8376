"""What ur_rtde does to a rig, one function a process: `python scenarios.py NAME JSON-ARGUMENTS` prints what it saw."""

import contextlib
import json
import os
import sys
import time

HOST = "127.0.0.1"
NAMED = ["timestamp", "actual_TCP_pose", "actual_TCP_force", "actual_TCP_speed", "runtime_state", "safety_status_bits"]


def receiver(fields=NAMED):
    import rtde_receive

    return rtde_receive.RTDEReceiveInterface(HOST, 500.0, fields)


@contextlib.contextmanager
def controller(more=0):
    import rtde_control

    interface = rtde_control.RTDEControlInterface
    control = interface(HOST, 500.0, interface.FLAG_UPLOAD_SCRIPT | more)
    try:
        yield control
    finally:
        control.stopScript()
        control.disconnect()


def receive_named(seconds):
    """Every change of the newest state, and the wall's time between first and last."""
    receive = receiver()
    stamps, begun = [], time.monotonic()
    while time.monotonic() < begun + seconds:
        stamp = receive.getTimestamp()
        if not stamps or stamp != stamps[-1]:
            stamps.append(stamp)
            last = time.monotonic()
    seen = {
        "pose": receive.getActualTCPPose(), "force": receive.getActualTCPForce(), "runtime": receive.getRuntimeState(),
        "safety": receive.getSafetyStatusBits(), "connected": receive.isConnected(),
    }
    receive.disconnect()
    return {"stamps": stamps, "wall_s": last - begun, **seen}


def receive_all():
    """Every field of the recipe that ur_rtde asks for by itself."""
    receive = receiver([])
    time.sleep(0.2)
    seen = {}
    for name in dir(receive):
        if name.startswith(("get", "is")) and not name.startswith(("getDigital", "getOutput")):
            seen[name] = getattr(receive, name)()
    seen["int registers"] = [receive.getOutputIntRegister(i) for i in range(12, 20)]
    seen["double registers"] = [receive.getOutputDoubleRegister(i) for i in range(12, 20)]
    receive.disconnect()
    return seen


def write_inputs(upper, first, seconds):
    """Writes registers and outputs without ever starting, and stays for a while."""
    import rtde_io

    io = rtde_io.RTDEIOInterface(HOST, False, upper)
    done = [
        io.setInputIntRegister(first, -42), io.setInputDoubleRegister(first + 1, 0.125), io.setSpeedSlider(0.5),
        io.setStandardDigitalOut(3, True), io.setAnalogOutputVoltage(0, 0.5),
    ]
    time.sleep(seconds)
    io.disconnect()
    return done


def move_and_force(start):
    """Force mode with nothing in the jaws, then back in a line."""
    receive, seen = receiver(), {}
    with controller() as control:
        seen["running"] = control.isProgramRunning()
        seen["at start"] = control.moveL(start, 0.25, 1.2)
        seen["zeroed"] = control.zeroFtSensor()
        before = receive.getActualTCPPose()
        limits = [0.1, 0.1, 0.05, 0.1, 0.1, 0.1]
        seen["force"] = control.forceMode([0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, 10, 0, 0, 0], 2, limits)
        time.sleep(0.6)
        seen["speed"] = receive.getActualTCPSpeed()[2]
        seen["force stop"] = control.forceModeStop()
        time.sleep(0.1)
        after = receive.getActualTCPPose()
        time.sleep(0.3)
        seen["rise"] = [b - a for a, b in zip(before, after, strict=True)]
        seen["drift"] = receive.getActualTCPPose()[2] - after[2]
        aside = [start[0] + 0.02, start[1] - 0.01, start[2] + 0.05, *start[3:]]
        seen["moved"] = control.moveL(aside, 0.25, 1.2)
        # The pose comes over another connection.
        time.sleep(0.1)
        seen["arrived"] = [a - b for a, b in zip(receive.getActualTCPPose(), aside, strict=True)]
        begun = time.monotonic()
        control.moveL([*aside[:2], aside[2] + 0.05, *aside[3:]], 0.1, 1.2)
        seen["seconds for 50 mm at 0.1 m/s"] = time.monotonic() - begun
        seen["payload"] = control.setPayload(1.25, [0.0, 0.0, 0.04])
        control.moveL(start, 0.25, 1.2)
        time.sleep(0.1)
        there = receive.getActualTCPPose()
        seen["another tool"] = control.setTcp([0] * 6)
        time.sleep(0.1)
        seen["flange"] = [a - b for a, b in zip(receive.getActualTCPPose(), there, strict=True)]
        control.setTcp([0, 0, 0.2, 0, 0, 0])
    time.sleep(0.1)
    seen["runtime at the end"] = receive.getRuntimeState()
    receive.disconnect()
    return seen


def joints(poses, near, start):
    """The joints of poses, asked of the controller; then a motion of joints and one back.

    Joints with a tool are not asked for their pose: ur_rtde 1.6.5 sends more numbers for that than it has told the controller.
    """
    receive, seen = receiver([*NAMED, "actual_q"]), {}
    with controller() as control:
        seen["inverse"] = [control.getInverseKinematics(pose, near, 1e-10, 1e-10) for pose in poses]
        seen["reachable"] = [control.getInverseKinematicsHasSolution([x, 0.1, 0.3, 0, 3.1, 0]) for x in (0.4, 1.4)]
        before = receive.getActualQ()
        to = [before[0] + 0.3, before[1] - 0.1, *before[2:]]
        begun = receive.getTimestamp()
        seen["turned"] = control.moveJ(to, 0.5, 1.0)
        seen["seconds"] = receive.getTimestamp() - begun
        time.sleep(0.1)
        seen["off"] = [a - b for a, b in zip(receive.getActualQ(), to, strict=True)]
        seen["joints"], seen["pose"] = receive.getActualQ(), receive.getActualTCPPose()
        seen["forward"] = control.getForwardKinematics()
        seen["back"] = control.moveL(start, 0.25, 1.2)
    receive.disconnect()
    return seen


def upper_range(start):
    """The same program with the registers from 24 on."""
    import rtde_control

    with controller(rtde_control.RTDEControlInterface.FLAG_UPPER_RANGE_REGISTERS) as control:
        return [control.isProgramRunning(), control.zeroFtSensor(), control.moveL(start, 0.25, 1.2)]


def watchdog():
    """Kicked for a second, then not any more."""
    receive, seen = receiver(), {}
    with controller() as control:
        seen["set"] = control.setWatchdog(4.0)
        kicked = True
        for _ in range(50):
            time.sleep(0.02)
            kicked &= control.kickWatchdog()
        seen["kicked"], seen["runs while kicked"] = kicked, control.isProgramRunning()
        last, stopped = receive.getTimestamp(), None
        while stopped is None and receive.getTimestamp() < last + 2.0:
            if receive.getRuntimeState() == 1:
                stopped = receive.getTimestamp() - last
        # Two connections hear of the stop one after the other.
        while control.isProgramRunning() and receive.getTimestamp() < last + 3.0:
            time.sleep(0.01)
        seen["stopped after"], seen["runs without"] = stopped, control.isProgramRunning()
        control.reuploadScript()
        time.sleep(0.3)
        seen["runs again"] = control.isProgramRunning()
    receive.disconnect()
    return seen


def go_to(start):
    with controller() as control:
        return control.moveL(start, 0.25, 1.2)


def pull(forces, seconds, limit_m_s):
    """Force mode on a gripped part, one force after the other: mean force, height, speed at the end of each."""
    receive, seen = receiver(), []
    with controller() as control:
        assert control.zeroFtSensor()
        bottom = receive.getActualTCPPose()[2]
        for force in forces:
            limits = [0.1, 0.1, limit_m_s, 0.1, 0.1, 0.1]
            assert control.forceMode([0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, force, 0, 0, 0], 2, limits)
            time.sleep(seconds)
            readings = []
            for _ in range(50):
                readings.append(receive.getActualTCPForce()[2])
                time.sleep(0.004)
            rise = receive.getActualTCPPose()[2] - bottom
            seen.append({"force": sum(readings) / len(readings), "rise": rise, "speed": receive.getActualTCPSpeed()[2]})
        assert control.forceModeStop()
    receive.disconnect()
    return seen


def dashboard():
    """Every command of the dashboard that this rig answers."""
    import dashboard_client

    dash = dashboard_client.DashboardClient(HOST)
    dash.connect()
    seen = {"connected": dash.isConnected()}
    for name in ("robotmode", "safetystatus", "programState", "running", "isInRemoteControl", "polyscopeVersion",
                 "getSerialNumber", "getRobotModel", "getLoadedProgram"):
        seen[name] = getattr(dash, name)()
    with controller():
        for name in ("pause", "play", "stop"):
            before = [dash.programState(), dash.running()]
            getattr(dash, name)()
            seen[name] = [before, [dash.programState(), dash.running()]]
    try:
        dash.play()
    except RuntimeError as e:
        seen["play nothing"] = str(e)
    for name in ("powerOff", "powerOn", "brakeRelease"):
        getattr(dash, name)()
        seen[name] = dash.robotmode()
    for name in ("closePopup", "closeSafetyPopup", "unlockProtectiveStop"):
        getattr(dash, name)()
    dash.restartSafety()
    seen["restartSafety"] = [dash.robotmode(), dash.safetystatus()]
    dash.quit()
    dash.disconnect()
    seen["connected after quit"] = dash.isConnected()
    return seen


def watch_safety(seconds):
    """Says what it sees while somebody lets things go wrong; the first line says that it looks."""
    receive = receiver()
    time.sleep(0.1)
    print("looking", flush=True)
    seen, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        now = [receive.getSafetyStatusBits(), receive.isProtectiveStopped(), receive.isEmergencyStopped()]
        if not seen or seen[-1] != now:
            seen.append(now)
        time.sleep(0.002)
    receive.disconnect()
    return seen


def unlock():
    """Leaves a protective stop: refused at first."""
    import dashboard_client

    dash = dashboard_client.DashboardClient(HOST)
    dash.connect()
    seen = {"stopped": dash.safetystatus()}
    try:
        dash.unlockProtectiveStop()
    except RuntimeError as e:
        seen["refused"] = str(e)
    time.sleep(5.2)
    dash.unlockProtectiveStop()
    seen["unlocked"] = dash.safetystatus()
    dash.disconnect()
    return seen


def until_closed(seconds):
    """What a client sees of a rig that drops it."""
    receive = receiver()
    print("looking", flush=True)
    end = time.monotonic() + seconds
    while receive.isConnected() and time.monotonic() < end:
        time.sleep(0.01)
    closed, frozen = not receive.isConnected(), receive.getTimestamp()
    again = receive.reconnect()
    time.sleep(0.2)
    seen = {"closed": closed, "again": again, "later": receive.getTimestamp() - frozen}
    receive.disconnect()
    return seen


if __name__ == "__main__":
    result = globals()[sys.argv[1]](*json.loads(sys.argv[2]))
    print(json.dumps(result), flush=True)
    # ur_rtde's threads have ended many processes with a crash on their way out.
    os._exit(0)
