"""`gripgen import`: recordings of other programs as folders of measured pulls. The other verbs are those of the Rust half."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ._core import GripgenError
from .bag_mapping import ROSBAG_FILE
from .bags import BagSummary, read_bag
from .checks import refusal

#: Exit codes of the command line.
FAILED, USAGE, INTERRUPTED = 1, 2, 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gripgen import",
        description="Make a folder of measured pulls of ROS bags: ROS 1, or ROS 2 as MCAP or sqlite3.",
        epilog="Examples:\n  gripgen import lab-bags -o lab\n  gripgen import monday.bag --mapping rosbag.toml -o monday --force",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="a bag, a folder with rosbag.toml, or that file")
    parser.add_argument("-o", "--out", type=Path, metavar="FOLDER", required=True, help="the folder to write")
    parser.add_argument("--mapping", type=Path, metavar="FILE.toml", help="the rosbag.toml, where it is not with the bag")
    parser.add_argument("--force", action="store_true", help="make a folder again that was made of bags")
    parser.add_argument("--json", nargs="?", const="-", metavar="FILE", help="JSON to standard output, or to FILE")
    parser.add_argument("-q", "--quiet", action="store_true", help="say nothing but errors")
    return parser


def run(arguments: Sequence[str]) -> int:
    """Run the verb with these arguments and return its exit code."""
    args = _parser().parse_args(arguments)
    try:
        answer = None if args.json in (None, "-") else Path(args.json)
        if answer is not None and answer.exists() and not args.force:
            raise refusal(f"{answer}: it is there already", "--force replaces it")
        of_bag = [p.resolve() for p in (args.bag, args.mapping) if p is not None]
        if answer is not None and (answer.name == ROSBAG_FILE or {*of_bag} & {answer.resolve(), *answer.resolve().parents}):
            raise refusal(f"{answer}: it belongs to the bags", "name another file")
        found = read_bag(args.bag, args.mapping, out=args.out, force=args.force, progress=not args.quiet)
        if args.json:
            text = json.dumps(_document(found), indent=2) + "\n"
            if answer is None:
                sys.stdout.write(text)
            else:
                answer.write_text(text, encoding="utf-8")
    except GripgenError as e:
        problem, _, hint = str(e).partition("\nhint: ")
        print(f"error: {problem}" + (f"\n\nhint: {hint}" if hint else ""), file=sys.stderr)
        return USAGE
    except OSError as e:
        print(f"error: {e}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    if not args.quiet:
        _tell(found)
    return 0


def _document(found: BagSummary) -> dict[str, object]:
    return {
        "schema": "gripgen.import/1",
        "out": str(found.out),
        "pulls": found.pulls,
        "traces": found.traces,
        "images": found.images,
        "status": found.status,
        "notes": list(found.notes),
    }


def _tell(found: BagSummary) -> None:
    for note in found.notes:
        print(f"note: {note}", file=sys.stderr)
    status = ", ".join(f"{count} {name}" for name, count in sorted(found.status.items()))
    what = f"{found.traces} with a trace, {found.images} with images"
    print(f"{found.out}: {found.pulls} pull{'s' if found.pulls != 1 else ''} ({status}), {what}", file=sys.stderr)
