//! The signature of every optics effect, against what its cause must do to an image.

use super::testing::*;
use crate::finish;
use crate::grid::Plane;
use crate::presses::{Circle, PressContact, PressScene, PressView};
use crate::render::Renderer;
use crate::testing::{assert_same_on_every_unit, bits};
use gripgen_twin::effects::LIBRARY;
use gripgen_twin::{Jaw, OpticsState};

const BALL: Scene = scene(Shape::Ball, [0.0, 0.0], 4.0, 0.0);
const RACK: Scene = scene(Shape::Rack, [-1.0, 0.5], 6.0, 0.0);
const NOTHING: Scene = scene(Shape::Nothing, [0.0, 0.0], 0.0, 0.0);

/// The stages of this module with neutral optics are the plain ones, bit for bit.
#[test]
fn neutral_optics_are_the_plain_pipeline_bit_for_bit() {
    let rig = rig();
    for scene in [BALL, RACK] {
        let imprint = rig.imprint(&scene, &OpticsState::default()).unwrap();
        let plain = rig.renderer().change(&imprint);
        for spec in LIBRARY.iter().filter(|spec| spec.optics.is_some()) {
            let neutral: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
            let state = state(spec.id, &neutral, &scene, Jaw::Right);
            assert!(state.is_neutral() && !state.changes_press(), "{}", spec.id);
            let bits = |planes: &[Plane; 3]| bits(planes.iter().flat_map(|p| &p.values));
            assert!(rig.imprint(&scene, &state).unwrap() == imprint, "{}", spec.id);
            assert!(bits(&rig.change(&scene, &state)) == bits(&plain), "{}", spec.id);
        }
    }
    assert!(rig.change(&NOTHING, &OpticsState::default()).iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
}

/// Every corner of every effect's bounds gives a finite image.
#[test]
fn images_stay_finite_at_the_bounds() {
    let rig = rig();
    for spec in LIBRARY.iter().filter(|spec| spec.optics.is_some()) {
        for low in [true, false] {
            for flip in 0..=spec.parameters.len() {
                let end = |(i, p): (usize, &gripgen_twin::effects::ParameterSpec)| {
                    if (i == flip) != low { p.bounds.0 } else { p.bounds.1 }
                };
                let corner: Vec<f64> = spec.parameters.iter().enumerate().map(end).collect();
                let scene = Scene { hours: 2.0, ..RACK };
                let image = rig.with(&scene, spec.id, &corner);
                let finite = image.iter().all(|p| p.values.iter().all(|v| v.is_finite()));
                assert!(finite, "{} at {corner:?}", spec.id);
            }
        }
    }
}

/// All effects at once, on every vector unit.
#[test]
fn every_vector_path_gives_the_same_bits() {
    let rig = rig();
    let optics = OpticsState {
        light_gain: [0.9, 1.0, 1.1],
        background: [[3.0, -2.0, 1.0, 0.5, 2.0]; 3],
        gamma: 1.1,
        shift_m: [3e-4, -2e-4],
        rotation_rad: 0.03,
        distortion_k1: 0.02,
        defocus_m: 2e-4,
        kernel_scale: 1.2,
        part_offset_m: 1e-4,
        edge_blunting_m: 2e-4,
        shadow_strength: 0.3,
        dome_sag_m: 5e-4,
        ..Default::default()
    };
    let imprint = rig.imprint(&RACK, &optics).unwrap();
    assert_same_on_every_unit("change", |level| {
        let change = Renderer { level, ..rig.renderer() }.change_seen(Some(&imprint), &optics);
        bits(change.iter().flat_map(|p| &p.values))
    });
}

/// `light_drift`: image over first image is one number per channel, everywhere, and it grows in proportion to the time.
#[test]
fn light_drift_is_a_constant_ratio_that_grows_with_time() {
    let rig = rig();
    let rates = [0.02, -0.01, 0.03];
    for scene in [BALL, NOTHING] {
        let first = rig.with(&scene, "light_drift", &rates);
        assert_eq!(first, rig.change(&scene, &OpticsState::default()), "nothing at time 0");
        for hours in [0.5, 1.0, 4.0] {
            let later = rig.with(&Scene { hours, ..scene }, "light_drift", &rates);
            for c in 0..3 {
                for i in 0..GRID.len() {
                    let (before, after) = (
                        rig.sensor.rest[c][i] + first[c].values[i],
                        rig.sensor.rest[c][i] + later[c].values[i],
                    );
                    let ratio = f64::from(after) / f64::from(before);
                    assert!((ratio - 1.0 - rates[c] * hours).abs() < 1e-4, "{c}: {ratio}");
                }
            }
        }
    }
}

/// `background_change`: the same pattern with and without contact, without mean, and none before its pull.
#[test]
fn background_change_is_one_pattern_whatever_touches_the_gel() {
    let rig = rig();
    let terms = spec("background_change").parameters.len() - 1;
    let mut parameters: Vec<f64> = (0..terms).map(|i| 6.0 - (i % 13) as f64).collect();
    parameters.push(20.0);
    let from = |scene: Scene, pull_index| {
        rig.signature(&Scene { pull_index, ..scene }, "background_change", &parameters)
    };
    assert!(from(BALL, 19).iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
    let (ball, nothing) = (from(BALL, 20), from(NOTHING, 2000));
    for c in 0..3 {
        assert!(rms(&[difference(&ball[c], &nothing[c])]) < 1e-4);
        let mean = ball[c].values.iter().map(|&v| f64::from(v)).sum::<f64>() / GRID.len() as f64;
        assert!(mean.abs() < 1e-4 && rms(&ball[c..=c]) > 1.0);
    }
}

/// `misregistration`: to first order the image changes by shift times gradient, a dipole; the rest frame does not move.
#[test]
fn misregistration_leaves_a_dipole_of_shift_times_gradient() {
    let rig = rig();
    let plain = rig.change(&BALL, &OpticsState::default());
    let of = |shift_mm: f64| rig.signature(&BALL, "misregistration", &[shift_mm, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let shift_mm = 0.03;
    let (left, right) = (of(-shift_mm), of(shift_mm));
    let shift_px = (shift_mm * 1e-3 / GRID.metres_per_px) as f32;
    for c in 0..3 {
        let (mut error, mut size) = (0.0, 0.0);
        for y in 0..GRID.height_px {
            for x in 1..GRID.width_px - 1 {
                let i = y * GRID.width_px + x;
                let gradient = 0.5 * (plain[c].values[i + 1] - plain[c].values[i - 1]);
                let dipole = 0.5 * (right[c].values[i] - left[c].values[i]);
                error += f64::from(dipole + shift_px * gradient).powi(2);
                size += f64::from(shift_px * gradient).powi(2);
            }
        }
        assert!((error / size).sqrt() < 0.1, "{}", (error / size).sqrt());
        let sum: f64 = right[c].values.iter().map(|&v| f64::from(v)).sum();
        let each: f64 = right[c].values.iter().map(|&v| f64::from(v.abs())).sum();
        assert!(sum.abs() < 0.05 * each, "both lobes weigh the same: {sum} of {each}");
    }
    // The other camera sees the part from the other side.
    let right_jaw = state("misregistration", &[shift_mm, 0.0, 0.0, 1.0, 0.0, 0.0], &BALL, Jaw::Right);
    let seen = rig.change(&BALL, &right_jaw);
    assert!(rms(&[difference(&difference(&seen[0], &plain[0]), &left[0])]) < 1e-5);
    let still = rig.signature(&NOTHING, "misregistration", &[1.0, 0.5, 3.0, 1.05, 0.05, 0.0]);
    assert!(still.iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
    // A camera that was moved sees its own frame elsewhere, too.
    let moved = state("misregistration", &[0.3, 0.0, 0.0, 1.0, 0.0, 1.0], &NOTHING, Jaw::Left);
    let seen = rig.change(&NOTHING, &moved);
    let shift_px = (3e-4 / GRID.metres_per_px).round() as usize;
    assert!((3e-4 / GRID.metres_per_px - shift_px as f64).abs() < 1e-9, "a whole number of pixels");
    for c in 0..3 {
        let rest = &rig.sensor.rest[c];
        for i in (0..GRID.len())
            .filter(|i| i % GRID.width_px > shift_px + 1 && i % GRID.width_px + 2 < GRID.width_px)
        {
            assert!((rest[i] + seen[c].values[i] - rest[i - shift_px]).abs() < 1e-3);
        }
    }
    // A ball in the middle of the image only sees the shift; turned about itself it stays.
    let turned = rig.signature(&BALL, "misregistration", &[0.0, 0.0, 5.0, 1.0, 0.0, 0.0]);
    assert!(rms(&turned) < 0.05 * rms(&plain), "{} of {}", rms(&turned), rms(&plain));
}

/// Fits look at the pixels of the frames that are drawn, under every effect: nothing is forgotten and nothing is there twice.
#[test]
fn the_pixels_of_a_press_are_those_of_its_frame() {
    let rig = rig();
    let scene = PressScene::new(&rig.sensor, 4e-3);
    let press = PressContact::of_circle(Circle { x_px: 83.0, y_px: 55.0, radius_px: 9.0 });
    let plain = scene.change_seen(Some(&press), &OpticsState::default());
    let view =
        PressView::draw(0, &finish(&rig.sensor, Some(&plain), None), Some(press.clone()), &scene, &scene);
    for spec in LIBRARY.iter().filter(|spec| spec.presses.is_some()) {
        let parameters: Vec<f64> =
            spec.parameters.iter().map(|p| p.neutral + 0.2 * (p.bounds.1.min(20.0) - p.neutral)).collect();
        let optics = state(spec.id, &parameters, &BALL, Jaw::Left);
        let frame = scene.change_seen(Some(&press), &optics);
        let levels = view.levels(&scene, &view.contact(&scene, &optics, None), &optics);
        for (place, level) in view.places(&scene).iter().zip(&levels) {
            let at = |place: f64, n: usize| (((place + 1.0) * n as f64 - 1.0) / 2.0).round() as usize;
            let pixel = at(place[1], GRID.height_px) * GRID.width_px + at(place[0], GRID.width_px);
            for c in 0..3 {
                let drawn = (rig.sensor.rest[c][pixel] + frame[c].values[pixel]).clamp(0.0, 255.0);
                assert!((drawn - level[c]).abs() < 2e-3, "{}: {drawn} in the frame, {}", spec.id, level[c]);
            }
        }
    }
}

/// `exposure`: a new level is a function of the old level alone, the same for all channels and with or without contact.
#[test]
fn exposure_is_one_curve_for_all_pixels_and_channels() {
    let rig = rig();
    let curve = |level: f64| 255.0 * (0.9 * level / 255.0).powf(1.15);
    for scene in [BALL, NOTHING] {
        let before = rig.change(&scene, &OpticsState::default());
        let after = rig.with(&scene, "exposure", &[0.9, 1.15]);
        for c in 0..3 {
            for i in 0..GRID.len() {
                let rest = rig.sensor.rest[c][i];
                let expected = curve(f64::from((rest + before[c].values[i]).max(0.0)));
                assert!((f64::from(rest + after[c].values[i]) - expected).abs() < 1e-3);
            }
        }
    }
}

/// `defocus`: edges soften, the mean of the change stays, its variance about a centre grows by sigma^2, and the rest frame
/// is as sharp as before.
#[test]
fn defocus_softens_edges_and_keeps_the_mean() {
    let rig = rig();
    let sigma_mm = 0.5;
    let sharp = rig.change(&BALL, &OpticsState::default());
    let soft = rig.with(&BALL, "defocus", &[sigma_mm]);
    let steepest =
        |p: &Plane| (1..GRID.len()).map(|i| (p.values[i] - p.values[i - 1]).abs()).fold(0f32, f32::max);
    let moments = |p: &Plane| {
        let (mut mass, mut along, mut second) = (0.0, 0.0, 0.0);
        for (i, &value) in p.values.iter().enumerate() {
            let (x, _) = GRID.centre_m(i % GRID.width_px, i / GRID.width_px);
            mass += f64::from(value);
            along += f64::from(value) * x * 1e3;
            second += f64::from(value) * x * x * 1e6;
        }
        (mass, along, second)
    };
    for c in 0..3 {
        let (a, b) = (steepest(&soft[c]), steepest(&sharp[c]));
        assert!(a < 0.75 * b, "{a} and {b}");
        let (a, b) = (moments(&sharp[c]), moments(&soft[c]));
        let scale = sharp[c].values.iter().map(|v| f64::from(v.abs())).sum::<f64>();
        assert!((a.0 - b.0).abs() < 1e-3 * scale && (a.1 - b.1).abs() < 1e-3 * scale);
        assert!((b.2 - a.2 - sigma_mm * sigma_mm * a.0).abs() < 2e-3 * scale);
    }
    let rest = rig.signature(&NOTHING, "defocus", &[sigma_mm]);
    assert!(rest.iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
}

/// `gel_kernel`: nothing changes deep inside the contact or far away; the residual is a ring around the imprint that
/// grows with the depth of the press.
#[test]
fn gel_kernel_leaves_a_ring_that_grows_with_the_press() {
    let rig = rig();
    let mut last = 0.0;
    for force_n in [1.0, 2.0, 4.0, 8.0] {
        let scene = Scene { force_n, ..BALL };
        let imprint = rig.imprint(&scene, &OpticsState::default()).unwrap();
        let depth_mm = imprint.press_depth_m * 1e3;
        let contact_mm = (9.0 - (3.0 - depth_mm).powi(2)).sqrt();
        let change = rig.signature(&scene, "gel_kernel", &[1.3]);
        let size = |inside: &dyn Fn(f64) -> bool| {
            let at = pixels(|x, y| inside(x.hypot(y)));
            let sum: f64 =
                at.iter().flat_map(|&i| change.iter().map(move |p| f64::from(p.values[i]).powi(2))).sum();
            (sum / (3 * at.len()) as f64).sqrt()
        };
        let core = size(&|r| r < 0.5 * contact_mm);
        let ring = size(&|r| r > 0.8 * contact_mm && r < contact_mm + 2.0);
        let far = size(&|r| r > contact_mm + 5.5);
        assert!(ring > 10.0 * core && ring > 10.0 * far, "{force_n} N: {core} {ring} {far}");
        assert!(ring > 1.15 * last, "{force_n} N: {ring} after {last}");
        last = ring;
    }
}

/// `cad_mismatch`: the residual sits on the part: it moves with it, has the same sign at every force, and both jaws see it.
#[test]
fn cad_mismatch_is_locked_to_the_part() {
    let rig = rig();
    let parameters = [0.1, 0.2];
    let shift_px = 12;
    let moved = Scene { centre_mm: [RACK.centre_mm[0] + 1.8, RACK.centre_mm[1]], ..RACK };
    let size = |planes: &[Plane; 3]| rms(planes);
    let (here, there) = (
        rig.signature(&RACK, "cad_mismatch", &parameters),
        rig.signature(&moved, "cad_mismatch", &parameters),
    );
    let along = |a: &[Plane; 3], b: &[Plane; 3], shift: usize| {
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for c in 0..3 {
            for y in 0..GRID.height_px {
                for x in 0..GRID.width_px - shift {
                    let (p, q) = (f64::from(a[c].at(x, y)), f64::from(b[c].at(x + shift, y)));
                    ab += p * q;
                    aa += p * p;
                    bb += q * q;
                }
            }
        }
        ab / (aa * bb).sqrt()
    };
    assert!(size(&here) > 0.5);
    assert!(along(&here, &there, shift_px) > 0.97, "{}", along(&here, &there, shift_px));
    assert!(along(&here, &there, shift_px / 2) < 0.5);
    let harder = rig.signature(&Scene { force_n: 12.0, ..RACK }, "cad_mismatch", &parameters);
    assert!(along(&here, &harder, 0) > 0.7, "{}", along(&here, &harder, 0));
    let right = rig.change(&RACK, &state("cad_mismatch", &parameters, &RACK, Jaw::Right));
    assert_eq!(right, rig.with(&RACK, "cad_mismatch", &parameters));
}

/// `rest_offset`: one number per channel at every pixel of every image with contact, and none without.
#[test]
fn rest_offset_is_constant_inside_and_far_from_the_contact() {
    let rig = rig();
    for scene in [BALL, RACK] {
        let change = rig.signature(&scene, "rest_offset", &[3.0, -4.0, 5.5]);
        for (plane, offset) in change.iter().zip([3.0, -4.0, 5.5]) {
            assert!(plane.values.iter().all(|v| (v - offset).abs() < 1e-4));
        }
    }
    let rest = rig.signature(&NOTHING, "rest_offset", &[3.0, -4.0, 5.5]);
    assert!(rest.iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
}

/// `cast_shadow`: only darker, only outside the contact, only behind it as each channel's light sees it, and as long as
/// the height of the gel over the tangent of the light's elevation.
#[test]
fn cast_shadow_lies_behind_the_contact_and_is_as_long_as_the_light_is_low() {
    let rig = rig();
    let imprint = rig.imprint(&BALL, &OpticsState::default()).unwrap();
    let reach = |elevation_deg: f64| {
        let change = rig.signature(&BALL, "cast_shadow", &[0.5, elevation_deg]);
        [30f64, 150.0, 270.0]
            .iter()
            .zip(&change)
            .map(|(azimuth_deg, plane)| {
                let light = [azimuth_deg.to_radians().cos(), azimuth_deg.to_radians().sin()];
                let mut furthest = 0.0f64;
                for (i, &value) in plane.values.iter().enumerate() {
                    let (x, y) = GRID.centre_m(i % GRID.width_px, i / GRID.width_px);
                    let along = (x * light[0] + y * light[1]) * 1e3;
                    assert!(value <= 0.0, "light is only taken");
                    assert!(value == 0.0 || imprint.depth_px.values[i] < 0.06, "the contact stays");
                    if value < -1.0 {
                        assert!(along < 0.3, "{azimuth_deg}: {along} mm towards the light");
                        furthest = furthest.max(-along);
                    }
                }
                furthest
            })
            .collect::<Vec<f64>>()
    };
    let (low, high) = (reach(12.0), reach(25.0));
    let depth_mm = imprint.press_depth_m * 1e3;
    let contact_mm = (9.0 - (3.0 - depth_mm).powi(2)).sqrt();
    for (low, high) in low.iter().zip(&high) {
        assert!(
            *high > contact_mm && *low > high + 0.5,
            "{low} and {high} mm, the contact has {contact_mm} mm"
        );
        // No ray longer than from the top of the press at half the light's slope.
        let longest = depth_mm / (0.5 * 12f64.to_radians().tan());
        assert!(*low < longest, "{low} of {longest} mm");
    }
}

/// `gel_dome`: a plate that pressed the whole gel evenly presses the middle; contact area shrinks and centres, the volume
/// of the imprint stays, and the colours of the rest frame stay.
#[test]
fn gel_dome_shrinks_and_centres_the_contact() {
    let rig = rig();
    let aside = Scene { shape: Shape::Rack, centre_mm: [2.0, 1.5], force_n: 2.0, ..RACK };
    let of = |sag_mm: f64| {
        let imprint = rig.imprint(&aside, &state("gel_dome", &[sag_mm], &aside, Jaw::Left)).unwrap();
        let (mut area, mut volume, mut distance) = (0.0, 0.0, 0.0);
        for (i, &depth) in imprint.depth_px.values.iter().enumerate() {
            let (x, y) = GRID.centre_m(i % GRID.width_px, i / GRID.width_px);
            let depth = f64::from(depth);
            area += if depth > 0.0 { 1.0 } else { 0.0 };
            volume += depth;
            distance += depth * x.hypot(y);
        }
        (area, volume, distance / volume)
    };
    let (flat, dome, more) = (of(0.0), of(1.0), of(2.0));
    assert!(dome.0 < 0.95 * flat.0 && more.0 < 0.95 * dome.0, "areas {} {} {}", flat.0, dome.0, more.0);
    assert!(dome.2 < 0.95 * flat.2 && more.2 < 0.95 * dome.2, "distances {} {} {}", flat.2, dome.2, more.2);
    assert!((dome.1 / flat.1 - 1.0).abs() < 1e-4, "one volume");
    assert!(of(-1.0).2 > 1.05 * flat.2, "a hollow gel is touched at its rim");
    let rest = rig.signature(&NOTHING, "gel_dome", &[1.0]);
    assert!(rest.iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
    // Outside the contact nothing is pressed, so nothing changes there.
    let change = rig.signature(&BALL, "gel_dome", &[1.0]);
    for i in pixels(|x, y| x.hypot(y) > 8.5) {
        assert!(change.iter().all(|p| p.values[i].abs() < 0.02), "{}", change[0].values[i]);
    }
}

/// A plane presses the middle of a domed gel flat: it has the slope and so the colours of a flat gel there, which differ
/// from those of the dome at rest by Lambert's law on the paraboloid's slope.
#[test]
fn a_dome_that_is_pressed_flat_has_the_colours_of_a_flat_gel() {
    let rig = rig();
    let scene = scene(Shape::Plane, [0.0; 2], 60.0, 0.0);
    let sag_mm = 1.0;
    let change = rig.with(&scene, "gel_dome", &[sag_mm]);
    let (x0, y0) = GRID.centre_m(GRID.width_px - 1, GRID.height_px - 1);
    // The camera is on the other side: the rest surface rises towards it outwards, z = sag r^2 / r_corner^2.
    let curvature = 2.0 * sag_mm * 1e-3 / (x0 * x0 + y0 * y0);
    let lights = [(30.0f64, [150.0, 18.0, 14.0]), (150.0, [16.0, 158.0, 24.0]), (270.0, [14.0, 26.0, 140.0])];
    for i in pixels(|x, y| x.hypot(y) < 3.0 && x.hypot(y) > 1.0) {
        let (x, y) = GRID.centre_m(i % GRID.width_px, i / GRID.width_px);
        let n = [-curvature * x, -curvature * y, 1.0];
        let length = (n[0] * n[0] + n[1] * n[1] + 1.0).sqrt();
        let half_width = GRID.width_px as f64 / 2.0 * GRID.metres_per_px;
        for c in 0..3 {
            let exact: f64 = lights
                .iter()
                .map(|(azimuth_deg, colour)| {
                    let a = azimuth_deg.to_radians();
                    let s = (x * a.cos() + y * a.sin()) / half_width;
                    let towards = [a.cos() * 0.66f64.cos(), a.sin() * 0.66f64.cos(), 0.66f64.sin()];
                    let facing: f64 = (0..3).map(|k| n[k] / length * towards[k]).sum();
                    colour[c] * (1.0 + 0.2 * s + 0.05 * s * s) * (towards[2] - facing)
                })
                .sum();
            let found = f64::from(change[c].values[i]);
            assert!((found - exact).abs() < 0.05 + 0.02 * exact.abs(), "({x}, {y}) {c}: {found} and {exact}");
        }
    }
}
