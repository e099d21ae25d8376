"""Runs the tool on one campaign and reads what it answers; survives crashes and timeouts."""

import json
import os
import subprocess
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path


@dataclass
class Answer:
    """What a tool said about one campaign, whatever the tool."""

    verdict: str = "failed"  # none, effect, unknown, insufficient, failed
    effects: list = field(default_factory=list)  # {"name", "class", "rivals", "weight", "parameters"}
    unknown: list = field(default_factory=list)  # covariates, strongest first
    stated: dict = field(default_factory=dict)  # error.after of the tool
    not_excited: list = field(default_factory=list)
    rmse_before_n: float | None = None  # on unseen pulls
    rmse_after_n: float | None = None
    seconds: float = 0.0
    reason: str = ""

    def plain(self):
        return asdict(self)


def _call(command, limit_s):
    started = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit_s, check=False)
    except subprocess.TimeoutExpired:
        return None, f"timeout after {limit_s} s", time.monotonic() - started
    except OSError as error:
        return None, str(error), time.monotonic() - started
    spent = time.monotonic() - started
    if done.returncode != 0:
        tail = done.stderr.strip().splitlines()[-3:]
        return None, f"exit {done.returncode}: " + " | ".join(tail), spent
    return done.stdout, "", spent


def read_answer(report):
    """An `Answer` from the tool's JSON; raises on a broken shape."""
    answer = Answer(verdict=report["verdict"])
    for entry in report.get("effects") or []:
        answer.effects.append({
            "name": entry["name"],
            "class": list(entry.get("class") or []),
            "weight": entry.get("weight"),
            "rivals": [r["name"] for r in entry.get("indistinguishable_from") or []],
            "parameters": entry.get("parameters") or {},
        })
    answer.unknown = [u["covariate"] for u in report.get("unknown") or []]
    answer.stated = (report.get("error") or {}).get("after") or {}
    answer.not_excited = report.get("not_excited") or []
    return answer


def diagnose(campaign, unseen, work, limit_s=240, before=True, errors=True):
    """diagnose, then compare on the unseen pulls; `GRIPGEN_BIN` names the binary.

    Without `errors` only what was named is looked at, no twin is written.
    """
    binary = os.environ.get("GRIPGEN_BIN", "gripgen")
    work = Path(work)
    work.mkdir(parents=True, exist_ok=True)
    report, twin = work / "report.json", work / "diagnosed.toml"
    for old in (report, twin):
        old.unlink(missing_ok=True)
    answer = Answer()
    command = [binary, "diagnose", str(campaign), "--json", str(report), "--force"] + (["-o", str(twin)] if errors else [])
    _, why, spent = _call(command, limit_s)
    if why:
        answer.reason, answer.seconds = why, spent
        return answer
    try:
        answer = read_answer(json.loads(report.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError) as error:
        return Answer(reason=f"unreadable report: {error!r}", seconds=spent)
    answer.seconds = spent
    if not errors:
        return answer
    answer.rmse_after_n, answer.reason = _compare(binary, unseen, twin, limit_s)
    if before:
        fitted = work / "fitted.toml"
        _, why, _ = _call([binary, "calibrate", "pulls", str(campaign), "-o", str(fitted), "--force"], limit_s)
        if not why:
            answer.rmse_before_n, _ = _compare(binary, unseen, fitted, limit_s)
    return answer


def _compare(binary, unseen, twin, limit_s):
    text, why, _ = _call([binary, "compare", str(unseen), "--twin", str(twin), "--json"], limit_s)
    if why:
        return None, "compare: " + why
    try:
        return float(json.loads(text)["pulls"]["rmse_n"]), ""
    except (ValueError, KeyError, TypeError) as error:
        return None, f"compare: {error!r}"


def collect(unseen, place, limit_s=120):
    """Scores a report and a twin that a run has left in `place`; only compare is run."""
    place = Path(place)
    try:
        answer = read_answer(json.loads((place / "report.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError) as error:
        return Answer(reason=f"unreadable report: {error!r}")
    twin = next((place / n for n in ("diagnosed.toml", "twin.toml") if (place / n).is_file()), None)
    if twin is not None:
        binary = os.environ.get("GRIPGEN_BIN", "gripgen")
        answer.rmse_after_n, answer.reason = _compare(binary, unseen, twin, limit_s)
    return answer
