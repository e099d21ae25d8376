"""Calibration, diagnosis and comparison: what the command line does, as objects."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import _core

_Path = str | os.PathLike[str]


@dataclass(frozen=True)
class Diagnosis:
    """What a twin lacks. `data` is the whole answer (`gripgen.diagnosis/1`, docs/format.md)."""

    #: "none", "effect", "unknown" or "insufficient".
    verdict: str
    #: One entry for each effect that acts: name, weight, parameters, indistinguishable_from, separate_by.
    effects: list[dict[str, Any]]
    #: Covariates on which something unknown depends, strongest first.
    unknown: list[dict[str, Any]]
    #: Error on pulls that the fit has not seen, before and after; None if nothing was fitted.
    error: dict[str, Any] | None
    data: dict[str, Any] = field(repr=False)
    #: The twin with what was found; give it to `Sim`, `sweep` or `compare`.
    twin: str | None = None
    #: The HTML page.
    report: str | None = None

    @property
    def names(self) -> list[str]:
        """Names of the effects found."""
        return [effect["name"] for effect in self.effects]


@dataclass(frozen=True)
class Calibration:
    """A calibrated twin."""

    #: Fitted values by key: value, low90, high90, unit.
    baseline: dict[str, dict[str, Any]]
    #: The whole answer.
    data: dict[str, Any] = field(repr=False)
    #: The new twin.
    twin: str


@dataclass(frozen=True)
class Comparison:
    """The error of a twin against measurements. `data` is the whole answer (`gripgen.comparison/1`)."""

    #: Root of the mean squared error of the labels, N; None for presses.
    rmse_n: float | None
    #: Mean of predicted less measured, N.
    bias_n: float | None
    data: dict[str, Any] = field(repr=False)


def diagnose(
    measured: _Path,
    *,
    twin: _Path | None = None,
    out: _Path | None = None,
    report: _Path | None = None,
    set: Mapping[str, Any] | None = None,
    force: bool = False,
) -> Diagnosis:
    """Find what the twin cannot explain of measured pulls, force-sensor tables or presses.

    `out` is the twin to write, `report` the HTML page; files that exist are replaced with `force` only
    (docs/outputs.md). See docs/diagnosis.md.
    """
    more = (["--report", os.fspath(report)] if report else []) + (["--force"] if force else [])
    found = _verb(["diagnose"], measured, twin, out, set, more)
    return Diagnosis(
        verdict=found["verdict"],
        effects=found.get("effects", []),
        unknown=found.get("unknown", []),
        error=found.get("error"),
        data=found,
        twin=os.fspath(out) if out else None,
        report=os.fspath(report) if report else None,
    )


def calibrate(
    measured: _Path,
    out: _Path,
    *,
    twin: _Path | None = None,
    law: str | None = None,
    fit: Sequence[str] = (),
    set: Mapping[str, Any] | None = None,
    force: bool = False,
) -> Calibration:
    """Fit the baseline of a twin to measured pulls and write the new twin to `out`.

    `law="offset"` fits the paper's mu (a + b / F_G) for each part, `fit` names effects to fit beside the baseline. A
    file that exists is replaced with `force` only (docs/outputs.md).
    """
    more = (["--law", law] if law else []) + (["--fit", ",".join(fit)] if fit else [])
    more += ["--force"] if force else []
    found = _verb(["calibrate", "pulls"], measured, twin, out, set, more)
    return Calibration(baseline=found["baseline"], data=found, twin=os.fspath(out))


def compare(measured: _Path, *, twin: _Path | None = None, set: Mapping[str, Any] | None = None) -> Comparison:
    """The error of a twin against measurements; every prediction is an expected value, never a random draw."""
    found = _verb(["compare"], measured, twin, None, set, [])
    pulls = found.get("pulls", {})
    return Comparison(rmse_n=pulls.get("rmse_n"), bias_n=pulls.get("bias_n"), data=found)


def _verb(
    verb: list[str],
    measured: _Path,
    twin: _Path | None,
    out: _Path | None,
    overrides: Mapping[str, Any] | None,
    more: list[str],
) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        arguments = [*verb, os.fspath(measured), "--json", str(answer), "--quiet", *more]
        if twin is not None:
            arguments += ["--twin", os.fspath(twin)]
        if out is not None:
            arguments += ["--out", os.fspath(out)]
        for key, value in (overrides or {}).items():
            arguments += ["--set", f"{key}={value if isinstance(value, str) else json.dumps(value)}"]
        _core.run_verb(arguments)
        return json.loads(answer.read_text())
