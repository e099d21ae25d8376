"""python -m research.blind.scorer FOLDER [--json OUT.json] [--markdown OUT.md] [--details]

Runs the tool (environment GRIPGEN_BIN) on every campaign of FOLDER, reads the truth in
FOLDER-sealed and prints the table. `--details` lists each campaign with its truth: for a
development split only.
"""

import argparse
import hashlib
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from . import judge, runner


def check_seal(sealed):
    """The truths are those whose hashes stand in SHA256; returns the hash over all."""
    text = (sealed / "SHA256").read_text(encoding="utf-8")
    for line in text.splitlines():
        digest, name = line.split()
        truth = (sealed / name / "truth.json").read_bytes()
        if hashlib.sha256(truth).hexdigest() != digest:
            raise SystemExit(f"{name}: the sealed truth is not the one that was written")
    return hashlib.sha256(text.encode()).hexdigest()


def score(folder, work, tool, jobs=2, only=None):
    """Records of all campaigns by name; `tool(campaign, unseen, work)` gives an `Answer`."""
    folder, sealed = Path(folder), Path(str(folder) + "-sealed")
    seal = check_seal(sealed)
    names = sorted(p.name for p in folder.iterdir() if (p / "pulls.csv").is_file())
    names = [n for n in names if not only or n in only]

    def one(name):
        try:
            answer = tool(folder / name, sealed / name / "unseen", Path(work) / name).plain()
        except Exception as error:  # a tool must not stop the table
            answer = runner.Answer(reason=f"{type(error).__name__}: {error}").plain()
        truth = json.loads((sealed / name / "truth.json").read_text(encoding="utf-8"))
        record = judge.judge(truth, answer)
        record["reason"] = answer["reason"]
        print(f"{name} {answer['seconds']:.1f} s {answer['reason']}", file=sys.stderr, flush=True)
        return name, record

    with ThreadPoolExecutor(jobs) as pool:
        records = dict(pool.map(one, names))
    return records, seal


def table(columns):
    """Markdown: one row a measure, one column a tool. `columns`: {tool: summary}."""
    tools = list(columns)
    lines = ["| measure | target | " + " | ".join(tools) + " |", "|---" * (len(tools) + 2) + "|"]
    for key, text, target, upward in judge.RATES:
        cells = []
        for tool in tools:
            r = columns[tool]["rates"].get(key)
            cells.append("-" if r is None else f"{r['rate']:.2f} ({r['hits']}/{r['of']}, {r['low95']:.2f}..{r['high95']:.2f})")
        if any(c != "-" for c in cells):
            goal = "" if target is None else (">= " if upward else "<= ") + f"{target:.2f}"
            lines.append(f"| {text} | {goal} | " + " | ".join(cells) + " |")
    for name, (_, goal) in next(iter(columns.values()))["numbers"].items():
        values = [columns[t]["numbers"][name][0] for t in tools]
        cells = ["-" if v is None else f"{v:.2f}" for v in values]
        lines.append(f"| {name} | {goal} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def details(records):
    """One line per campaign, truth included."""
    lines = []
    for name, r in records.items():
        good = [k for k in ("null", "top1", "top1_class", "both", "unknown_right", "covered", "small_named") if k in r]
        marks = " ".join(f"{k}={'yes' if r[k] else 'NO'}" for k in good)
        ratio = "-" if "ratio" not in r else f"{r['ratio']:.2f}"
        stated = "-" if "stated_ratio" not in r else f"{r['stated_ratio']:.2f}"
        lines.append(
            f"{name} {r['group']}/{r['kind']} truth={'+'.join(r['truth']) or '-'} x{r['multiple']:.1f} "
            f"-> {r['verdict']} {'+'.join(r['named']) or '-'} unknown={','.join(r['unknown']) or '-'} "
            f"{marks} after/floor={ratio} stated={stated} {r['seconds']:.0f}s {r.get('reason', '')}"
        )
    return "\n".join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--json")
    parser.add_argument("--markdown")
    parser.add_argument("--details", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit-s", type=float, default=240)
    parser.add_argument("--only", default="", help="comma list of campaign names")
    parser.add_argument("--no-before", action="store_true")
    parser.add_argument("--reports", action="store_true", help="score what an earlier run left in --work")
    parser.add_argument("--names-only", action="store_true", help="no errors on unseen pulls")
    parser.add_argument("--work", default=None, help="where reports and twins go")
    args = parser.parse_args(arguments)
    work = args.work or args.folder.rstrip("/") + "-work"
    only = [n for n in args.only.split(",") if n]

    def tool(campaign, unseen, place):
        if args.reports:
            return runner.collect(unseen, place, args.limit_s)
        return runner.diagnose(campaign, unseen, place, args.limit_s, not args.no_before, not args.names_only)

    records, seal = score(args.folder.rstrip("/"), work, tool, args.jobs, only)
    result = judge.summary(list(records.values()))
    text = f"sealed truth sha256 {seal}, {len(records)} campaigns\n\n" + table({"gripgen": result})
    print(text)
    if args.details:
        print(details(records))
    if args.markdown:
        Path(args.markdown).write_text(text, encoding="utf-8")
    if args.json:
        body = {"seal": seal, "summary": result}
        if args.details:
            body["records"] = records
        Path(args.json).write_text(json.dumps(body, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
