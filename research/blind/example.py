"""python -m research.blind.example assets/campaigns/example

Writes the campaign that ships as an example: varied enough to name what is in it, which
the seed decides. Add --sealed FOLDER to keep the truth and pulls that are not shipped.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from . import generator

SEED = 42
DESIGN = {
    "count": 120, "parts": 1, "names": ["long_shaft"], "forces": "few", "increments": [0.5, 1.0], "steps": [0.104],
    "dwells": [0.5, 3.0, 20.0, 90.0], "directions": [1, -1], "traces": "fourth",
}
CHOICE = ["dwell_ageing", "wear", "temperature", "jaw_tilt", "rate_dependence"]


def write(out, sealed):
    """Campaign to the folder `out`, truth to `sealed`."""
    out = Path(out)
    name = str(np.random.default_rng(SEED).choice(CHOICE))
    case = {"group": "B", "kind": "one", "acts": [(name, 5)], "design": DESIGN}
    generator.build(case, SEED, out.name, out.parent, sealed)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("out")
    parser.add_argument("--sealed")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as aside:
        write(args.out, args.sealed or aside)


if __name__ == "__main__":
    main()
