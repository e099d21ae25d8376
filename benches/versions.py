"""Two versions of gripgen in one run: samples a second, memory and bytes of each kind of sweep, and what the newer one makes of the older one's.

    python benches/versions.py --before OLD/target/release/gripgen --now target/release/gripgen --work /tmp/versions

The two take turns, so that a machine that slows down slows down both; a row has the best of each. A sweep that the older one does not know reads
`-`. Needs no package; for figures that mean something nothing else may run.
"""

import argparse
import math
import os
import shutil
import subprocess
import time
from pathlib import Path

QUICKSTART = "asset:configs/quickstart.toml"
REDUCED = {"design": "random", "mechanics": "reduced"}
# Name, samples, keys.
ROWS = [
    ("reduced, images and traces", 400, REDUCED),
    ("reduced, images", 400, {**REDUCED, "trace": "none"}),
    ("reduced, labels alone", 2000, {**REDUCED, "trace": "none", "images": "none"}),
    ("reduced, clean images", 400, {**REDUCED, "images": "clean"}),
    ("reduced, clean and small", 400, {**REDUCED, "images": '{ storage = "clean", compression = "small" }'}),
    ("reduced, films of 24 frames", 50, {**REDUCED, "images": '{ storage = "png", during_pull = { frames = 24 } }'}),
    ("Rapier with the UR5e, images and traces", 60, {"design": "random", "mechanics": "rapier"}),
    ("Rapier with the UR5e, labels alone", 60, {"design": "random", "mechanics": "rapier", "trace": "none", "images": "none"}),
]


class Run:
    """What one sweep took."""

    def __init__(self, gripgen, work, samples, keys, jobs):
        shutil.rmtree(work, ignore_errors=True)
        words = [w for k, v in {**keys, "samples": samples}.items() for w in ("--set", f"{k}={v}")]
        start = time.perf_counter()
        child = subprocess.Popen([gripgen, "sweep", QUICKSTART, "-o", work, "-q", "-j", str(jobs), *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        self.seconds, self.peak_mb = time.perf_counter() - start, usage.ru_maxrss / 1e3
        self.works = child.returncode == 0
        self.kb = sum(f.stat().st_size for f in Path(work).glob("*.mcap")) / samples / 1e3


def rows(options):
    """Names, samples, and the runs of both versions."""
    for name, samples, keys in ROWS:
        if options.only in name:
            found = {"before": [], "now": []}
            for _ in range(options.rounds):
                for version in found:
                    run = Run(getattr(options, version), options.work / "run", samples, keys, options.jobs)
                    found[version].append(run if run.works else None)
            yield name, samples, [min((r for r in runs if r), key=lambda r: r.seconds, default=None) for runs in found.values()]


def speed_table(options):
    """Samples a second and their ratio."""
    print("| sweep | before, samples/s | now, samples/s | ratio | kB a sample, before and now |\n|---|---|---|---|---|")
    for name, samples, (before, now) in rows(options):
        rate = [samples / run.seconds if run else math.nan for run in (before, now)]
        text = [f"{r:.0f}" if r == r else "-" for r in rate]
        ratio = f"{rate[1] / rate[0]:.2f}" if rate[0] == rate[0] else "-"
        kb = [f"{run.kb:.1f}" if run else "-" for run in (before, now)]
        print(f"| {name} | {text[0]} | {text[1]} | {ratio} | {kb[0]}, {kb[1]} |", flush=True)


def memory_table(options):
    """Peak memory of sweeps, and of ones ten times as large."""
    print("\n| sweep of the newer version | jobs | samples | peak MB | ten times the samples, peak MB |\n|---|---|---|---|---|")
    for name, samples, keys in ROWS:
        for jobs in (1, 2):
            if options.only in name:
                few = max(samples // 5, 10)
                small, large = (Run(options.now, options.work / "run", n, {**keys, "shard_samples": 16}, jobs) for n in (few, 10 * few))
                print(f"| {name} | {jobs} | {few} | {small.peak_mb:.0f} | {large.peak_mb:.0f} |", flush=True)


def main():
    """Both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, required=True)
    parser.add_argument("--now", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True, help="a folder to write runs into")
    parser.add_argument("--only", default="", help="rows whose name has this")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--memory", action="store_true", help="memory in place of speed")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    (memory_table if options.memory else speed_table)(options)


if __name__ == "__main__":
    main()
