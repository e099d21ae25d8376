use super::*;
use crate::colour::ColourModel;
use crate::convolve::Follow;
use crate::grid::Grid;
use crate::presses::compare::predict_contact;
use crate::sensor::Pyramid;
use crate::testing::lights;
use gripgen_twin::TactileImage;

const GRID: Grid = Grid { width_px: 160, height_px: 120, metres_per_px: 0.12e-3 };
const BALL_M: f64 = 4e-3;
const NOISE: f32 = 1.0;

/// Three coloured lights at a height, a gel that gives way by a share, a shaded frame with specks.
fn sensor(sink_in_fraction: f64) -> Sensor {
    let colours = [(0.0, [70.0, 5.0, 0.0]), (120.0, [0.0, 60.0, 8.0]), (240.0, [6.0, 0.0, 65.0])];
    let colour = ColourModel::Lambert(Box::new(lights(0.5, [0.15, 0.0], &colours)));
    let rest = [0, 1, 2].map(|c| {
        let pixel = |i: usize| {
            let (x, y) = ((i % GRID.width_px) as f32, (i / GRID.width_px) as f32);
            let speck =
                if (x as usize).is_multiple_of(23) && (y as usize).is_multiple_of(17) { -25.0 } else { 0.0 };
            95.0 + 0.2 * x * (c as f32 - 1.0) - 0.15 * y + 10.0 * c as f32 + speck
        };
        (0..GRID.len()).map(pixel).collect()
    });
    let pyramid = Pyramid {
        kernels_px: vec![33, 17, 9, 5],
        restore_depth_fraction: sink_in_fraction,
        sink_in_fraction,
        follow: Follow::Exactly,
    };
    Sensor { pyramid: Some(pyramid), ball_m: Some(BALL_M), ..Sensor::new(GRID, rest, [NOISE; 3], colour) }
}

fn circles() -> Vec<Circle> {
    let at = |(x_px, y_px, radius_px): (f64, f64, f64)| Circle { x_px, y_px, radius_px };
    [(45.0, 40.0, 11.0), (112.0, 36.0, 12.0), (80.0, 62.0, 10.0), (50.0, 86.0, 12.0), (115.0, 84.0, 11.0)]
        .map(at)
        .into()
}

/// Five presses with noise; `seen` makes an image and a mark of what the sensor draws.
fn day_of(
    sensor: &Sensor,
    ball_m: f64,
    seen: impl Fn(TactileImage, Circle) -> (TactileImage, Circle),
) -> PressSet {
    let press = |(i, circle): (usize, Circle)| {
        let clean = predict_contact(&Contact::of_circle(circle), ball_m, sensor);
        let rest = levels_of(&clean);
        let noisy = crate::finish(&Sensor { rest, ..sensor.clone() }, None, Some(i as u64 + 7));
        let (image, circle) = seen(noisy, circle);
        Press::of_ball(i.to_string(), image, Some(circle))
    };
    let presses = circles().into_iter().enumerate().map(press).collect();
    PressSet { metres_per_px: GRID.metres_per_px, ball_m: BALL_M, rest: None, presses }
}

fn as_it_is(image: TactileImage, circle: Circle) -> (TactileImage, Circle) {
    (image, circle)
}

fn number(found: &DayCheck, name: &str) -> f64 {
    found.numbers.iter().find(|n| n.name == name).map(|n| n.value).unwrap()
}

#[test]
fn presses_of_the_same_sensor_show_no_change() {
    let found = check_day(&day_of(&sensor(0.3), BALL_M, as_it_is), &sensor(0.3)).unwrap();
    assert_eq!(found.cause, Some(Cause::Nothing), "{:?}", found.explanations);
    assert!(found.cost.before.frame < 1.3 && found.cost.after.frame < 1.3, "{:?}", found.cost);
    assert!(found.spots.is_empty() && found.beyond_ball.is_none());
    let today = found.today.unwrap();
    let shift =
        today.rest[0].iter().zip(&sensor(0.3).rest[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(shift < 0.2, "the file stays: {shift}");
}

/// Lights add up: a mixture and a gain over the frame, made pixel by pixel.
#[test]
fn another_light_is_found_and_drawn() {
    let mixed = |image: TactileImage, circle: Circle| {
        let pixel = |(p, rgb): (usize, &[u8; 3])| {
            let [red, green, blue] = rgb.map(f64::from);
            let slope = 1.0 + 0.1 * (2.0 * (p % GRID.width_px) as f64 / GRID.width_px as f64 - 1.0);
            [0.8 * red + 0.1 * blue, 1.1 * green, 0.9 * blue]
                .map(|v| (slope * v).round().clamp(0.0, 255.0) as u8)
        };
        let rgb = image.rgb.as_chunks::<3>().0.iter().enumerate().flat_map(pixel).collect();
        (TactileImage { rgb, ..image }, circle)
    };
    let found = check_day(&day_of(&sensor(0.3), BALL_M, mixed), &sensor(0.3)).unwrap();
    assert_eq!(found.cause, Some(Cause::Light), "{:?}", found.explanations);
    let Change::Light(light) = &found.change else { panic!("{:?}", found.change) };
    assert!((light.mixture[1][1] - 1.1).abs() < 0.05 && (light.field[1][0] - 0.11).abs() < 0.03, "{light:?}");
    assert!(found.cost.before.frame > 8.0 && found.cost.after.contact < 2.0, "{:?}", found.cost);
    let bytes = found.today.unwrap().to_npz().unwrap().unwrap();
    assert!(Sensor::from_npz(&bytes, None, None).is_ok());
}

#[test]
fn another_gel_is_found_around_the_contacts() {
    let found = check_day(&day_of(&sensor(0.5), BALL_M, as_it_is), &sensor(0.3)).unwrap();
    assert_eq!(found.cause, Some(Cause::Gel), "{:?}", found.explanations);
    let sunk = number(&found, "sink_in_fraction");
    assert!((sunk - 0.5).abs() < 0.11, "{sunk}");
    assert!(found.cost.after.contact < 0.8 * found.cost.before.contact, "{:?}", found.cost);
}

/// The same scene through a camera that looks closer, by the sensor of finer pixels.
#[test]
fn another_scale_is_found_by_frame_and_contacts() {
    let zoom = 1.08;
    let closer = |image: TactileImage, circle: Circle| {
        let planes = levels_of(&image).map(|plane| changed::zoomed_plane(&plane, &GRID, zoom, [0.0; 2]));
        let rgb = (0..GRID.len()).flat_map(|p| [0, 1, 2].map(|c| planes[c][p].round() as u8)).collect();
        let (mx, my) = ((GRID.width_px - 1) as f64 / 2.0, (GRID.height_px - 1) as f64 / 2.0);
        let away = |v: f64, m: f64| m + zoom * (v - m);
        let circle = Circle {
            x_px: away(circle.x_px, mx),
            y_px: away(circle.y_px, my),
            radius_px: zoom * circle.radius_px,
        };
        (TactileImage { rgb, ..image }, circle)
    };
    let found = check_day(&day_of(&sensor(0.3), BALL_M, closer), &sensor(0.3)).unwrap();
    assert_eq!(found.cause, Some(Cause::Scale), "{:?}", found.explanations);
    let mm_per_px = number(&found, "mm_per_px");
    assert!((mm_per_px / (0.12 / zoom) - 1.0).abs() < 0.02, "{mm_per_px}");
    let today = found.today.unwrap();
    assert!((today.grid.metres_per_px * 1e3 / mm_per_px - 1.0).abs() < 1e-9);
}

/// The slopes in a contact of the same radius are those of another ball.
#[test]
fn another_ball_is_found_by_the_slopes_in_the_contacts() {
    let found = check_day(&day_of(&sensor(0.3), 1.25 * BALL_M, as_it_is), &sensor(0.3)).unwrap();
    assert_eq!(found.cause, Some(Cause::Ball), "{:?}", found.explanations);
    let factor = number(&found, "diameter_factor");
    assert!((factor - 1.25).abs() < 0.06, "{factor}");
}

#[test]
fn marks_of_another_size_are_told_from_a_change_of_the_sensor() {
    let smaller = |image: TactileImage, circle: Circle| {
        (image, Circle { radius_px: circle.radius_px / 1.12, ..circle })
    };
    let found = check_day(&day_of(&sensor(0.3), BALL_M, smaller), &sensor(0.3)).unwrap();
    let force = found.explanations.iter().find(|e| e.cause == Cause::Force).unwrap();
    assert!(found.cause == Some(Cause::Force) || force.ties, "{:?} {:?}", found.cause, found.explanations);
    assert!((found.radius.value - 1.12).abs() < 0.04, "{:?}", found.radius);
}

#[test]
fn what_no_explanation_covers_is_unknown() {
    // Stripes of a light that is no smooth field.
    let striped = |image: TactileImage, circle: Circle| {
        let level = |(i, v): (usize, &u8)| {
            let stripe = if (i / 3 % GRID.width_px / 6).is_multiple_of(2) { 30 } else { 0 };
            v.saturating_add(stripe)
        };
        let rgb = image.rgb.iter().enumerate().map(level).collect();
        (TactileImage { rgb, ..image }, circle)
    };
    let found = check_day(&day_of(&sensor(0.3), BALL_M, striped), &sensor(0.3)).unwrap();
    assert!(found.cause.is_none() && found.today.is_none(), "{:?} {:?}", found.cause, found.explanations);
}

#[test]
fn marks_wider_than_the_ball_are_counted_with_the_smallest_that_fits() {
    let mut set = day_of(&sensor(0.3), BALL_M, as_it_is);
    set.presses[1].circle = set.presses[1].circle.map(|c| Circle { radius_px: 20.0, ..c });
    let found = beyond_ball(&set, GRID.metres_per_px).unwrap();
    assert_eq!(found.presses, 1);
    assert!((found.smallest_ball_m - 2.0 * 20.0 * 0.12e-3 / 1.05).abs() < 1e-9);
    set.presses.truncate(1);
    assert_eq!(beyond_ball(&set, GRID.metres_per_px), None);
    let few = check_day(&set, &sensor(0.3));
    assert_eq!(few, Err(DayError::TooFew { found: 1 }));
}
