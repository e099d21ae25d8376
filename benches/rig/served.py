"""A virtual rig on ports of its own, as the benchmarks beside this file use it."""

import subprocess

# A machine that does something else at the same time is slow, not broken.
PATIENT = ["--set", "limits.robot_silence_s=1.0", "--set", "limits.robot_gap_s=1.0", "--set", "images.frame_s=5.0"]


class Rig:
    """`gripgen rig serve` with `more` options; ends with the block."""

    def __init__(self, gripgen, folder, speed, more):
        self.gripgen, self.file = gripgen, folder / "rig.toml"
        command = [gripgen, "rig", "serve", "--speed", speed, "--any-ports", "--faults", "--write-rig", self.file, "--force", *more]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([str(c) for c in command], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
        assert self.process.stdout.readline().startswith("ready")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    def fault(self, line):
        """Lets something go wrong, in the words of `rig serve --faults`."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
