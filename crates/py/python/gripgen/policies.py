"""Policies for pulls: what to command next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Staircase:
    """The experiment's own policy: one increment more every step, from `start_n` (one increment) on.

    A policy is any `callable(observation) -> action`; this one reads the time from the observation, so it serves single
    and vector environments alike.
    """

    increment_n: float = 1.0
    step_s: float = 0.104
    start_n: float | None = None

    def __call__(self, observation: Mapping[str, Any]) -> np.ndarray:
        """Desired pull force, N: float32[1], or float32[N, 1] for a vector environment."""
        time_s = np.asarray(observation["force"])[..., 2:3].astype(np.float64)
        steps = np.floor(time_s / self.step_s + 1e-4) + 1.0
        start_n = self.increment_n if self.start_n is None else self.start_n
        return (start_n + (steps - 1.0) * self.increment_n).astype(np.float32)
