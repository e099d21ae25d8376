"""Single pulls on a twin."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core, checks

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

#: The shipped twin without effects.
BASELINE = "asset:configs/twin-baseline.toml"


@dataclass(frozen=True, eq=False)
class Pull:
    """What came out of a pull."""

    part: str
    grip_force_n: float
    seed: int
    index: int
    #: "slipped", "censored" (the label is a lower bound), "no_contact" (the label is 0), "failed" (there is none) or
    #: "suspect" (the trace contradicts the label; only with a trace).
    status: str
    #: The pull force at slip, N; NaN if the sample failed.
    max_pull_force_n: float = float("nan")
    slip_time_s: float = float("nan")
    #: Largest mean reading over 20 ms while the jaws held, and the median from 0.2 to 1 mm past its place, N; NaN where there is none.
    peak_force_n: float = float("nan")
    kinetic_force_n: float = float("nan")
    #: "static", "early" (before the slip, off the peak by more than the tolerance) or "kinetic": where the label was read; "" if not known.
    label_branch: str = ""
    #: What both jaws held, without noise and label rule, N; when the first part of the contact slid, and all of it, s.
    limit_force_n: float = float("nan")
    slip_onset_s: float = float("nan")
    slip_s: float = float("nan")
    #: Friction coefficient of the part as drawn for this grip, and the one that acted after friction laws and contact.
    mu_drawn: float = float("nan")
    mu_effective: float = float("nan")
    #: A friction law was used outside the forces on which it was fitted.
    outside_fit: bool = False
    #: Why a sample failed.
    failure: str = ""
    #: Why a label is suspect.
    status_reason: str = ""
    #: uint8[2, H, W, 3], left jaw first; None where they were not asked for.
    images: NDArray[np.uint8] | None = field(default=None, repr=False)
    #: float64[T] each; None where the trace was not asked for.
    time_s: NDArray[np.float64] | None = field(default=None, repr=False)
    desired_force_n: NDArray[np.float64] | None = field(default=None, repr=False)
    measured_force_n: NDArray[np.float64] | None = field(default=None, repr=False)
    displacement_mm: NDArray[np.float64] | None = field(default=None, repr=False)

    def plot(self) -> Figure:
        """Both images, and the pull curve with the point of slip. Needs matplotlib."""
        try:
            from matplotlib.figure import Figure
        except ImportError as e:
            raise checks.needs("Pull.plot()", "matplotlib", "plot") from e
        figure = Figure(figsize=(9, 3), layout="constrained")
        axes = figure.subplots(1, 3, width_ratios=[1, 1, 1.4])
        for axis, name, image in zip(axes, ("left", "right"), self.images if self.images is not None else ()):
            axis.imshow(image)
            axis.set_title(name)
        axes[0].set_axis_off()
        axes[1].set_axis_off()
        if self.time_s is not None:
            axes[2].plot(self.time_s, self.desired_force_n, label="desired")
            axes[2].plot(self.time_s, self.measured_force_n, label="measured")
            if self.status == "slipped":
                axes[2].plot([self.slip_time_s], [self.max_pull_force_n], "ko", label="slip")
            axes[2].legend()
        axes[2].set_xlabel("time, s")
        axes[2].set_ylabel("pull force, N")
        figure.suptitle(f"{self.part}, {self.grip_force_n:g} N: {self.max_pull_force_n:.2f} N ({self.status})")
        return figure


class Sim:
    """A twin to ask for pulls.

    `twin` is a twin file (default: the shipped baseline), `set` overrides any key of it (`{"parts.gear.mu": 0.2}`)
    or of the pull (`{"pull.increment_n": 0.5}`), `mechanics` is "reduced" or "rapier". Threads may share it.

    Raises ConfigError where a file or a key cannot be.
    """

    def __init__(
        self,
        twin: str | os.PathLike[str] = BASELINE,
        *,
        mechanics: str = "reduced",
        images: bool = True,
        set: Mapping[str, Any] | None = None,
    ) -> None:
        self._arguments = (checks.absolute(twin), dict(set or {}), mechanics, images)
        self._core = _core.Simulator(*self._arguments)
        self._images = images

    def __reduce__(self) -> tuple[Any, ...]:
        twin, overrides, mechanics, images = self._arguments
        return (_sim, (twin, overrides, mechanics, images))

    def __repr__(self) -> str:
        return f"gripgen.Sim({self._arguments[0]!r}, parts: {', '.join(self.parts)})"

    @property
    def parts(self) -> list[str]:
        """Names of the twin's parts."""
        return self._core.parts

    def pull(
        self,
        *,
        seed: int = 0,
        index: int = 0,
        images: bool | None = None,
        trace: bool = True,
        set: Mapping[str, Any] | None = None,
        mu: float | None = None,
        **values: float | str,
    ) -> Pull:
        """Grip and pull once.

        Keywords are the keys of a sweep: `part`, `grip_force_n` (of one jaw), `grip_pose`, `grip_offset_mm`,
        `grip_angle_deg`, `dwell_s`, `temperature_c`, `pull_index`, ...; `set` holds keys of the twin or the pull
        (`{"effects.wear.depth": 0.2}`), `mu` is short for the friction coefficient of the part. `seed` and `index`
        draw scatter and noise: the same ones give the same pull, bit for bit.
        """
        asked = dict(values) | dict(set or {})
        if mu is not None:
            part = asked.get("part") or (self.parts[0] if len(self.parts) == 1 else None)
            if part is None:
                hint = f"part={self.parts[0]!r} says which one is pulled"
                raise checks.refusal("mu is the friction of a part", hint)
            asked[f"parts.{part}.mu"] = mu
        return self.pulls([asked], seed=seed, first_index=index, images=images, trace=trace)[0]

    def pulls(
        self,
        asked: Iterable[Mapping[str, float | str]],
        *,
        seed: int = 0,
        first_index: int = 0,
        images: bool | None = None,
        trace: bool = True,
        threads: int | None = None,
    ) -> list[Pull]:
        """Many pulls in one call, shared by `threads` (all cores if None); pull i has the index `first_index + i`.

        Ctrl-C ends it after the pulls under way. The KeyboardInterrupt has those that were made as its attribute `pulls`, with
        their indices: the same call makes the same ones again.
        """
        with_images = self._images if images is None else images
        if with_images and not self._images:
            raise checks.refusal("this Sim was made without images", "Sim(..., images=True)")
        threads = os.cpu_count() or 1 if threads is None else threads
        try:
            found = self._core.pulls(
                [dict(values) for values in asked], seed, first_index, with_images, trace, threads
            )
        except KeyboardInterrupt as e:
            e.pulls = [Pull(**values) for values in getattr(e, "made", ())]  # type: ignore[attr-defined]
            raise
        return [Pull(**values) for values in found]


def _sim(twin: str, overrides: dict[str, Any], mechanics: str, images: bool) -> Sim:
    return Sim(twin, mechanics=mechanics, images=images, set=overrides)
