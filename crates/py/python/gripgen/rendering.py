"""What a sensor sees of any mesh or surface, and what is read off its images."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from . import _core

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Rendered:
    """The image of something that is pressed in, without noise, and the surface of the gel that it shows."""

    #: uint8[H, W, 3].
    image: NDArray[np.uint8] = field(repr=False)
    #: float32[H, W]: how far the gel stands above its rest towards the camera, mm; 0 where nothing moves it.
    heights_mm: NDArray[np.float32] = field(repr=False)
    #: float32[H, W, 3]: unit normals of that surface: to the image's right, to its top, towards the camera.
    normals: NDArray[np.float32] = field(repr=False)
    #: bool[H, W]: where the gel follows what is pressed in.
    contact: NDArray[np.bool_] = field(repr=False)


def render(
    mesh_or_heights: str | os.PathLike[str] | ArrayLike,
    *,
    sensor: str | os.PathLike[str],
    depth_mm: float | None = None,
    x_px: float | None = None,
    y_px: float | None = None,
    rotation_deg: float = 0.0,
    scale_mm_per_unit: float | None = None,
    edge_radius_mm: float = 0.2,
) -> Rendered:
    """Press a mesh or a surface into a sensor and look at it.

    With the path of a mesh (STL, OBJ, PLY, GLB) it is `gripgen render`: the tip of the mesh points along its +z into the gel and
    travels `depth_mm` after its highest vertex touched; +x is the image's right, +y its top; `x_px`, `y_px` are the place of
    the mesh's origin (default: the middle of the image), `rotation_deg` turns it counter-clockwise. Its convex edges have the radius
    `edge_radius_mm`, that of printed ones unless it is given; 0 leaves them sharp.

    With an array (H, W), or a path of one (`.npy`), its values are how far the pressed surface stands above the gel at rest,
    in mm: above 0 it indents, `-inf` is no surface. `depth_mm` moves the whole surface until its highest point is so deep.

    `sensor` is a sensor file (`asset:sensors/gelsight_r15/sensor.npz` is a shipped one), `scale_mm_per_unit` the unit of mesh
    or heights: 1 unless it is given, 1000 of a GLB. Raises ConfigError where a file, a shape or a length cannot be.
    """
    source = mesh_or_heights
    if not isinstance(source, str | os.PathLike):
        source = np.asarray(source, dtype=np.float64)
    found = _core.render(
        source, os.fspath(sensor), depth_mm, x_px, y_px, rotation_deg, scale_mm_per_unit, edge_radius_mm
    )
    return Rendered(**found)


def dots(image: ArrayLike, rest: ArrayLike | None = None) -> NDArray[np.float64]:
    """Find the dark dots of a gel in an image (H, W, 3).

    Returns their centres in pixels, float64[N, 2]: column and row, counted from the centre of the first pixel, row by row. A centre is that of
    the light that the dot takes.

    With `rest`, the centres of an image without contact, it follows each of them: float64[len(rest), 2] in the order of `rest`, NaN where a
    dot is not seen. Dots are told apart as long as they move by less than half the distance to their neighbours.

    What is dark enough and large enough is a dot: a share of 0.22 less than the brightest channel around it, 20 to 220 px in an image 320 px
    wide. Raises ValueError for an image of another shape.
    """
    pixels = np.asarray(image, dtype=np.float32)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ValueError(f"the image has the shape {pixels.shape}, it must be (rows, columns, 3)")
    at_rest = None if rest is None else np.asarray(rest, dtype=np.float64).reshape(-1, 2)
    return _core.dots(pixels, at_rest)


def imprint_volume_mm3(
    images: ArrayLike, *, sensor: str | os.PathLike[str], rest: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Read the volume of the imprint in each image, mm³, for `force` and `imprints.csv`.

    `images` are uint8 (N, H, W, 3), or one (H, W, 3); `sensor` is the sensor file that was calibrated for them, `rest` an image without contact (that of the
    file without it). Returns float64[N]. Slopes are read from colours and integrated, as `calibrate imprints` does it; a change that the whole frame shares
    is taken for the exposure. On drawn balls of 6 to 30 mm
    the volume is 0.8 to 1.0 of the true one with `gelsight_taxim` and 1.0 to 1.5 with `gelsight_r15`, the most for the smallest ball.

    Raises ConfigError for a file that is no sensor, and for images of another size than the sensor's.
    """
    frames = np.asarray(images, dtype=np.uint8)
    if frames.ndim == 3:
        frames = frames[None]
    at_rest = None if rest is None else np.asarray(rest, dtype=np.uint8)
    for name, found, wanted in (("images", frames, 4), ("rest", at_rest, 3)):
        if found is not None and (found.ndim != wanted or found.shape[-1] != 3):
            raise ValueError(f"{name} has the shape {found.shape}, it must end with (rows, columns, 3)")
    return _core.imprint_volumes_mm3(frames, os.fspath(sensor), at_rest)
