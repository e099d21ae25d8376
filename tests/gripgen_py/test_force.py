"""The force of a grip, read off its imprint."""

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import gripgen as gg

ROOT = Path(__file__).parents[2]
REAL = ROOT / "../shared/real/grasp_force_wedge"
GOLF_A = ["231206_golf_ball_1", "231206_golf_ball_2"]
GOLF_B = ["231216_golf_ball_0", "231216_golf_ball_1"]
RIGID = ["231216_rigid_strawberry_0", "231216_rigid_strawberry_1"]
SOFT = ["231216_green_ball_softer_0", "231216_orange_ball_softest_0", "231216_purple_ball_hardest_0"]
real = pytest.mark.skipif(not REAL.is_dir(), reason="the folder of shared measured data is not next to this checkout")


def layer(depth_mm: np.ndarray, n_per_mm3: float, mm_per_px: float) -> tuple[float, float, float]:
    """Volume, area and force of a body that sinks into springs, one under each pixel."""
    pressed = np.maximum(depth_mm, 0.0)
    pressure_n_per_mm2 = n_per_mm3 * pressed
    return pressed.sum() * mm_per_px**2, (pressed > 0).sum() * mm_per_px**2, pressure_n_per_mm2.sum() * mm_per_px**2


def test_a_layer_gives_the_force_of_any_shape() -> None:
    y, x = np.mgrid[-12:12:0.1, -16:16:0.1]
    ball = layer(2.0 - (x**2 + y**2) / 40, 0.05, 0.1)
    scale = gg.force_scale([ball[0]], [ball[1]], [ball[2]])
    assert scale.n_per_mm3 == pytest.approx(0.05) and scale.grasps == 1
    for shape in (1.0 - np.abs(x) / 4, 0.7 - x**2 / 10 - y**2 / 200, np.where(np.hypot(x, y) < 5, 1.5, -1.0)):
        volume, area, truth_n = layer(shape, 0.05, 0.1)
        found = gg.force(volume, area, scale)
        assert found.force_n == pytest.approx(truth_n) and found.low_n < truth_n < found.high_n


def hertz(radius_mm: float, contact_mm: float, modulus_mpa: float = 1.0) -> tuple[float, float, float]:
    """Volume inside the contact, its area, and the force of a ball on a half-space."""
    depth_mm = contact_mm**2 / radius_mm
    return 0.75 * np.pi * contact_mm**2 * depth_mm, np.pi * contact_mm**2, 4 / 3 * modulus_mpa * contact_mm**3 / radius_mm


def punch(depth_mm: float, contact_mm: float, modulus_mpa: float = 1.0) -> tuple[float, float, float]:
    """The same of a flat round punch."""
    return np.pi * contact_mm**2 * depth_mm, np.pi * contact_mm**2, 2 * modulus_mpa * contact_mm * depth_mm


def test_a_thick_gel_stays_in_the_interval_where_the_area_is_known() -> None:
    volume, area, force_n = hertz(20.0, 10.0)
    scale = gg.force_scale([volume], [area], [force_n])
    for volume, area, truth_n in (hertz(20, 4), hertz(3, 4), hertz(60, 14), punch(0.5, 4), punch(0.3, 12)):
        found = gg.force(volume, area, scale)
        assert found.low_n < truth_n < found.high_n
    small = hertz(3.0, 4.0)
    assert gg.force(small[0], scale=scale).high_n < small[2], "without the area a small contact is not known to be one"


def test_the_interval_holds_nine_of_ten_grasps_of_its_own_model() -> None:
    rng = np.random.default_rng(11)
    n = 4000
    log_scale = lambda: rng.normal(0, 0.20, n) + rng.normal(0, 0.14, n)
    for gel, references in ((rng.normal(0, 0.40, n), 0), (rng.normal(0, 0.40, n), 1)):
        known = np.log(0.0787) + gel + log_scale()
        truth_n = 400 * np.exp(np.log(0.0787) + gel + log_scale() + rng.normal(0, 0.15, n))
        inside = 0
        for reference, force_n in zip(known, truth_n, strict=True):
            scale = gg.force_scale([400.0], [358.0], [400 * np.exp(reference)]) if references else None
            found = gg.force(400.0, 358.0, scale)
            inside += found.low_n <= force_n <= found.high_n
        # The noise of the volume, 2 mm3 of 400, widens it by little.
        assert 0.88 < inside / n < 0.94, (references, inside / n)


def test_it_grows_with_the_volume_and_the_interval_holds_it() -> None:
    rng = np.random.default_rng(3)
    volume = np.sort(rng.uniform(-5, 600, 200))
    for area in (None, rng.uniform(0, 600, 200), 300.0):
        found = gg.force(volume, area)
        assert found.force_n.shape == found.low_n.shape == found.high_n.shape == (200,)
        assert (found.low_n <= found.force_n).all() and (found.force_n <= found.high_n).all()
        assert (found.low_n >= 0).all() and (np.diff(found.force_n) >= 0).all() and (found.force_n[volume <= 0] == 0).all()
    # The area moves the interval alone, the more the farther it is from that of the scale.
    ratio = [float(gg.force(200.0, area).high_n / gg.force(200.0, area).low_n) for area in (358, 200, 100, 50)]
    assert ratio == sorted(ratio) and len(set(gg.force([200] * 3, [358, 100, 900]).force_n)) == 1


def test_a_reference_takes_the_unit_of_the_volume_out_and_narrows_the_interval() -> None:
    rng = np.random.default_rng(4)
    volume, known = rng.uniform(150, 300, 40), rng.uniform(12, 24, 40)
    ours, theirs = gg.force_scale(volume, None, known), gg.force_scale(2.5 * volume, None, known)
    assert gg.force(500.0, scale=theirs).force_n == pytest.approx(gg.force(200.0, scale=ours).force_n)
    two = gg.force_scale(volume, None, known, grasp=["first"] * 20 + ["second"] * 20)
    wide = [(f := gg.force(200.0, 358.0, scale)).high_n / f.low_n for scale in (None, ours, two)]
    assert two.grasps == 2 and wide[0] > 1.02 * wide[1] > 1.04 * wide[2]
    assert gg.ForceScale(**json.loads(json.dumps(dataclasses.asdict(two)))) == two
    # Rows on the way up, whose readings are late, do not count.
    late = gg.force_scale([100.0, 150.0, 180.0, 200.0, 200.0], None, [2.0, 3.0, 5.0, 20.0, 20.0])
    assert late.n_per_mm3 == pytest.approx(0.1)


def test_volumes_are_read_off_images() -> None:
    sensor = "asset:sensors/gelsight_taxim/sensor.npz"
    with np.load(ROOT / "assets" / sensor.removeprefix("asset:")) as file:
        mm_per_px, rest = float(file["mm_per_px"]), np.rint(file["rest_rgb"]).astype(np.uint8)
    y, x = (np.mgrid[:240, :320] - np.array([120.0, 160.0])[:, None, None]) * mm_per_px
    caps = []
    images = []
    for depth_mm, radius_mm in ((0.4, 6.0), (0.8, 6.0), (0.6, 10.0)):
        ball = np.sqrt(np.maximum(radius_mm**2 - x**2 - y**2, 0.0)) - radius_mm + depth_mm
        heights = np.where(x**2 + y**2 < radius_mm**2, ball, -np.inf)
        images.append(gg.render(heights, sensor=sensor).image)
        caps.append(np.maximum(ball, 0.0).sum() * mm_per_px**2)
    found = gg.imprint_volume_mm3(np.stack(images), sensor=sensor)
    assert np.abs(found / caps - 1).max() < 0.25, (found, caps)
    assert gg.imprint_volume_mm3(images[1], sensor=sensor, rest=rest) == pytest.approx(found[1], rel=0.05)
    assert abs(gg.imprint_volume_mm3(rest, sensor=sensor)[0]) < 1.0, "nothing touches"
    with pytest.raises(ValueError, match=r"\(240, 320\)"):
        gg.imprint_volume_mm3(np.zeros((240, 320)), sensor=sensor)
    with pytest.raises(gg.ConfigError, match="100x80"):
        gg.imprint_volume_mm3(np.zeros((80, 100, 3)), sensor=sensor)


def test_what_is_no_imprint_is_refused() -> None:
    with pytest.raises(ValueError, match="volume_mm3"):
        gg.force([1.0, np.nan])
    with pytest.raises(ValueError, match="negative"):
        gg.force([100.0], [-1.0])
    with pytest.raises(ValueError, match="2.5 N"):
        gg.force_scale([100.0], None, [2.5])
    with pytest.raises(ValueError, match="noise"):
        gg.force_scale([1.0], None, [20.0])
    with pytest.raises(ValueError, match="shape"):
        gg.force_scale([100.0, 110.0], None, [20.0])
    with pytest.raises(ValueError, match="no reference"):
        gg.force_scale([], None, [])


def grasp(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Volume, area and force of each frame."""
    with open(REAL / f"{name}.csv") as file:
        rows = list(csv.DictReader(file))
    return tuple(np.array([float(row[key]) for row in rows]) for key in ("volume_mm3", "contact_area_mm2", "force_n"))


def judged(name: str, scale: gg.ForceScale | None) -> tuple[float, float]:
    """Of one grasp, over its frames of 5 to 43 N: the median relative error, and the share of frames in the 90 % interval."""
    volume, area, truth_n = grasp(name)
    counts = (truth_n >= 5) & (truth_n <= 43)
    found = gg.force(volume[counts], area[counts], scale)
    inside = (found.low_n <= truth_n[counts]) & (truth_n[counts] <= found.high_n)
    return float(np.median(np.abs(found.force_n / truth_n[counts] - 1))), float(inside.mean())


@real
def test_the_prior_is_that_of_the_golf_ball() -> None:
    by_gel = [np.mean([np.log(gg.force_scale(*grasp(name)).n_per_mm3) for name in names]) for names in (GOLF_A, GOLF_B)]
    assert gg.force(1.0).scale.n_per_mm3 == pytest.approx(np.exp(np.mean(by_gel)), rel=0.005)
    areas = [np.log(gg.force_scale(*grasp(name)).area_mm2) for name in GOLF_A + GOLF_B]
    assert gg.force(1.0).scale.area_mm2 == pytest.approx(np.exp(np.mean(areas)), rel=0.005)


@real
def test_real_grasps_of_the_reference_body_are_right_to_a_fifth() -> None:
    errors = []
    for names in (GOLF_A, GOLF_B):
        for known, new in (names, names[::-1]):
            error, share = judged(new, gg.force_scale(*grasp(known)))
            errors.append(error)
            assert share > 0.5, new
    assert np.median(errors) < 0.20, errors


@real
def test_real_grasps_of_other_bodies_are_as_far_off_as_the_documentation_says() -> None:
    scale = gg.force_scale(*grasp(GOLF_B[0]))
    rigid = [judged(name, scale) for name in RIGID]
    assert max(error for error, _ in rigid) < 0.45 and min(share for _, share in rigid) > 0.5, rigid
    # Soft balls leave less volume: the estimate is too low.
    for name in SOFT:
        volume, area, truth_n = grasp(name)
        held = truth_n >= truth_n.max() / 2
        assert np.median(gg.force(volume[held], area[held], scale).force_n / truth_n[held]) < 0.65, name
