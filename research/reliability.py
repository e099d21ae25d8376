"""Counts what is lost: sweeps that are killed, disks that are full or read-only, two sweeps in one folder, files that vanish, shards that are damaged.

    cargo xtask research reliability --table docs/reliability.md

prints a table, and puts it into a page between its marks. It needs the Python package, and root for small disks (tmpfs); without, those rows say so.
"""

import argparse
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SWEEP = """twin = "asset:configs/twin-baseline.toml"
samples = 24
seed = 3
mechanics = "reduced"
shard_samples = 4
[vary]
part = ["gear", "long_shaft"]
grip_force_n = { uniform = [20, 40] }
"""
SHARDS = 6
BEGIN, END = "<!-- counted: begin -->", "<!-- counted: end -->"


def gripgen(*arguments, check=None):
    done = subprocess.run([os.environ["GRIPGEN_BIN"], *map(str, arguments)], capture_output=True, text=True, check=False)
    assert "panicked" not in done.stderr, done.stderr
    assert check is None or done.returncode == check, (arguments, done.returncode, done.stderr)
    return done


def hashes(run):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(run.glob("shard-*.mcap"))}


class Counter:
    def __init__(self, work, seed):
        self.work, self.random = work, random.Random(seed)
        self.config = work / "sweep.toml"
        self.config.write_text(SWEEP)
        self.rows = []
        # Folders that are whole and hold a temporary file of a process that is gone.
        self.left = 0
        began = time.monotonic()
        self.good = work / "good"
        self.sweep(self.good, check=0)
        self.length_s = time.monotonic() - began
        self.wanted = hashes(self.good)
        assert len(self.wanted) == SHARDS

    def sweep(self, out, *more, check=None):
        return gripgen("sweep", self.config, "-o", out, "-q", *more, check=check)

    def row(self, what, tried, wrong, note=""):
        self.rows.append((what, tried, wrong, note))
        print(f"{what}: {tried} tried, {wrong} wrong {note}", flush=True)

    def complete(self, run):
        """Whether the same command makes the run whole, with the bytes of one that nobody disturbed."""
        self.sweep(run, check=0)
        self.left += bool(list(run.glob("*.partial")))
        return hashes(run) == self.wanted and gripgen("verify", run).returncode == 0

    def kills(self, times):
        wrong = untrue = folders = done = 0
        while done < times:
            run = self.work / f"killed-{folders}"
            folders += 1
            for _ in range(self.random.randint(1, 6)):
                child = subprocess.Popen([os.environ["GRIPGEN_BIN"], "sweep", self.config, "-o", run, "-q"], stderr=subprocess.DEVNULL)
                time.sleep(self.random.uniform(0, 1.1) * self.length_s)
                child.send_signal(signal.SIGKILL)
                child.wait()
                done += 1
                # What says that it is finished is.
                for sidecar in run.glob("shard-*.json"):
                    shard = sidecar.with_suffix(".mcap")
                    untrue += not shard.is_file() or hashes(run).get(shard.name) != self.wanted[shard.name]
            wrong += not self.complete(run)
            shutil.rmtree(run)
        note = f"{folders} folders finished by the same command, finished shards looked at after each kill; in {self.left} a temporary file of a killed process stayed"
        self.row("SIGKILL of a sweep at a random moment", done, wrong + untrue, note)

    def two_at_once(self, times):
        wrong = 0
        for i in range(times):
            run = self.work / f"two-{i}"
            both = [subprocess.Popen([os.environ["GRIPGEN_BIN"], "sweep", self.config, "-o", run, "-q"], stderr=subprocess.DEVNULL) for _ in range(2)]
            codes = [child.wait() for child in both]
            wrong += codes != [0, 0] or not self.complete(run)
            shutil.rmtree(run)
        self.row("two sweeps in one folder at once", times, wrong)

    def vanished(self, times):
        wrong = 0
        for i in range(times):
            run = self.work / f"vanished-{i}"
            shutil.copytree(self.good, run)
            files = [path for path in run.iterdir() if path.name != "run.json" and path.is_file()]
            for path in self.random.sample(files, self.random.randint(1, 4)):
                path.unlink()
            wrong += not self.complete(run)
            shutil.rmtree(run)
        self.row("files of a run that vanished", times, wrong, "1 to 4 of shards, sidecars, index, contact sheet; the same command makes them again")

    def disk(self, what, size_kb, use):
        at = self.work / "disk"
        at.mkdir(exist_ok=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size_kb}k", "tmpfs", at], check=True)
        try:
            return use(at)
        finally:
            subprocess.run(["umount", at], check=True)

    def full(self, times):
        size_kb = sum(path.stat().st_size for path in self.good.rglob("*") if path.is_file()) // 1024
        wrong = full = 0

        def use(at):
            nonlocal wrong, full
            run = at / "run"
            done = self.sweep(run)
            if done.returncode == 0:
                return
            full += 1
            said = str(at) in done.stderr and "hint:" in done.stderr
            finished = {s.with_suffix(".mcap").name for s in run.glob("shard-*.json") if s.stat().st_size}
            true = all(hashes(run).get(name) == self.wanted[name] for name in finished)
            nothing_half = not [path for path in run.glob("*.partial")]
            subprocess.run(["mount", "-o", f"remount,size={4 * size_kb}k", at], check=True)
            wrong += not (done.returncode == 1 and said and true and nothing_half and self.complete(run))

        for _ in range(times):
            self.disk("full", self.random.randint(40, size_kb), use)
        self.row("a disk that is full", full, wrong, f"{times} sizes from 40 to {size_kb} kB; path, cause, hint, nothing half, goes on after space is made")

    def read_only(self):
        cases, wrong = 0, 0

        def use(at):
            nonlocal cases, wrong
            shutil.copytree(self.good, at / "run")
            (at / "run/shard-00003.mcap").unlink()
            subprocess.run(["mount", "-o", "remount,ro", at], check=True)
            for arguments in [
                ("sweep", self.config, "-o", at / "run"), ("sweep", self.config, "-o", at / "new"),
                ("view", at / "run"), ("show", at / "run", "1"), ("verify", at / "run", "--repair"),
                ("export", at / "run", "--to", "parquet", "-o", at / "x.parquet"),
                ("export", at / "run", "--to", "webdataset", "-o", at / "x.tar"),
                ("export", at / "run", "--to", "lerobot", "-o", at / "x"),
                ("export", at / "run", "--sample", "1", "-o", at / "x.mcap"),
                ("init", at / "mine"), ("campaign", "-o", at / "c.toml", "--parts", "gear"),
            ]:
                cases += 1
                done = gripgen(*arguments)
                bad = done.returncode not in (1, 2, 5) or str(at) not in done.stderr + done.stdout
                if bad:
                    print("read-only:", arguments, done.returncode, done.stderr[-300:])
                wrong += bad

        self.disk("read-only", 20000, use)
        self.row("a disk that is read-only, a verb each", cases, wrong, "refused with the path, no panic")

    def damaged(self, times):
        import gripgen as gg

        run = self.work / "damaged"
        shutil.copytree(self.good, run)
        missed = other = refused = 0
        left_out = 0
        want = {index: (images.tobytes(), labels.tobytes()) for index, images, labels in self.rows_of(gg, run)}
        for i in range(times):
            shard = self.random.choice(sorted(run.glob("shard-*.mcap")))
            whole = shard.read_bytes()
            bytes_ = bytearray(whole)
            if i % 2:
                bytes_[self.random.randrange(len(whole))] ^= 1 << self.random.randrange(8)
            else:
                del bytes_[self.random.randrange(len(whole)):]
            shard.write_bytes(bytes_)
            missed += gripgen("verify", run, "-q").returncode != 5
            try:
                read = 0
                for index, images, labels in self.rows_of(gg, run):
                    other += want[index] != (images.tobytes(), labels.tobytes())
                    read += 1
                left_out += read < len(want)
            except gg.GripgenError:
                refused += 1
            shard.write_bytes(whole)
        assert hashes(run) == self.wanted
        self.row("shards with a flipped bit or cut off: `verify`", times, missed, "found: exit code 5")
        self.row("the same shards read in Python", times, other, f"{refused} refused as a DataError, {left_out} left out as not done, the others read as before; no panic")

    def rows_of(self, gg, run):
        ds = gg.load(run)
        for row, index in enumerate(ds.column("index")):
            images, labels = ds.batch([row])
            yield int(index), images, labels

    def table(self):
        lines = ["| what | tried | lost, wrong or missed | |", "|---|---|---|---|"]
        return "\n".join(lines + [f"| {what} | {tried} | {wrong} | {note} |" for what, tried, wrong, note in self.rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--shards", type=int, default=1000)
    parser.add_argument("--times", type=int, default=20, help="for everything else")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", type=Path, help="a page whose table is replaced")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        counter = Counter(Path(work), args.seed)
        counter.kills(args.kills)
        counter.two_at_once(args.times)
        counter.vanished(args.times)
        if os.geteuid() == 0:
            counter.full(args.times)
            counter.read_only()
        else:
            counter.row("full and read-only disks", 0, 0, "needs root")
        counter.damaged(args.shards)
        print(counter.table())
        if args.table:
            page = args.table.read_text()
            before, rest = page.split(BEGIN)
            args.table.write_text(f"{before}{BEGIN}\n{counter.table()}\n{END}{rest.split(END)[1]}")
        return 1 if any(wrong for _, _, wrong, _ in counter.rows) else 0


if __name__ == "__main__":
    sys.exit(main())
