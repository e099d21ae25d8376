"""python -m research.blind.all --out target/blind --doc research/loop/blind.md [--cases 200]

The whole benchmark: writes the development split (30 %) and the sealed split (70 %), runs
the tool named by GRIPGEN_BIN and the baselines on both, and writes the page.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from . import baselines, generate, judge, runner, scorer

PAGE = """# Blind benchmark

{cases} campaigns made by the separate generator in [research/blind](../blind/README.md), which shares no code and no
formula with gripgen. {dev} of them (the development split) and 180 more drawn alike (`--split dev --cases 180`) were used while the
method was made; the {sealed} sealed ones only for this table. sha256 over the sealed truths: `{seal}`.

Rates carry their exact 95 % interval. All errors are on 120 pulls per campaign that no tool has seen; the floor is the error
of an oracle that knows all but scatter and noise. Re-run: `{command}`.

## Sealed split

{sealed_table}
## Development split

{dev_table}
Version: {version}.
"""


def run(folder, work, tools, jobs, limit_s):
    """{tool: summary}, and the seal."""
    columns, seal = {}, ""
    for name in ["gripgen", *tools]:
        if name == "gripgen":
            tool = lambda campaign, unseen, place: runner.diagnose(campaign, unseen, place, limit_s)
        else:
            tool = baselines.timed(baselines.TOOLS[name])
        records, seal = scorer.score(folder, work, tool, jobs)
        columns[name] = judge.summary(list(records.values()))
    return columns, seal


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("--out", default="target/blind")
    parser.add_argument("--doc")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit-s", type=float, default=240)
    parser.add_argument("--tools", default="offset,bic,stlsq", help="baselines; gp needs scikit-learn")
    args = parser.parse_args(arguments)
    out = Path(args.out)
    numbers = {"dev": round(0.3 * args.cases), "sealed": args.cases - round(0.3 * args.cases)}
    results, seals = {}, {}
    for split, count in numbers.items():
        folder = out / split
        print(f"{split}: {count} campaigns", file=sys.stderr)
        if not (out / f"{split}-sealed" / "SHA256").is_file():
            generate.main(["--split", split, "--out", str(folder), "--cases", str(count), "--jobs", str(args.jobs)])
        results[split], seals[split] = run(
            folder, out / f"{split}-work", [t for t in args.tools.split(",") if t], args.jobs, args.limit_s)
    (out / "blind.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    page = PAGE.format(
        cases=args.cases, dev=numbers["dev"], sealed=numbers["sealed"], seal=seals["sealed"],
        sealed_table=scorer.table(results["sealed"]), dev_table=scorer.table(results["dev"]),
        command="cargo xtask research blind", version=version(),
    )
    if args.doc:
        Path(args.doc).parent.mkdir(parents=True, exist_ok=True)
        Path(args.doc).write_text(page, encoding="utf-8")
    print(page)


def version():
    """What the tool says of itself."""
    binary = os.environ.get("GRIPGEN_BIN", "gripgen")
    try:
        return subprocess.run([binary, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


if __name__ == "__main__":
    main()
