"""Gymnasium environments: one pull is one episode."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _core, checks

try:
    import gymnasium as gym
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as e:
    raise checks.needs("gripgen.envs", "gymnasium", "gym") from e

from .simulation import BASELINE, Sim

#: What an episode draws: a number or word stays, a list is chosen from, a pair `(low, high)` is uniform.
Vary = Mapping[str, float | str | Sequence[Any]]

#: Time between two commands: the mean step of Wucherer et al. 2023.
STEP_S = 0.104

#: No pull of this rig goes further: N, mm, s.
_FORCE_BOUNDS = np.array([4000.0, 1000.0, 4000.0], dtype=np.float32)


def register() -> None:
    """Make `gym.make("gripgen/Pull-v0")` known; `import gripgen` does it."""
    if "gripgen/Pull-v0" not in gym.registry:
        gym.register(
            "gripgen/Pull-v0",
            entry_point="gripgen.envs:PullEnv",
            vector_entry_point="gripgen.envs:PullVectorEnv",
        )


class _Task:
    """What single and vector environments share: spaces, draws, and what a step is worth."""

    def __init__(
        self,
        twin: str | os.PathLike[str],
        part: str | Sequence[str] | None,
        vary: Vary | None,
        command: str,
        step_s: float,
        max_force_n: float,
        max_speed_mm_s: float,
        mechanics: str,
        images: bool,
        set: Mapping[str, Any] | None,
    ) -> None:
        self.sim = Sim(twin, mechanics=mechanics, images=images, set=set)
        if command not in ("force", "speed"):
            raise checks.refusal(f"command = {command!r} is neither 'force' nor 'speed'")
        self.speeds = command == "speed"
        self.step_s = step_s
        self.images = images
        parts = self.sim.parts if part is None else [part] if isinstance(part, str) else list(part)
        self.vary: dict[str, Any] = {"part": parts, "grip_force_n": (20.0, 80.0)} | dict(vary or {})
        spaces: dict[str, gym.Space[Any]] = {
            "force": gym.spaces.Box(-_FORCE_BOUNDS, _FORCE_BOUNDS, dtype=np.float32),
        }
        if images:
            width, height = self.sim._core.image_size_px
            spaces["tactile"] = gym.spaces.Box(0, 255, (2, height, width, 3), np.uint8)
        self.observation_space = gym.spaces.Dict(spaces)
        low, high = (-max_speed_mm_s, max_speed_mm_s) if self.speeds else (0.0, max_force_n)
        self.action_space = gym.spaces.Box(low, high, (1,), np.float32)

    def draw(self, rng: np.random.Generator) -> tuple[dict[str, float | str], int]:
        """Values of an episode, and its seed for scatter and noise."""
        values: dict[str, float | str] = {}
        for key, of in sorted(self.vary.items()):
            if isinstance(of, (str, int, float)):
                values[key] = of
            elif isinstance(of, tuple) and len(of) == 2:
                values[key] = float(rng.uniform(*of))
            else:
                chosen = of[int(rng.integers(len(of)))]
                values[key] = chosen if isinstance(chosen, str) else float(chosen)
        return values, int(rng.integers(2**53))


class PullEnv(gym.Env[dict[str, np.ndarray], np.ndarray]):
    """One pull of a gripped part.

    Observation: `force` float32[3] = measured pull force (N), displacement (mm), time (s); `tactile`
    uint8[2, H, W, 3], both images of the grip, which stay while the arm pulls (left out with `images=False`).
    Action: float32[1], the desired pull force in N (`command="force"`) or the speed in mm/s (`command="speed"`), held
    for `step_s`. Reward: by how much the largest measured force so far has grown, N; a return is the force that the
    grip held. Terminated when the jaws have slid beyond the displacement stop, truncated at `pull.max_time_s`; then `info` holds
    `max_pull_force_n` (by the label rule for force commands) and `status`.

    `vary` draws each episode, `part` is one name or a list, `set` overrides keys of the twin.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        twin: str | os.PathLike[str] = BASELINE,
        *,
        part: str | Sequence[str] | None = None,
        vary: Vary | None = None,
        command: str = "force",
        step_s: float = STEP_S,
        max_force_n: float = 200.0,
        max_speed_mm_s: float = 20.0,
        mechanics: str = "reduced",
        images: bool = True,
        set: Mapping[str, Any] | None = None,
    ) -> None:
        self._task = _Task(
            twin, part, vary, command, step_s, max_force_n, max_speed_mm_s, mechanics, images, set
        )
        self.observation_space = self._task.observation_space
        self.action_space = self._task.action_space
        self._pulls = _core.Pulls(self._task.sim._core, 1)
        self._tactile: np.ndarray | None = None
        self._held_n = 0.0

    def _observation(self, force: tuple[float, float, float]) -> dict[str, np.ndarray]:
        observation = {"force": np.array(force, dtype=np.float32)}
        if self._tactile is not None:
            observation["tactile"] = self._tactile.copy()
        return observation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Grip anew. `options` are values that are not drawn: `{"part": "gear", "grip_force_n": 40.0}`."""
        super().reset(seed=seed)
        values, draw = self._task.draw(self.np_random)
        values |= options or {}
        self._tactile = self._pulls.start(0, values, draw, 0, self._task.images)
        self._held_n = 0.0
        return self._observation((0.0, 0.0, 0.0)), {"values": values}

    def step(
        self, action: np.ndarray
    ) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Command the arm for one step."""
        command = np.asarray(action, dtype=np.float64).reshape(1)
        time_s, force_n, moved_mm, slid, over, late = self._pulls.step(
            command, self._task.step_s, self._task.speeds
        )[0]
        reward = max(0.0, force_n - self._held_n)
        self._held_n += reward
        info: dict[str, Any] = {"slid": bool(slid)}
        if over or late:
            result = self._pulls.result(0)
            info |= {"max_pull_force_n": result["max_pull_force_n"], "status": result["status"]}
        return self._observation((force_n, moved_mm, time_s)), reward, bool(over), bool(late and not over), info


class PullVectorEnv(VectorEnv[dict[str, np.ndarray], np.ndarray, np.ndarray]):
    """Several pulls stepped in one call: see `PullEnv`. A place that ended grips anew at its next step.

    With `copy=False` the observations of a step are overwritten by the next.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(
        self,
        num_envs: int = 1,
        twin: str | os.PathLike[str] = BASELINE,
        *,
        part: str | Sequence[str] | None = None,
        vary: Vary | None = None,
        command: str = "force",
        step_s: float = STEP_S,
        max_force_n: float = 200.0,
        max_speed_mm_s: float = 20.0,
        mechanics: str = "reduced",
        images: bool = True,
        set: Mapping[str, Any] | None = None,
        threads: int | None = None,
        copy: bool = True,
    ) -> None:
        self._task = _Task(
            twin, part, vary, command, step_s, max_force_n, max_speed_mm_s, mechanics, images, set
        )
        self.num_envs = num_envs
        self.single_observation_space = self._task.observation_space
        self.single_action_space = self._task.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._pulls = _core.Pulls(self._task.sim._core, num_envs)
        self._threads = os.cpu_count() or 1 if threads is None else threads
        self._copy = copy
        self._rngs: list[np.random.Generator] = []
        self._held_n = np.zeros(num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._seen = {
            name: np.zeros((num_envs, *space.shape), dtype=space.dtype)
            for name, space in self.single_observation_space.spaces.items()
        }

    def _start(self, place: int, options: Mapping[str, Any]) -> None:
        values, draw = self._task.draw(self._rngs[place])
        tactile = self._pulls.start(place, values | dict(options), draw, 0, self._task.images)
        if tactile is not None:
            self._seen["tactile"][place] = tactile
        self._seen["force"][place] = 0.0
        self._held_n[place] = 0.0
        self._ended[place] = False

    def _observations(self) -> dict[str, np.ndarray]:
        return {name: seen.copy() for name, seen in self._seen.items()} if self._copy else dict(self._seen)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Grip anew everywhere; place i has the seed `seed + i`."""
        if seed is None and not self._rngs:
            self._rngs = [np.random.default_rng() for _ in range(self.num_envs)]
        elif seed is not None:
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
            self._rngs = [np.random.default_rng(s) for s in seeds]
        for place in range(self.num_envs):
            self._start(place, options or {})
        return self._observations(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Command all arms for one step."""
        commands = np.asarray(actions, dtype=np.float64).reshape(self.num_envs)
        fresh = self._ended.copy()
        for place in np.flatnonzero(fresh):
            self._start(int(place), {})
        # A place that gripped anew waits for its first command.
        moved = self._pulls.step(commands, self._task.step_s, self._task.speeds, self._threads, fresh)
        force_n = moved[:, 1]
        rewards = np.where(fresh, 0.0, np.maximum(0.0, force_n - self._held_n))
        self._held_n += rewards
        over = (moved[:, 4] > 0.0) & ~fresh
        late = (moved[:, 5] > 0.0) & ~over & ~fresh
        self._ended = over | late
        self._seen["force"][:, 0] = force_n
        self._seen["force"][:, 1] = moved[:, 2]
        self._seen["force"][:, 2] = moved[:, 0]
        info: dict[str, Any] = {"slid": moved[:, 3] > 0.0}
        if self._ended.any():
            label = np.full(self.num_envs, np.nan)
            status = np.full(self.num_envs, "", dtype=object)
            for place in np.flatnonzero(self._ended):
                result = self._pulls.result(int(place))
                label[place], status[place] = result["max_pull_force_n"], result["status"]
            info |= {
                "max_pull_force_n": label,
                "_max_pull_force_n": self._ended.copy(),
                "status": status,
                "_status": self._ended.copy(),
            }
        return self._observations(), rewards, over, late, info
