"""What is left of a campaign on a rig whose `gripgen rig pull` is killed at random moments.

    python benches/rig/kills.py --gripgen target/release/gripgen --kills 200

Serves the virtual rig, and ends `rig pull` of six pulls with SIGKILL one to four times a folder, then lets the same command finish. Wrong is a folder that the command
does not finish, in which `verify` finds something or a temporary file is left, and a pull that was done before a kill and has other bytes, or none, afterwards.
Needs no package. `docs/reliability.md` has the figures of three runs, seeds 1 (there up to 0.7 of the length of a campaign before each kill), 2 and 3.
"""

import argparse
import hashlib
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from served import PATIENT, Rig

SPEED = 50
PULLS = 6


def hashes(run):
    """SHA-256 of the shards that are done."""
    done = [sidecar.with_suffix(".mcap") for sidecar in run.glob("shard-*.json")]
    return {shard.name: hashlib.sha256(shard.read_bytes()).hexdigest() for shard in done if shard.is_file()}


def problems(gripgen, pull, run, kept):
    """What is wrong with a folder that the same command was to finish."""
    done = subprocess.run(pull, capture_output=True, text=True, check=False)
    found = [] if done.returncode in (0, 4) else [f"exit {done.returncode}: {done.stderr.strip()[-300:]}"]
    after = hashes(run)
    found += [f"{len(after)} pulls of {PULLS}"] * (len(after) != PULLS)
    found += [f"{name} has changed" for name, known in kept.items() if after.get(name) != known]
    found += [f"{path.name} is left" for path in run.rglob("*.partial")]
    verified = subprocess.run([gripgen, "verify", run, "-q"], capture_output=True, text=True, check=False)
    return found + [f"verify: {verified.stderr.strip()[-300:]}"] * (verified.returncode != 0)


def main():
    """The kills, and what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", default="gripgen")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    kills = folders = finished = wrong = 0
    with tempfile.TemporaryDirectory() as work, Rig(options.gripgen, Path(work), SPEED, ["--seed", options.seed]) as rig:
        command = [options.gripgen, "rig", "pull", rig.file, "-q", "--parts", "gear", "--grip-force-n", "10,20", "--repetitions", PULLS // 2, "--reconnect", 20, *PATIENT]
        pull = [*map(str, command), "-o"]
        began = time.monotonic()
        assert not problems(options.gripgen, [*pull, f"{work}/good"], Path(work) / "good", {})
        length_s = time.monotonic() - began
        while kills < options.kills:
            run = Path(work) / f"run-{folders}"
            folders += 1
            kept = {}
            for _ in range(rng.randint(1, 4)):
                child = subprocess.Popen([*pull, str(run)], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
                time.sleep(rng.uniform(0, 0.4) * length_s)
                finished += child.poll() is not None
                child.send_signal(signal.SIGKILL)
                child.wait()
                kills += 1
                wrong += sum(hashes(run).get(name) != known for name, known in kept.items())
                kept |= hashes(run)
            found = problems(options.gripgen, [*pull, str(run)], run, kept)
            wrong += bool(found)
            print(f"{kills} kills, {folders} folders, {len(kept)} pulls were done: {found or 'whole'}", flush=True)
    print(f"{kills} kills ({finished} of them after the last pull) in {folders} folders: {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
