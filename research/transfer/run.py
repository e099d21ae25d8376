"""Trains on each set, tests in W1, W2 and W3, prints the tables: `python -m research.transfer.run --work DIR`."""

import argparse
import json
import pickle
import time
from pathlib import Path

import numpy as np

from research.transfer import features, real, sets, tables
from research.transfer.network import EPOCHS, Network, Prediction, Ridge, Rows, chosen
from research.transfer.worlds import PARTS, Samples, world

WORLDS = 8
MAIN = ("old", "new", "new-all", "new-plain")
SMALLER = ("new-less", "w1-native")  # sets with fewer rows
ABLATED = ("no-friction", "no-gel", "no-rig", "one-family")
Table = dict[str, np.ndarray]


def table_of(samples: Samples, lights: bool) -> Table:
    """Features of samples, under the lights they have and under others."""
    out = {"x": features.of_grips(samples.change), "contact": features.of_contact(samples.area_mm2, samples.depth_mm)}
    if lights:
        rng = np.random.default_rng(3)
        out["x_other"] = np.concatenate([features.of_grips(features.other_lights(c, rng)) for c in np.array_split(samples.change, 16)])
        out["jaw"] = features.of_images(samples.change[:, 0])
        out["jaw_other"] = np.concatenate([features.of_images(features.other_lights(c[:, :1].repeat(2, 1), rng)[:, 0])
                                           for c in np.array_split(samples.change, 16)])
    return out | {k: v for k, v in vars(samples).items() if k != "change" and v is not None}


def kept(path: Path, make) -> Table:
    """A table, made once."""
    if not path.exists():
        np.savez(path, **make())
    return dict(np.load(path))


def rows(table: Table, keep: np.ndarray) -> Table:
    """Some rows."""
    return {k: v[keep] for k, v in table.items()}


def inputs(table: Table, kind: str, name: str = "x") -> np.ndarray:
    """Inputs of a network: `images`, `both`, `force` or `contact` (an oracle)."""
    told = np.log(table["force_n"])[:, None]
    if kind == "force":
        return told
    if kind == "images":
        return table[name]
    return np.concatenate([table["contact"] if kind == "contact" else table[name], told], 1)


def trained(table: Table, kind: str, seed: int, lights: bool) -> Network:
    """A network; each row twice where its images are also seen under other lights. A third of the rigs (of the rows in a set
    without rigs) chooses the weight decay."""
    rig = np.unique(table["rig"], return_inverse=True)[1]
    names = rig if rig.max() else np.arange(len(rig))
    held = np.random.default_rng(seed).permutation(names.max() + 1)[names] % 3 == 0
    data = Rows(inputs(table, kind), table["label_n"], table["censored"], rig)
    epochs = EPOCHS
    if lights and kind not in ("force", "contact"):
        x = np.concatenate([data.x, inputs(table, kind, "x_other")])
        data, held = Rows(x, *(np.tile(v, 2) for v in (data.label_n, data.censored, rig)), 2), np.tile(held, 2)
        epochs = EPOCHS // 2
    return Network(data, seed, chosen(data, held, seed, epochs), epochs)


def networks_of(work: Path, variant: str, data: dict[str, Table], count: int, seeds: int) -> dict[tuple[str, int], Network]:
    """The networks of one training set, by input and seed, made once."""
    path = work / f"networks-{variant}-{count}-{seeds}.pkl"
    if path.exists():
        return pickle.loads(path.read_bytes())
    table = data["new" if variant.startswith("new") else variant]
    table = rows(table, np.ones(len(table["trails"]), bool) if variant == "new-all" else ~table["trails"])
    table = rows(table, np.arange(len(table["label_n"])) < count)
    kinds = ("force", "images", "both", "contact") if variant in ("new", *SMALLER) else ("force", "images", "both")
    started = time.time()
    found = {(kind, seed): trained(table, kind, seed, variant != "new-plain") for seed in range(seeds) for kind in kinds}
    path.write_bytes(pickle.dumps(found))
    print(f"{variant}: {time.time() - started:.0f} s", flush=True)
    return found


def in_world(table: Table, seed: int) -> dict[str, Prediction]:
    """What is trained in a world itself, on nine of its twelve parts: oracles with true contact, and a ridge on images."""
    n = len(table["label_n"])
    found = {k: Prediction(np.zeros(n), np.zeros(n)) for k in ("oracle-ridge", "oracle-network", "native")}
    for fold in range(4):
        test = table["part"] * 4 // PARTS == fold
        a, b = rows(table, ~test), rows(table, test)
        one = {
            "oracle-ridge": Ridge(inputs(a, "contact"), a["label_n"])(inputs(b, "contact")),
            "oracle-network": Network(Rows(inputs(a, "contact"), a["label_n"], a["censored"], np.zeros(len(a["label_n"]), int)), seed, epochs=120)(inputs(b, "contact")),
            "native": Ridge(inputs(a, "both"), a["label_n"], strength=10.0)(inputs(b, "both")),
        }
        for k, p in one.items():
            found[k].mean[test], found[k].sd[test] = p.mean, p.sd
    return found


def worlds_of(work: Path, samples: int, seed: int) -> dict[str, Table]:
    """All test worlds: W1 by rig, without lower bounds and labels from before the slip, and W2."""
    first = kept(work / "features-w1.npz", lambda: table_of(sets.made("w1", work, samples), False))
    first = rows(first, ~first["trails"] & ~first["censored"])
    found = {f"W1 {rig}": rows(first, first["rig"] == rig) for rig in np.unique(first["rig"])}
    found = {k: v for k, v in found.items() if len(v["label_n"]) >= 40}
    for w in range(WORLDS):
        found[f"W2 {w}"] = kept(work / f"features-w2-{w}.npz", lambda w=w: table_of(world(w, seed), False))
    return found


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=4000, help="of each training set")
    parser.add_argument("--fewer", type=int, default=2800, help="of each smaller set and of W1")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--world-seed", type=int, default=2027, help="of W2; 2026 was seen while the predictor was made")
    parser.add_argument("--main-only", action="store_true", help="no ablations")
    parser.add_argument("--real", type=Path, help="folder of real grasps with known force (W3)")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)

    variants = (*MAIN, *SMALLER) if args.main_only else (*MAIN, *SMALLER, *ABLATED)
    sizes = {n: args.samples if n in MAIN else args.fewer for n in ("new", "old", *(v for v in variants if v not in MAIN and v != "new-less"))}
    data = {n: kept(args.work / f"features-{n}.npz", lambda n=n: table_of(sets.made(n, args.work, sizes[n]), True)) for n in sizes}
    counts = {n: int((~t["trails"]).sum()) for n, t in data.items()}
    least = {True: min(counts[n] for n in ("old", "new")), False: min(counts.values())}
    print("rows without trailing labels:", counts, "cut to", least[True], "smaller sets to", least[False], flush=True)
    networks = {v: networks_of(args.work, v, data, least[v in MAIN], args.seeds) for v in variants}

    tests = worlds_of(args.work, args.fewer, args.world_seed)
    predictions = {(v, kind, seed, w): n(inputs(t, kind)) for v, found in networks.items() for (kind, seed), n in found.items() for w, t in tests.items()}
    for seed in range(args.seeds):
        for w, t in tests.items():
            if w.startswith("W2"):
                predictions |= {(k, "both", seed, w): p for k, p in in_world(t, seed).items()}
    keep = {w: {k: t[k] for k in ("force_n", "label_n", "part")} for w, t in tests.items()}
    with (args.work / "predictions.pkl").open("wb") as out:
        pickle.dump((keep, predictions), out)
    text, figures = tables.report(keep, predictions, args.seeds)
    if args.real:
        text += real.report(args.real, {n: rows(data[n], np.arange(len(data[n]["label_n"])) < least[True]) for n in ("old", "new")}, args.seeds)
    (args.work / "tables.md").write_text(text)
    (args.work / "figures.json").write_text(json.dumps(figures, indent=1))
    print(text)


if __name__ == "__main__":
    main()
