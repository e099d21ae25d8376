"""What a sensor sees of a mesh or a surface, from Python."""

import numpy as np
import pytest

import gripgen as gg

from .conftest import command_line

SENSOR = "asset:sensors/gelsight_synthetic/sensor.npz"


@pytest.fixture
def pyramid(tmp_path):
    """A pyramid that stands on its tip, 4 mm wide 2 mm above it."""
    path = tmp_path / "tip.obj"
    path.write_text(
        "v 0 0 5\nv -2 -2 3\nv 2 -2 3\nv 0 2.5 3\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n", encoding="utf-8"
    )
    return path


def test_a_mesh_gives_what_the_command_line_writes(pyramid, tmp_path):
    image = pytest.importorskip("PIL.Image")
    out = {name: tmp_path / name for name in ("image.png", "heights.npy", "normals.npy", "mask.png")}
    placed = ["--x-px", 140, "--y-px", "100.5", "--rotation-deg", 30, "--scale-mm-per-unit", "0.5"]
    files = ["-o", out["image.png"], "--heights", out["heights.npy"], "--normals", out["normals.npy"]]
    files += ["--mask", out["mask.png"], "--quiet"]
    command_line("render", pyramid, "--depth-mm", "0.5", "--sensor", SENSOR, *placed, *files)
    seen = gg.render(
        pyramid, sensor=SENSOR, depth_mm=0.5, x_px=140, y_px=100.5, rotation_deg=30.0, scale_mm_per_unit=0.5
    )
    assert seen.image.dtype == np.uint8 and seen.image.shape == (240, 320, 3)
    assert (seen.image == np.asarray(image.open(out["image.png"]))).all()
    assert seen.heights_mm.dtype == np.float32 and (seen.heights_mm == np.load(out["heights.npy"])).all()
    assert seen.normals.dtype == np.float32 and (seen.normals == np.load(out["normals.npy"])).all()
    mask = np.asarray(image.open(out["mask.png"]))[..., 0] == 255
    assert seen.contact.dtype == bool and (seen.contact == mask).all() and seen.contact.any()
    middle = gg.render(str(pyramid), sensor=SENSOR, depth_mm=0.5)
    assert (middle.image != seen.image).any()


def test_heights_are_pressed_in_as_they_are_or_as_deep_as_asked(tmp_path):
    image = pytest.importorskip("PIL.Image")
    rows, columns = np.mgrid[:240, :320]
    # A ball of 3 mm, 0.4 mm below the gel at rest, off the middle. A pixel is 0.0877 mm.
    away_mm = 0.0877 * np.hypot(rows - 100, columns - 200)
    ball_mm = np.where(away_mm < 3.0, np.sqrt(np.maximum(9.0 - away_mm**2, 0.0)) - 2.6, -np.inf)
    seen = gg.render(ball_mm, sensor=SENSOR)
    at_rest = gg.render(np.full((240, 320), -0.1), sensor=SENSOR)
    assert at_rest.image.std(axis=(0, 1)).max() < seen.image.std(axis=(0, 1)).max()
    assert not at_rest.contact.any() and (at_rest.heights_mm == 0).all()
    assert abs(seen.heights_mm.max() - 0.4) < 0.02
    deepest = np.unravel_index(seen.heights_mm.argmax(), (240, 320))
    assert abs(deepest[0] - 100) <= 2 and abs(deepest[1] - 200) <= 2
    assert seen.contact[100, 200] and not seen.contact[100, 100]
    # Right of the ball the surface looks to the right, above it to the top.
    assert seen.normals[100, 215, 0] > 0.1 and seen.normals[85, 200, 1] > 0.1
    # The same from a file of another unit, from numbers of another type, and moved there by the depth.
    np.save(tmp_path / "ball.npy", ball_mm.astype(np.float32) * 1e3)
    scaled = ["--scale-mm-per-unit", "0.001", "-o", tmp_path / "ball.png", "--quiet"]
    command_line("render", tmp_path / "ball.npy", "--sensor", SENSOR, *scaled)
    off = np.asarray(image.open(tmp_path / "ball.png")).astype(int) - seen.image
    assert abs(off).max() <= 1
    moved = gg.render(ball_mm - 20.0, sensor=SENSOR, depth_mm=0.4)
    assert abs(moved.image.astype(int) - seen.image).max() <= 1
    assert (gg.render(np.zeros((240, 320), int), sensor=SENSOR, depth_mm=0.1).heights_mm > 0.05).all()


def test_what_cannot_be_rendered_says_why(pyramid, tmp_path):
    flat = np.zeros((240, 320))
    torn = flat.copy()
    torn[3, 5] = np.nan
    for source, keywords, message in [
        (flat.T, {}, r"the heights have the shape \[320, 240\], the sensor's image has \[240, 320\]"),
        (flat[0], {}, r"the shape \[320\]"),
        (torn, {}, "row 3, column 5 is no number"),
        (flat, {"depth_mm": 0.0}, "pressed in by 0 mm, it must be above 0 and at most 10 mm"),
        (flat + 11, {}, "pressed in by 11 mm"),
        (flat, {"x_px": 3.0}, "no place and no turn"),
        (flat, {"scale_mm_per_unit": 0.0}, "scale_mm_per_unit is 0 mm"),
        (pyramid, {}, "not said how far the mesh travels"),
        (pyramid, {"depth_mm": 50.0}, "travels 50 mm"),
        (tmp_path / "none.stl", {"depth_mm": 0.5}, "none.stl"),
    ]:
        with pytest.raises(gg.ConfigError, match=message):
            gg.render(source, sensor=SENSOR, **keywords)
    with pytest.raises(gg.ConfigError, match="none.npz") as e:
        gg.render(flat, sensor=tmp_path / "none.npz")
    assert "calibrate presses" in e.value.hint
