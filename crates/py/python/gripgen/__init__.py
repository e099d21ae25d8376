"""gripgen: a digital twin of grip, pull and slip with tactile images.

    import gripgen as gg

    gg.sweep("sweep.toml", "runs/first")             # the bytes of `gripgen sweep`
    ds = gg.load("runs/first")                       # random access; simulated and measured runs alike
    images, labels = ds.batch([3, 1, 9])             # uint8[3, 2, 240, 320, 3], float32[3]
    for images, labels in gg.stream("sweep.toml"):   # the same batches without a disk
        ...
    pull = gg.Sim().pull(part="gear", grip_force_n=40.0, seed=1)

Units stand in the names: `_n` newton, `_mm` millimetre, `_s` second, `_deg` degree. Grip forces are those of one jaw.
"""

from importlib.util import find_spec as _find_spec

from . import rig
from ._core import ConfigError, DataError, GripgenError, __version__
from .bags import BagSummary, read_bag
from .dataset import Batch, Dataset, Sample, load
from .films import Film
from .forces import Force, ForceScale, force, force_scale
from .identify import Calibration, Comparison, Diagnosis, calibrate, compare, diagnose
from .policies import Staircase
from .rendering import Rendered, dots, imprint_volume_mm3, render
from .simulation import Pull, Sim
from .streams import FilmBatch, Stream, StreamBatch, stream
from .sweeps import SweepSummary, sweep

__all__ = [
    "BagSummary",
    "Batch",
    "Calibration",
    "Comparison",
    "ConfigError",
    "DataError",
    "Dataset",
    "Diagnosis",
    "Film",
    "FilmBatch",
    "Force",
    "ForceScale",
    "GripgenError",
    "Pull",
    "Rendered",
    "Sample",
    "Sim",
    "Staircase",
    "Stream",
    "StreamBatch",
    "SweepSummary",
    "__version__",
    "calibrate",
    "compare",
    "diagnose",
    "dots",
    "force",
    "force_scale",
    "imprint_volume_mm3",
    "load",
    "read_bag",
    "render",
    "rig",
    "stream",
    "sweep",
]


def __getattr__(name: str) -> object:
    # `gg.ray` and `gg.torch` need packages that not everybody has: they are imported when they are asked for.
    if name in ("ray", "torch"):
        from importlib import import_module

        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


if _find_spec("gymnasium") is not None:
    from .envs import register as _register

    _register()
