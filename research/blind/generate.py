"""python -m research.blind.generate --split dev --out FOLDER --cases 60

Writes FOLDER/c000, c001, ... and, apart from them, FOLDER-sealed/c000/truth.json with
FOLDER-sealed/c000/unseen/. Prints the sha256 over all sealed truths.
"""

import argparse
import hashlib
import os
import sys
from multiprocessing import Pool
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402

from . import cases, generator  # noqa: E402

SPLITS = {"dev": 20_260_101, "sealed": 77_003_311}


def _job(job):
    case, seed, name, out, sealed = job
    return name, generator.build(case, seed, name, out, sealed)


def plan(split, count, salt=0, groups=None, worlds=None):
    """The cases of a split with their seeds."""
    rng = np.random.default_rng([SPLITS[split], salt])
    drawn = cases.draw_cases(count, rng, worlds)
    seeds = [int(rng.integers(1 << 40)) for _ in drawn]
    return [(c, s, i) for i, (c, s) in enumerate(zip(drawn, seeds)) if not groups or c["group"] in groups]


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--split", choices=sorted(SPLITS), required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--salt", type=int, default=0, help="another set of seeds")
    parser.add_argument("--groups", default="", help="only these, as in ABC")
    parser.add_argument("--worlds", default=None, help="make --cases of each of these harder worlds, as in ns3o")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args(arguments)
    out, sealed = Path(args.out), Path(args.out + "-sealed")
    out.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    jobs = [(c, s, f"c{i:03d}", out, sealed) for c, s, i in plan(args.split, args.cases, args.salt, args.groups, args.worlds)]
    with Pool(args.jobs) as pool:
        done = {}
        for name, digest in pool.imap_unordered(_job, jobs):
            done[name] = digest
            print(f"{len(done)}/{len(jobs)} {name}", file=sys.stderr, flush=True)
    text = "".join(f"{digest}  {name}\n" for name, digest in sorted(done.items()))
    (sealed / "SHA256").write_text(text, encoding="utf-8")
    print(hashlib.sha256(text.encode()).hexdigest())


if __name__ == "__main__":
    main()
