"""How long and how dear is a sweep of a million samples, or of a hundred million?

    python examples/scale_estimate.py

measures this machine (samples per second and core, bytes per sample) with small sweeps, then simulates clusters: workers that make a shard
and upload it through a store whose bandwidth they share, nodes that die and lose the shard under way. Prints a Markdown
table; `docs/scale.md` has that of one run. Prices and bandwidths are assumptions, given as options.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import gripgen as gg
import numpy as np

CONFIG = "asset:configs/quickstart.toml"
SMALL = {"storage": "clean", "compression": "small"}
KINDS = {
    "images, traces": {},
    "images": {"trace": "none"},
    "small clean images, traces": {"images": SMALL},
    "small clean images": {"images": SMALL, "trace": "none"},
    "labels": {"trace": "none", "images": "none"},
}


@dataclass(frozen=True)
class Rate:
    """What a core makes."""

    per_s: float
    bytes_per_sample: float


def measure(keys: dict[str, object], samples: int) -> Rate:
    """One core, a run that is thrown away; its start is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        own = {"design": "random", "mechanics": "reduced", "samples": samples, "shard_samples": samples} | keys
        began = []

        def progress(done: int, _: int) -> None:
            began.append((done, time.perf_counter()))

        gg.sweep(CONFIG, Path(folder) / "run", set=own, jobs=1, progress=progress)
        (first, t0), (last, t1) = began[0], began[-1]
        size = sum(p.stat().st_size for p in (Path(folder) / "run").glob("shard-*.mcap"))
    return Rate((last - first) / (t1 - t0), size / samples)


def simulate(
    rate: Rate, samples: float, cores: int, shard: int, store_mb_s: float, task_s: float, deaths_per_core_h: float
) -> tuple[float, float]:
    """Hours until all shards are there, and the share of that time in which cores wait for the store.

    Fluid model: a core computes a shard, then uploads it; uploads share the store evenly. With up to a thousand cores
    each is simulated, of more every n-th with an n-th of the store and of the work.
    """
    thin = max(1, cores // 1000)
    cores, samples, store = cores // thin, samples / thin, store_mb_s * 1e6 / thin
    rng = np.random.default_rng(0)
    shards = int(np.ceil(samples / shard))
    # A few dozen rounds show the steady state; what is left is the same again.
    simulated = min(shards, 40 * cores)
    compute_s, upload_b = shard / rate.per_s + task_s, shard * rate.bytes_per_sample
    active = min(cores, simulated)
    left_s = compute_s * (0.5 + rng.random(active))  # cores do not begin together
    left_b = np.zeros(active)
    queue, done, now, waited = simulated - active, 0, 0.0, 0.0
    while done < simulated:
        computing, sending = left_s > 0, left_b > 0
        share = store / max(1, sending.sum())
        steps = np.where(computing, left_s, np.where(sending, left_b / share, np.inf))
        step = max(steps.min(), 1e-9)
        now += step
        waited += step * sending.sum()
        dies = computing & (rng.random(active) < deaths_per_core_h * step / 3600)
        left_s[computing] -= step
        left_b[sending] -= step * share
        left_s[dies] = compute_s
        for i in np.flatnonzero(computing & (left_s <= 1e-9) & ~dies):
            left_s[i], left_b[i] = 0.0, upload_b
        for i in np.flatnonzero(sending & (left_b <= 1e-3)):
            left_b[i], done = 0.0, done + 1
            if queue > 0:
                queue, left_s[i] = queue - 1, compute_s
    return now / 3600 * shards / simulated, waited / (now * active)


def main() -> None:
    """Measure, simulate, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--measure-samples", type=int, default=1000)
    parser.add_argument("--shard", type=int, default=1000, help="samples in a shard")
    parser.add_argument("--store-mb-s", type=float, default=2000.0, help="what the store takes from all cores together")
    parser.add_argument("--task-s", type=float, default=1.0, help="start of a task and publication of its shard")
    parser.add_argument("--deaths", type=float, default=0.01, help="nodes that die, per core and hour")
    parser.add_argument("--core-hour", type=float, default=0.04, help="price of a core for an hour, USD")
    parser.add_argument("--gb-month", type=float, default=0.023, help="price of a GB for a month, USD")
    options = parser.parse_args()
    print("| what | samples | GB | cores | hours | cores wait for the store, % | USD, cores | USD a month, store |")
    print("|---|---|---|---|---|---|---|---|")
    for kind, keys in KINDS.items():
        rate = measure(keys, options.measure_samples)
        note = f"{kind}: {rate.per_s:.0f}/s and core, {rate.bytes_per_sample / 1e3:.1f} kB"
        for samples in (1e6, 1e8):
            size_gb = samples * rate.bytes_per_sample / 1e9
            for cores in (2, 64, 1024):
                hours, waiting = simulate(
                    rate, samples, cores, options.shard, options.store_mb_s, options.task_s, options.deaths
                )
                dear, store = hours * cores * options.core_hour, size_gb * options.gb_month
                print(
                    f"| {note} | 10^{np.log10(samples):.0f} | {size_gb:,.0f} | {cores} | {hours:,.2g} |"
                    f" {100 * waiting:.0f} | {dear:,.2f} | {store:,.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
