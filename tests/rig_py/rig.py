"""A virtual rig in a process of its own, and the few bytes that the checks need beside the independent clients."""

import json
import os
import queue
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

HOST = "127.0.0.1"
#: ur_rtde has these built in.
UR_PORTS = {"dashboard": 29999, "primary": 30001, "secondary": 30002, "real_time": 30003, "rtde": 30004}
#: struct's letters of what is read here.
TYPES = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "VECTOR6D": "6d"}
SAFETY_NORMAL, PROTECTIVE_STOP, ROBOT_EMERGENCY_STOP, EMERGENCY_STOP = 1 << 0, 1 << 2, 1 << 6, 1 << 7
PROGRAM_RUNS = 2
DATA = ord("U")


def taken_ports():
    """Those of UR's ports that somebody else has."""
    taken = []
    for port in UR_PORTS.values():
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, port))
            except OSError:
                taken.append(port)
    return taken


class VirtualRig:
    """`gripgen rig serve` with the tool at the long shaft."""

    def __init__(self):
        command = [os.environ["GRIPGEN_BIN"], "rig", "serve", "--at", "long_shaft", "--faults"]
        for port in ("gripper", "camera-left", "camera-right"):
            command += [f"--{port}-port", "0"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
        self.said = []
        threading.Thread(target=self._listen, daemon=True).start()
        begun = time.monotonic()
        words = self.process.stdout.readline().split()
        self.start_s = time.monotonic() - begun
        if words[:1] != ["ready"]:
            self.end()
            raise AssertionError(f"the rig says {words} and {self.said}")
        self.ports = {what: int(at.rpartition(":")[2]) for what, at in (w.split("=") for w in words[1:])}

    def _listen(self):
        for line in self.process.stderr:
            self.said.append(line.strip())

    def fault(self, line):
        """Lets something go wrong, and waits until it has."""
        before = self.said.count(line)
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        wait_for(lambda: self.said.count(line) > before, f"fault `{line}`; the rig says {self.said[-3:]}")

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def camera(self, jaw, action):
        return f"http://{HOST}:{self.ports[f'camera_{jaw}']}/?action={action}"

    def dashboard(self, *commands):
        """Answers of the dashboard, without any client."""
        with socket.create_connection((HOST, UR_PORTS["dashboard"]), 5) as connection:
            lines = connection.makefile("rw", newline="\n")
            lines.readline()
            answers = []
            for command in commands:
                lines.write(command + "\n")
                lines.flush()
                answers.append(lines.readline().strip())
            return answers

    def make_ready(self):
        """As it was started, but for the place of the tool."""
        self.fault("release-estop")
        answers = self.dashboard("stop", "power on", "brake release", "robotmode", "safetystatus")
        assert answers[3:] == ["Robotmode: RUNNING", "Safetystatus: NORMAL"], answers
        with Gripper(self.ports["gripper"]) as gripper:
            if gripper.ask("GRIPSTATE?") != "GRIPSTATE=0":
                gripper.move("RELEASE(20)")


def wait_for(true, what, seconds=10.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, f"waited {seconds} s for {what}"
        time.sleep(0.01)


class Gripper:
    """Lines of GCL."""

    def __init__(self, port):
        self.connection = socket.create_connection((HOST, port), 10)
        self.lines = self.connection.makefile("rw", newline="\n")
        assert self.ask("FSACK()") == "ACK FSACK"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ask("BYE()")
        self.connection.close()

    def ask(self, line):
        self.lines.write(line + "\n")
        self.lines.flush()
        return self.lines.readline().strip()

    def move(self, line):
        """A motion, from ACK to FIN."""
        name = line.partition("(")[0]
        assert self.ask(line) == f"ACK {name}"
        assert self.lines.readline().strip() == f"FIN {name}"


class RtdeReader:
    """Every data package of some fields, as they come: what a client that only keeps the newest does not see."""

    def __init__(self, *fields, frequency_hz=500.0):
        self.fields, self.layout, self.rows, self.answers = fields, "", [], queue.SimpleQueue()
        self.connection = socket.create_connection((HOST, UR_PORTS["rtde"]), 5)
        self.connection.settimeout(None)
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()
        assert self.ask(86, struct.pack(">H", 2)) == b"\x01"
        reply = self.ask(79, struct.pack(">d", frequency_hz) + ",".join(fields).encode())
        self.layout = ">" + "".join(TYPES[t] for t in reply[1:].decode().split(","))
        assert self.ask(83) == b"\x01"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.shutdown(socket.SHUT_RDWR)
        self.thread.join(5)
        self.connection.close()

    def ask(self, kind, payload=b""):
        self.connection.sendall(struct.pack(">HB", 3 + len(payload), kind) + payload)
        got, answer = self.answers.get(timeout=5)
        assert got == kind, f"{got} answers {kind}"
        return answer

    def _read(self):
        stream = self.connection.makefile("rb")
        while len(head := stream.read(3)) == 3:
            size, kind = struct.unpack(">HB", head)
            payload = stream.read(size - 3)
            if kind == DATA:
                self.rows.append(struct.unpack(self.layout, payload[1:]))
            else:
                self.answers.put((kind, payload))

    def newest(self):
        wait_for(lambda: self.rows, "a data package")
        return self.rows[-1]

    def column(self, field):
        """A field that is one number, over all packages so far."""
        at = self.fields.index(field)
        return [row[at] for row in list(self.rows)]


def run_scenario(name, *arguments, seconds=60):
    """Runs a function of scenarios.py in a child: ur_rtde ends some of its mistakes with SIGSEGV. Gives what it printed."""
    script = Path(__file__).parent / "scenarios.py"
    child = [sys.executable, str(script), name, json.dumps(arguments)]
    done = subprocess.run(child, capture_output=True, text=True, timeout=seconds, check=False)
    assert done.returncode == 0, f"{name}: {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-3000:]}"
    return json.loads(done.stdout.splitlines()[-1])
