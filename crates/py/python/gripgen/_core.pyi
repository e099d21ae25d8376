"""The Rust half of gripgen. Use it through the package: names here may change."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ConfigError",
    "DataError",
    "Dataset",
    "GripgenError",
    "Pulls",
    "Simulator",
    "Stream",
    "__version__",
    "contact_sheet_shards",
    "dots",
    "imprint_volumes_mm3",
    "prepare_run",
    "render",
    "rig_check",
    "rig_pull",
    "rig_rehearse",
    "run_cli",
    "run_verb",
    "sweep",
    "ur5e_tool_m",
]

__version__: str

class GripgenError(Exception):
    """What gripgen could not do; `hint` says what to do about it."""

    hint: str | None

class ConfigError(GripgenError):
    """A configuration, a key or an argument that cannot be."""

class DataError(GripgenError):
    """Data that cannot be read; the message names the file."""

@final
class Dataset:
    """Rows of simulated or measured pulls, opened for reading. Threads may share it."""

    def __new__(cls, path: str | os.PathLike[str]) -> Dataset: ...
    def __len__(self) -> int: ...
    @property
    def image_size_px(self) -> tuple[int, int] | None: ...
    @property
    def info(self) -> dict[str, str]: ...
    def columns(self) -> dict[str, NDArray[np.float64] | list[str]]: ...
    def roles(self) -> dict[str, str]: ...
    @property
    def clean_images(self) -> bool: ...
    def images(
        self, rows: Sequence[int], threads: int = 1, noise: str = "stored", pass_: int = 0
    ) -> NDArray[np.uint8]: ...
    def traces(self, rows: Sequence[int]) -> tuple[NDArray[np.float32], NDArray[np.int64]]: ...
    def forces(self, rows: Sequence[int]) -> NDArray[np.float32]: ...
    def heights(self, rows: Sequence[int], threads: int = 1) -> NDArray[np.float32]: ...
    @property
    def has_films(self) -> bool: ...
    def film(self, row: int) -> dict[str, Any] | None: ...

@final
class Stream:
    """A sweep that is read while it is made. One reader at a time."""

    def __new__(
        cls,
        config: str,
        overrides: Mapping[str, Any] | None = None,
        first: int = 0,
        every: int = 1,
        jobs: int = 1,
        ahead: int = 64,
        status: Sequence[str] | None = None,
        films: bool = False,
    ) -> Stream: ...
    @property
    def info(self) -> dict[str, Any]: ...
    @property
    def image_size_px(self) -> tuple[int, int] | None: ...
    def batch(
        self, size: int, columns: Sequence[str]
    ) -> tuple[NDArray[np.uint8] | None, NDArray[np.float32], dict[str, Any], list[dict[str, Any] | None] | None, int]: ...

@final
class Simulator:
    """A twin with its files, ready to pull. Threads may share it."""

    def __new__(
        cls,
        twin: str,
        overrides: Mapping[str, Any] | None = None,
        mechanics: str = "reduced",
        images: bool = True,
    ) -> Simulator: ...
    @property
    def parts(self) -> list[str]: ...
    @property
    def image_size_px(self) -> tuple[int, int]: ...
    def pulls(
        self,
        asked: Sequence[Mapping[str, float | str]],
        seed: int = 0,
        first_index: int = 0,
        images: bool = True,
        trace: bool = True,
        threads: int = 1,
    ) -> list[dict[str, Any]]: ...

@final
class Pulls:
    """Pulls under way, each in a place of its own."""

    def __new__(cls, simulator: Simulator, places: int) -> Pulls: ...
    def start(
        self, place: int, values: Mapping[str, float | str], seed: int, index: int, images: bool = True
    ) -> NDArray[np.uint8] | None: ...
    def step(
        self,
        commands: NDArray[np.float64],
        duration_s: float,
        speeds: bool = False,
        threads: int = 1,
        waits: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]: ...
    def result(self, place: int) -> dict[str, Any]: ...

def run_cli(arguments: Sequence[str]) -> int: ...
def run_verb(arguments: Sequence[str]) -> int: ...
def dots(image: NDArray[np.float32], rest: NDArray[np.float64] | None = None) -> NDArray[np.float64]: ...
def imprint_volumes_mm3(
    images: NDArray[np.uint8], sensor: str, rest: NDArray[np.uint8] | None = None
) -> NDArray[np.float64]: ...
def render(
    source: str | os.PathLike[str] | NDArray[np.float64],
    sensor: str,
    depth_mm: float | None = None,
    x_px: float | None = None,
    y_px: float | None = None,
    rotation_deg: float = 0.0,
    scale_mm_per_unit: float | None = None,
    edge_radius_mm: float | None = None,
) -> dict[str, Any]: ...
def rig_check(
    config: str,
    overrides: Mapping[str, Any] | None = None,
    rehearsal: str | os.PathLike[str] | None = None,
) -> list[tuple[str, bool, str]]: ...
def rig_rehearse(
    config: str,
    overrides: Mapping[str, Any] | None = None,
    part: str | None = None,
    grip_force_n: float = 30.0,
    dwell_s: float = 5.0,
    on_event: Callable[[dict[str, Any]], object] | None = None,
) -> str: ...
def rig_pull(
    config: str,
    out: str | os.PathLike[str],
    overrides: Mapping[str, Any] | None,
    campaign: str | os.PathLike[str] | None,
    parts: Sequence[str],
    grip_force_n: Sequence[float],
    repetitions: int,
    seed: int,
    rehearsal: str | os.PathLike[str] | None,
    after: str | os.PathLike[str] | None,
    columns: Sequence[tuple[str, str]],
    power_on: bool,
    unlock: bool,
    reconnect: int,
    on_event: Callable[[dict[str, Any]], object] | None,
) -> dict[str, Any]: ...
def sweep(
    config: str | None,
    out: str | os.PathLike[str],
    overrides: Mapping[str, Any] | None = None,
    jobs: int = 1,
    slice: tuple[int, int] | None = None,
    on_progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]: ...
def prepare_run(
    config: str, out: str | os.PathLike[str], overrides: Mapping[str, Any] | None = None
) -> tuple[int, int]: ...
def contact_sheet_shards(out: str | os.PathLike[str]) -> list[int]: ...
def ur5e_tool_m(joints_rad: NDArray[np.float64]) -> NDArray[np.float64]: ...
