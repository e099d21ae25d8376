use super::gel::FOLLOW;
use super::*;
use crate::convolve::Follow;
use crate::markers::{marker_displacements_by_surface, print_markers};
use crate::presses::compare::{gel_of, predict_contact};
use crate::presses::{
    BallSizeBy, Contact, Indenter, IndenterPose, Press, check_ball_size, compare_presses, find_circle,
};
use crate::render::Renderer;
use crate::sensor::Pyramid;
use crate::simd::SimdLevel;
use crate::testing::lights;
use gripgen_twin::TriMesh;
use nalgebra::Point3;
use samples::GelModel;
use std::sync::Arc;

const GRID: Grid = Grid { width_px: 128, height_px: 96, metres_per_px: 0.15e-3 };
const NOISE: f32 = 1.5;

/// A sensor that is not a regressor: three coloured lights, a gel of its own, a shaded frame with scratches.
fn truth() -> Sensor {
    let colours = [(0.0, [70.0, 5.0, 0.0]), (120.0, [0.0, 60.0, 8.0]), (240.0, [6.0, 0.0, 65.0])];
    let colour = ColourModel::Lambert(Box::new(lights(0.5, [0.15, 0.0], &colours)));
    let rest = [0, 1, 2].map(|c| {
        let pixel = |i: usize| {
            let (x, y) = (i % GRID.width_px, i / GRID.width_px);
            let scratch = if (x + 3 * y) % 31 == 0 { 8.0 } else { 0.0 };
            90.0 + 0.2 * x as f32 - 0.15 * y as f32 + 10.0 * c as f32 + scratch
        };
        (0..GRID.len()).map(pixel).collect()
    });
    let pyramid = Pyramid {
        kernels_px: vec![13, 9, 5],
        restore_depth_fraction: 0.3,
        sink_in_fraction: 0.0,
        follow: Follow::Exactly,
    };
    Sensor { pyramid: Some(pyramid), ..Sensor::new(GRID, rest, [NOISE; 3], colour) }
}

/// Presses of a 4 mm ball all over the frame.
fn presses(sensor: &Sensor, count: usize) -> PressSet {
    let press = |i: usize| {
        // A low-discrepancy sequence (Roberts 2018).
        let spread = |a: f64, n: usize| 14.0 + (n as f64 - 28.0) * ((i + 1) as f64 * a).fract();
        let circle = Circle {
            x_px: spread(0.754_877_666, GRID.width_px),
            y_px: spread(0.569_840_291, GRID.height_px),
            radius_px: 9.0 + (i % 4) as f64,
        };
        Press::of_ball(i.to_string(), noisy(sensor, &circle, i as u64), Some(circle))
    };
    PressSet {
        metres_per_px: GRID.metres_per_px,
        ball_m: 4e-3,
        rest: None,
        presses: (0..count).map(press).collect(),
    }
}

fn noisy(sensor: &Sensor, circle: &Circle, key: u64) -> TactileImage {
    noisy_contact(sensor, &Contact::of_circle(*circle), key)
}

fn noisy_contact(sensor: &Sensor, contact: &Contact, key: u64) -> TactileImage {
    let clean = predict_contact(contact, 4e-3, sensor);
    let exact = Sensor { noise_rgb: [0.0; 3], ..sensor.clone() };
    assert_eq!(clean, predict_contact(contact, 4e-3, &exact), "predictions carry no noise");
    // The noise of the renderer, on the predicted image as the frame at rest.
    let rest = [0, 1, 2].map(|c| clean.rgb.iter().skip(c).step_by(3).map(|&v| f32::from(v)).collect());
    crate::finish(&Sensor { rest, ..sensor.clone() }, None, Some(key))
}

#[test]
fn a_sensor_is_found_again_from_its_presses() {
    let truth = truth();
    let set = presses(&truth, 16);
    let found = calibrate_presses(&set, &CalibrateOptions { folds: Some(3), ..Default::default() }).unwrap();
    // Two roundings beside the noise: no prediction can be better than this.
    let floor = f64::from(NOISE * NOISE) + 2.0 / 12.0;
    let mse = found.held_out.mean.full.mse;
    println!("held out {mse:.2}, floor {floor:.2}");
    assert!(mse > 0.9 * floor && mse < 1.5 * floor, "held out {mse}, floor {floor}");
    assert_eq!(found.held_out.each.len(), 16);
    assert!(found.doubtful.is_empty());
    for c in 0..3 {
        let noise = found.sensor.noise_rgb[c];
        assert!((noise / NOISE - 1.0).abs() < 0.1, "noise {noise}");
        let error: f32 =
            found.sensor.rest[c].iter().zip(&truth.rest[c]).map(|(a, b)| (a - b) * (a - b)).sum();
        let rms = (error / GRID.len() as f32).sqrt();
        assert!(rms < 0.7, "rest frame off by {rms}");
    }
    // New places, and what a sensor file keeps of it.
    let fresh = PressSet { presses: presses(&truth, 23).presses.split_off(16), ..set };
    let scores = compare_presses(&fresh, &found.sensor).unwrap().mean;
    assert!(scores.full.mse < 1.5 * floor, "fresh presses {}", scores.full.mse);
    let read = Sensor::from_npz(&found.sensor.to_npz().unwrap().unwrap(), None, None).unwrap();
    assert_eq!(read, found.sensor);
    assert_eq!(compare_presses(&fresh, &read).unwrap().mean, scores);
}

/// Dots that each press drags along hide a tenth of the gel: the fit outside of them is as good as without any.
#[test]
fn a_sensor_is_found_through_dots() {
    let plain = truth();
    let grid = plain.grid;
    let markers = Markers::regular(&grid, 8, 6, 15.0, 2.4, [0.6, 0.7, 0.7]);
    let mut rest = plain.rest.clone();
    print_markers(&mut rest, &grid, &markers);
    let truth = Sensor { markers: Some(markers.clone()), rest, ..plain };
    let mut set = presses(&truth, 16);
    for (i, press) in set.presses.iter_mut().enumerate() {
        let contact = Contact::of_circle(press.circle.unwrap());
        let gel = gel_of(&truth);
        let renderer = Renderer { sensor: &truth, gel: &gel, level: SimdLevel::best() };
        let imprint = contact.imprint(set.ball_m, &grid, &GelShape::Flat, 0.0);
        let shear = [0.8 * (i as f64).sin(), 0.8 * (i as f64).cos()];
        let surface = renderer.surface(&imprint);
        let moved = marker_displacements_by_surface(&surface, grid.metres_per_px, shear, &markers.rest_px);
        let mut change = renderer.unmarked_change(&imprint);
        renderer.draw_moved(&moved, &mut change);
        press.image = crate::finish(&truth, Some(&change), Some(i as u64));
    }
    set.rest = Some(crate::finish(&truth, None, Some(99)));
    let options = CalibrateOptions { folds: Some(3), gel_shape: Some(GelShape::Flat) };
    let found = calibrate_presses(&set, &options).unwrap();
    let floor = f64::from(NOISE * NOISE) + 2.0 / 12.0;
    let [frame, _, contact, in_contact] = &found.held_out.by_dots[..] else { panic!("{:?}", found.held_out) };
    println!(
        "frame {:.2}, contact {:.2}, in dots {:.2}; floor {floor:.2}",
        frame.2.mse, contact.2.mse, in_contact.2.mse
    );
    assert!(frame.2.mse < 1.5 * floor && contact.2.mse < 4.0 * floor, "{frame:?} {contact:?}");
    assert!(in_contact.2.mse > contact.2.mse, "{in_contact:?}");
    let dots = found.sensor.markers.unwrap();
    assert_eq!(dots.rest_px.len(), 48);
    assert!((dots.radius_px - 2.4).abs() < 0.3, "{}", dots.radius_px);
    assert!(found.sensor.noise_rgb.iter().all(|noise| (noise / NOISE - 1.0).abs() < 0.15));
}

/// Balls given too large or too small by a half draw a tip of known slopes in the wrong colours.
#[test]
fn a_wrong_diameter_shows_in_a_body_of_known_slopes() {
    let gel = Pyramid {
        kernels_px: vec![27, 13, 7, 3],
        restore_depth_fraction: 0.4,
        sink_in_fraction: 0.4,
        follow: FOLLOW,
    };
    let truth = Sensor { pyramid: Some(gel), ..truth() };
    let mut set = presses(&truth, 14);
    for (i, press) in set.presses.iter_mut().enumerate() {
        // Shallow enough for a ball of two thirds.
        let mut circle = press.circle.unwrap();
        circle.radius_px -= 4.0;
        (press.image, press.circle) = (noisy(&truth, &circle, i as u64), Some(circle));
    }
    let at = |x: f64, y: f64, z: f64| Point3::new(x * 1e-3, y * 1e-3, z * 1e-3);
    let corners = vec![at(0.0, 0.0, 3.0), at(-4.0, -4.0, 1.0), at(4.0, -4.0, 1.0), at(0.0, 5.0, 1.0)];
    let tip = TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]).unwrap();
    for (i, (x_px, y_px)) in [(40.0, 50.0), (80.0, 40.0), (64.0, 60.0)].into_iter().enumerate() {
        let place = IndenterPose { x_px, y_px, rotation_rad: i as f64 };
        let indenter = Indenter::of_mesh("tip", &tip, place, (0.4 + 0.2 * i as f64) * 1e-3, &GRID).unwrap();
        let blank = TactileImage { width_px: 128, height_px: 96, rgb: vec![] };
        let mut press = Press::of_body(format!("tip {i}"), blank, Arc::new(indenter));
        press.image = noisy_contact(&truth, &Contact::of_press(&press, press.circle.unwrap()), 90 + i as u64);
        set.presses.push(press);
    }
    let options = CalibrateOptions { folds: Some(2), gel_shape: Some(GelShape::Flat) };
    let calibration = calibrate_presses(&set, &options).unwrap();
    for given in [1.0, 1.5, 1.0 / 1.5] {
        // Of a calibration it takes nothing that depends on the ball.
        let set = PressSet { ball_m: given * set.ball_m, ..set.clone() };
        let size = check_ball_size(&set, &calibration).unwrap();
        println!("given {given:.2}: {size:?}");
        assert!(size.tells() && size.by == BallSizeBy::Shapes, "{size:?}");
        assert!((size.factor * given).ln().abs() < 0.15, "given {given}: {size:?}");
        assert_eq!(size.is_wrong(), given != 1.0, "given {given}: {size:?}");
    }
    // Balls alone, and one body, say nothing.
    for presses in [14, 15] {
        let few = PressSet { presses: set.presses[..presses].to_vec(), ..set.clone() };
        assert_eq!(check_ball_size(&few, &calibration), None);
    }
}

#[test]
fn the_same_presses_give_the_same_sensor() {
    let set = presses(&truth(), 6);
    let options = CalibrateOptions { folds: Some(2), gel_shape: Some(GelShape::Flat) };
    assert_eq!(calibrate_presses(&set, &options).unwrap(), calibrate_presses(&set, &options).unwrap());
}

#[test]
fn contacts_that_nobody_marked_are_found() {
    let mut set = presses(&truth(), 12);
    let marked: Vec<Circle> = set.presses.iter().filter_map(|p| p.circle).collect();
    set.presses.iter_mut().for_each(|p| p.circle = None);
    assert_eq!(set.mark_missing(), 12);
    let off = |of: fn(&Circle, &Circle) -> f64| {
        let found = set.presses.iter().filter_map(|p| p.circle);
        let mut all: Vec<f64> = found.zip(&marked).map(|(a, b)| of(&a, b)).collect();
        all.sort_by(f64::total_cmp);
        (all[6], all[11])
    };
    let centre = off(|a, b| (a.x_px - b.x_px).hypot(a.y_px - b.y_px));
    let radius = off(|a, b| (a.radius_px - b.radius_px).abs());
    println!("median and worst: centre {centre:?} px, radius {radius:?} px");
    assert!(centre.0 < 0.5 && centre.1 < 1.5, "centre off by {centre:?} px");
    assert!(radius.0 < 1.0 && radius.1 < 2.0, "radius off by {radius:?} px");
    // Where there is no contact there is no circle.
    let truth = truth();
    let empty = crate::finish(&truth, None, Some(7));
    assert_eq!(find_circle(&empty, &truth.rest, 13.3), None);
}

#[test]
fn a_press_marked_in_the_wrong_place_is_left_out() {
    let mut set = presses(&truth(), 12);
    let circle = set.presses[5].circle.as_mut().unwrap();
    (circle.x_px, circle.y_px) = (127.0 - circle.x_px, 95.0 - circle.y_px);
    let found =
        calibrate_presses(&set, &CalibrateOptions { folds: Some(2), gel_shape: Some(GelShape::Flat) })
            .unwrap();
    assert_eq!(found.doubtful, ["5"]);
    let error = |i: usize| found.held_out.each[i].scores.full.mse;
    assert!(error(5) > 3.0 * error(4), "it is still scored, as marked: {} and {}", error(5), error(4));
}

#[test]
fn sets_that_cannot_be_are_refused_with_both_numbers() {
    let good = presses(&truth(), 4);
    let error = |edit: &dyn Fn(&mut PressSet)| {
        let mut set = good.clone();
        edit(&mut set);
        calibrate_presses(&set, &CalibrateOptions::default()).unwrap_err().to_string()
    };
    let circle = |set: &mut PressSet, x_px: f64, radius_px: f64| {
        set.presses[2].circle = Some(Circle { x_px, y_px: 40.0, radius_px });
    };
    let small = TactileImage { width_px: 20, height_px: 10, rgb: vec![0; 600] };
    for (text, wanted) in [
        (error(&|s| s.presses.truncate(3)), "3 presses, a calibration needs at least 4"),
        (error(&|s| circle(s, 130.0, 9.0)), "press `2`: the centre (130, 40) lies outside the 128x96 image"),
        (error(&|s| circle(s, f64::NAN, 9.0)), "outside the 128x96 image"),
        (error(&|s| circle(s, 60.0, 20.0)), "press `2`: the radius is 3.000 mm, the ball's 2.000 mm"),
        (error(&|s| circle(s, 60.0, 0.0)), "the radius is 0.000 mm"),
        (error(&|s| s.presses[1].image = small.clone()), "press `1` is 20x10 pixels, the first one 128x96"),
        (error(&|s| s.rest = Some(small.clone())), "press `rest frame` is 20x10 pixels"),
        (error(&|s| s.ball_m = 4.0), "the ball is 4000 mm, it must be from 0.1 to 100 mm"),
        (error(&|s| s.metres_per_px = 0.0), "the side of a pixel is 0 mm"),
    ] {
        assert!(text.contains(wanted), "`{text}` lacks `{wanted}`");
    }
}

#[test]
fn a_modelled_change_is_taken_off_the_rest_frame() {
    let circle = Circle { x_px: 60.0, y_px: 50.0, radius_px: 11.0 };
    let grey = |value: u8| TactileImage { width_px: 128, height_px: 96, rgb: vec![value; 3 * GRID.len()] };
    let press = Press::of_ball("0", grey(107), Some(circle));
    let change = |_: usize| Some([0, 1, 2].map(|_| crate::Plane::filled(128, 96, 7.0)));
    let rest = rest_frame(&[(&press, Contact::of_circle(circle))], change, None, &GRID);
    assert!(rest.iter().flatten().all(|v| (v - 100.0).abs() < 1e-4));
    // Without a model the far pixels of one press outweigh the near ones of another.
    let other = Press::of_ball("1", grey(50), None);
    let far = Circle { x_px: 5.0, y_px: 5.0, radius_px: 11.0 };
    let rest = rest_frame(
        &[(&press, Contact::of_circle(circle)), (&other, Contact::of_circle(far))],
        |_| None,
        None,
        &GRID,
    );
    assert!((rest[0][50 * 128 + 60] - 50.0).abs() < 0.1);
    assert!((rest[0][5 * 128 + 5] - 107.0).abs() < 0.1);
}

#[test]
fn the_error_from_sums_is_the_error_over_pixels() {
    let truth = truth();
    let set = presses(&truth, 5);
    let marked: Vec<Marked<'_>> =
        set.presses.iter().filter_map(|p| Some((p, Contact::of_circle(p.circle?)))).collect();
    let gel = GelModel { shape: GelShape::Flat, pyramid: truth.pyramid.clone().unwrap() };
    let candidate = Candidate::new(gel, &marked, 4e-3, &GRID);
    let moments = candidate.coloured(&marked, &[0, 1, 2, 3, 4], &truth.rest);
    let mut seen = Moments::zero();
    moments[..4].iter().for_each(|m| seen.add(m));
    let solution = solve(&seen, &Smoothness::USUAL).unwrap();
    let (near, around) = solution.near_and_around();
    // The fifth press, feature by feature.
    let samples = &candidate.samples[4];
    let targets = samples.targets(marked[4].0, &truth.rest);
    let near_inputs = near.len() / 30;
    let (mut error, mut weights) = (0.0, 0.0);
    for (p, target) in targets.iter().enumerate() {
        let [u, v] = samples.places[p].map(f64::from);
        let field = [1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v];
        let inputs = &samples.inputs[p * samples::INPUTS..][..samples::INPUTS];
        for (c, target) in target.iter().enumerate() {
            let mut predicted = 0.0;
            for (i, &input) in inputs.iter().enumerate() {
                let coefficients = match i.checked_sub(near_inputs) {
                    None => &near[(c * near_inputs + i) * 10..][..10],
                    Some(f) => &around[(c * SURROUNDINGS + AROUND_FITTED[f]) * 6..][..6],
                };
                let value: f64 = coefficients.iter().zip(field).map(|(&k, m)| f64::from(k) * m).sum();
                predicted += value * f64::from(input);
            }
            error += f64::from(samples.weights[p]) * (predicted - f64::from(*target)).powi(2);
        }
        weights += 3.0 * f64::from(samples.weights[p]);
    }
    let (exact, ours) = (error / weights, solution.error_on(&moments[4]));
    assert!((ours - exact).abs() < 0.01 * exact, "{ours} against {exact}");
}

#[test]
fn images_without_any_contact_are_refused_and_marks_beside_it_are_counted() {
    let sensor = truth();
    let options = CalibrateOptions { folds: Some(2), gel_shape: Some(GelShape::Flat) };
    let mut grey = presses(&sensor, 6);
    grey.presses.iter_mut().for_each(|press| press.image.rgb.fill(90));
    assert_eq!(calibrate_presses(&grey, &options), Err(CalibrateError::Nothing));
    // Half of the marks on the other side of the image.
    let mut mirrored = presses(&sensor, 12);
    for press in mirrored.presses.iter_mut().step_by(2) {
        let circle = press.circle.as_mut().unwrap();
        circle.x_px = 127.0 - circle.x_px;
        circle.y_px = 95.0 - circle.y_px;
    }
    let found = calibrate_presses(&mirrored, &options).unwrap();
    assert!(found.doubtful.is_empty() && (4..=6).contains(&found.distrusted), "{}", found.distrusted);
}

/// Each press with gains of its own: they are found, divided out, and the image of a press that the fit has not seen has the gain
/// that its pixels away from the contact show.
#[test]
fn gains_of_presses_are_divided_out() {
    let gain = |i: usize| [0, 1, 2].map(|c| 1.0 + 0.12 * (((i * (5 + 2 * c) + c) % 11) as f64 / 10.0 - 0.5));
    let sensor = truth();
    let plain = presses(&sensor, 14);
    let mut taken = plain.clone();
    for (i, press) in taken.presses.iter_mut().enumerate() {
        press.image = super::super::gain::with_gain(&press.image, gain(i));
    }
    let error = |set: &PressSet| calibrate_presses(set, &CalibrateOptions::default()).unwrap();
    let (without, with) = (error(&plain), error(&taken));
    assert_eq!(without.sensor.press_gain_sd, None);
    let sd = with.sensor.press_gain_sd.expect("gains that scatter");
    assert!(sd.iter().all(|sd| (0.025..0.055).contains(sd)), "{sd:?}");
    let (before, after) = (without.held_out.mean.full.mse, with.held_out.mean.full.mse);
    assert!(after < 1.2 * before + 0.2, "{after}, without gains {before}");
}
