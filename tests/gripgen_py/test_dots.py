"""Dots on a gel, found in images."""

from pathlib import Path

import numpy as np
import pytest

import gripgen as gg

ROOT = Path(__file__).parents[2]
REAL = ROOT / "../shared/real/gelsight_mini_dots/session1"


def drawn(centres: np.ndarray, radius_px: float = 5.0) -> np.ndarray:
    """A frame whose light falls off to one side, with soft dots at the centres, sampled at 5 x 5 points of each pixel."""
    rows, columns = np.mgrid[:240, :320]
    light = np.stack([150 - 0.2 * columns, 120 + 0.1 * rows, 90 + 0.15 * columns], axis=-1)
    step = (np.arange(5) - 2) / 5
    cover = np.zeros((240, 320))
    for x, y in centres:
        top, left = max(int(y) - 8, 0), max(int(x) - 8, 0)
        here = np.s_[top : top + 18, left : left + 18]
        across = columns[here][..., None, None] + step - x
        down = rows[here][..., None, None] + step[:, None] - y
        cover[here] += (np.hypot(across, down) < radius_px).mean(axis=(2, 3))
    return (light * (1 - 0.7 * cover[..., None])).round().astype(np.uint8)


def grid(rng: np.random.Generator) -> np.ndarray:
    """63 dots, each somewhere in its pixel."""
    return np.array([(30 + 32 * i, 25 + 31 * j) for j in range(7) for i in range(9)]) + rng.uniform(-0.5, 0.5, (63, 2))


def test_dots_are_found_between_pixels_and_followed() -> None:
    rng = np.random.default_rng(5)
    at_rest = grid(rng)
    found = gg.dots(drawn(at_rest))
    assert found.shape == (63, 2)
    # Each is a dot that was drawn, to 0.1 px.
    nearest = np.linalg.norm(found[:, None] - at_rest[None], axis=2)
    assert sorted(nearest.argmin(axis=1)) == list(range(63)) and nearest.min(axis=1).max() < 0.1
    order = nearest.argmin(axis=1)
    by = rng.uniform(-8, 8, (63, 2))
    followed = gg.dots(drawn(at_rest + by), rest=found)
    assert np.abs(followed - (at_rest + by)[order]).max() < 0.1


def test_a_dot_that_is_gone_is_not_taken_for_its_neighbour() -> None:
    at_rest = grid(np.random.default_rng(6))
    found = gg.dots(drawn(at_rest))
    gone = np.delete(at_rest, 31, axis=0)
    followed = gg.dots(drawn(gone), rest=found)
    lost = np.isnan(followed[:, 0])
    assert lost.sum() == 1 and np.abs(found[lost] - at_rest[31]).max() < 0.1


def test_an_image_without_dots_has_none_and_a_plane_is_refused() -> None:
    assert gg.dots(drawn(np.zeros((0, 2)))).shape == (0, 2)
    with pytest.raises(ValueError, match=r"\(240, 320\)"):
        gg.dots(np.zeros((240, 320)))


def test_the_dots_of_a_shipped_sensor_are_where_its_file_says() -> None:
    file = ROOT / "assets/sensors/dots_generic/sensor.npz"
    with np.load(file) as sensor:
        found, said = gg.dots(sensor["rest_rgb"]), sensor["marker_px"]
    apart = np.linalg.norm(found[:, None] - said[None], axis=2)
    assert len(found) == 63 and apart.min(axis=1).max() < 0.3


def test_real_dots_are_found_and_none_is_lost() -> None:
    folder = REAL
    if not folder.is_dir():
        pytest.skip("the folder of shared measured data is not beside this checkout")
    picture = pytest.importorskip("PIL.Image")
    frame = lambda path: np.asarray(picture.open(path).convert("RGB"))
    at_rest = gg.dots(frame(folder / "rest.png"))
    assert len(at_rest) == 63
    for path in sorted(folder.glob("press-*.png")):
        followed = gg.dots(frame(path), rest=at_rest)
        assert not np.isnan(followed).any(), path.name
