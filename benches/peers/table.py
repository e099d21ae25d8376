"""Slip force, label, creep and speed of MuJoCo, PyBullet and gripgen on the same pulls, as Markdown.

    python benches/peers/table.py [--gripgen FILE [--gripgen-command COMMAND]]

FILE is a JSON list with an object for each pull of gripgen:

    {"mechanics": "rapier", "shape": "vertical_shaft", "mu": 0.6, "grip_force_n": 80, "slip_force_n": 96.0}

and, optional in each, "label_n", "creep_mm_per_s", "pulls_per_s", "us_per_step", "steps". "mechanics" is rapier or
reduced. Shapes and definitions are those of scene.py; noise off, kinetic ratio 1. COMMAND, if given, is run first and
has to write FILE, so that the speeds of all are from one run.
"""

import argparse
import importlib
import itertools
import json
import os
import platform
import shlex
import subprocess
import sys

from scene import SHAPES, measure

MUS = (0.14, 0.168, 0.3, 0.6, 1.0)
GRIP_FORCES_N = (5.0, 20.0, 40.0, 80.0)
DEFAULTS = {"cone": "pyramidal", "impratio": 1.0}
BARE = {"drive": "bare", "carriage_kg": 2.0}
VARIANTS = [  # name, module, options
    ("MuJoCo, its defaults", "mujoco_pull", DEFAULTS),
    ("MuJoCo, elliptic, impratio 100", "mujoco_pull", {}),
    ("MuJoCo, elliptic, impratio 100, contacts 4 ms", "mujoco_pull", {"contact_time_s": 0.004}),
    ("PyBullet, 1/500 s", "pybullet_pull", {}),
    ("PyBullet, 1/240 s (its default)", "pybullet_pull", {"step_s": 1 / 240}),
    ("bare: MuJoCo, elliptic, impratio 100", "mujoco_pull", BARE),
    ("bare: PyBullet, 1/500 s", "pybullet_pull", BARE),
    ("bare: PyBullet, 1/240 s", "pybullet_pull", {"step_s": 1 / 240, **BARE}),
]
GRIPGEN = ("gripgen, rapier", "gripgen, reduced")
TIMED = (("box", 0.168, 40.0), ("vertical_shaft", 0.6, 80.0))
NAMED = (("vertical_shaft", 0.6, 80.0), ("horizontal_shaft", 0.6, 80.0), ("box", 0.168, 40.0))
TO_FILL = "(to fill in)"


def peer_cases(name, module_name, options, timing_repeats):
    """All cases of one engine variant; none if the package is not installed."""
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return []
    cases = []
    for shape, mu, force_n in itertools.product(SHAPES, MUS, GRIP_FORCES_N):
        timed = (shape, mu, force_n) in TIMED and options.get("drive") != "bare"
        repeats = timing_repeats if timed else 0
        cases.append(measure(module.Engine, shape, mu, force_n, timing_repeats=repeats, **options))
    print(f"{name}: {len(cases)} pulls", file=sys.stderr)
    return cases


def gripgen_cases(path, mechanics):
    """The rows of one of gripgen's mechanics, with the ratios that the peers' cases have."""
    cases = []
    for row in json.load(open(path, encoding="utf-8")) if path else []:
        if row["mechanics"] != mechanics:
            continue
        limit_n = 2.0 * row["mu"] * row["grip_force_n"]
        case = dict(row, ratio=row["slip_force_n"] / limit_n)
        if "label_n" in row:
            case["label_ratio"] = row["label_n"] / limit_n
        cases.append(case)
    return cases


def row(*cells):
    print("| " + " | ".join(cells) + " |")


def head(*cells):
    row(*cells)
    print("|---" * len(cells) + "|")


def percent(ratio):
    return f"{(ratio - 1.0) * 100.0:+.2f}" if abs(ratio - 1.0) >= 5e-5 else "0.00"


def speed(mm_per_s):
    if abs(mm_per_s) < 1e-6:
        return "< 1e-6"
    return f"{mm_per_s:.0f}" if abs(mm_per_s) >= 10.0 else f"{mm_per_s:.2g}"


def where(case):
    return f"{case['mu']:g}, {case['grip_force_n']:g} N"


def worst_table(results, title, key, badness, show):
    """The worst case of each engine and shape."""
    print(f"\n{title}\n")
    head("engine", *(shape.replace("_", " ") for shape in SHAPES))
    for name, cases in results.items():
        cells = []
        for shape in SHAPES:
            known = [c for c in cases if c["shape"] == shape and key in c]
            if known:
                worst = max(known, key=lambda c: badness(c[key]))
                shown = show(worst[key])
                cells.append(shown if shown in ("0.00", "< 1e-6") else f"{shown} ({where(worst)})")
            else:
                cells.append(TO_FILL if name in GRIPGEN else "not run")
        row(name, *cells)


def count_table(results):
    """How many pulls of each engine are off."""
    limits = (("ratio", 1.0, 0.01), ("label_ratio", 1.0, 0.01), ("creep_mm_per_s", 0.0, 1e-3))
    print("\nHow many of the pulls are off\n")
    head("engine", "pulls", "slip force by > 1 %", "label by > 1 %", "creep > 1e-3 mm/s")
    for name, cases in results.items():
        known = [[c[key] for c in cases if key in c] for key, _, _ in limits]
        off = [sum(abs(v - ideal) > limit for v in k) for k, (_, ideal, limit) in zip(known, limits)]
        cells = [str(count) if k else "" for count, k in zip(off, known)]
        row(name, str(len(cases)), *cells) if cases else row(name, *[TO_FILL if name in GRIPGEN else "not run"] * 4)


def single_cases(results):
    """The cases of NAMED, and of every engine the two with the worst label beyond 2 %."""
    print("\nSingle cases: slip force and label, in N\n")
    head("engine", "shape", "mu, F_G", "2 mu F_G", "slip force", "label", "creep in mm/s")
    for name, cases in results.items():
        named = [c for c in cases if (c["shape"], c["mu"], c["grip_force_n"]) in NAMED]
        off = [c for c in cases if abs(c.get("label_ratio", 1.0) - 1.0) > 0.02 and c not in named]
        off = sorted(off, key=lambda c: -abs(c["label_ratio"] - 1.0))[:2]
        for case in named + off:
            limit_n = 2.0 * case["mu"] * case["grip_force_n"]
            label = f"{case['label_n']:.2f}" if "label_n" in case else ""
            creep = speed(case["creep_mm_per_s"]) if "creep_mm_per_s" in case else ""
            shape = case["shape"].replace("_", " ")
            row(name, shape, where(case), f"{limit_n:.2f}", f"{case['slip_force_n']:.2f}", label, creep)
        if not cases:
            row(name, *[TO_FILL if name in GRIPGEN else "not run"] * 6)


def speed_table(results):
    """Speed on the timed cases, and relative to PyBullet at the same step."""
    print("\nSpeed on one core, CPU time, medians\n")
    reference_name = "PyBullet, 1/500 s"
    head("engine", "case", "us per step", "of it engine", "steps", "pulls per s", f"relative to {reference_name}")
    for name, cases in results.items():
        timed = [c for c in cases if "pulls_per_s" in c]
        for case in timed:
            key = (case["shape"], case["mu"], case["grip_force_n"])
            reference = [
                c["pulls_per_s"]
                for c in results[reference_name]
                if (c["shape"], c["mu"], c["grip_force_n"]) == key and "pulls_per_s" in c
            ]
            times = f"{case['pulls_per_s'] / reference[0]:.2f}" if reference else ""
            step, engine = (f"{case[k]:.1f}" if k in case else "" for k in ("us_per_step", "engine_us_per_step"))
            shape = case["shape"].replace("_", " ")
            steps, pulls = str(case.get("steps", "")), f"{case['pulls_per_s']:.1f}"
            row(name, f"{shape}, {where(case)}", step, engine, steps, pulls, times)
        if name in GRIPGEN and not timed:
            row(name, *[TO_FILL] * 6)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", metavar="FILE", help="JSON list of gripgen's pulls")
    parser.add_argument("--gripgen-command", metavar="COMMAND", help="run first; writes FILE")
    parser.add_argument("--timing-repeats", type=int, default=5)
    arguments = parser.parse_args()
    if arguments.gripgen_command:
        subprocess.run(shlex.split(arguments.gripgen_command), check=True, stdout=sys.stderr)
    results = {name: gripgen_cases(arguments.gripgen, name.split()[-1]) for name in GRIPGEN}
    for name, module, options in VARIANTS:
        results[name] = peer_cases(name, module, options, arguments.timing_repeats)
    versions = [f"Python {platform.python_version()}"]
    for module in ("mujoco_pull", "pybullet_pull"):
        version = getattr(sys.modules.get(module), "VERSION", "not installed")
        versions.append(f"{module.removesuffix('_pull')} {version}")
    print(f"{', '.join(versions)}; {platform.machine()}, {os.cpu_count()} cores")
    ends = "(mu, F_G of that case)"
    off = {"badness": lambda ratio: abs(ratio - 1.0), "show": percent}
    worst_table(results, f"Slip force: worst error against 2 mu F_G, in percent {ends}", "ratio", **off)
    worst_table(results, f"Label by the 3 N rule: worst error, in percent {ends}", "label_ratio", **off)
    title = f"Creep at 0.9 F_max over 2 s: worst, in mm/s {ends}"
    worst_table(results, title, "creep_mm_per_s", badness=abs, show=speed)
    count_table(results)
    single_cases(results)
    speed_table(results)


if __name__ == "__main__":
    main()
