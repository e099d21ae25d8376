//! A sensor file of one day against real presses, as they are and with light, scale and gel changed by formulas that are not the
//! library's.

use crate::common::root;
use gripgen::tactile::presses::{
    CalibrateOptions, Cause, Circle, Press, PressSet, calibrate_presses, check_day,
};
use gripgen::tactile::{Pyramid, Sensor};
use gripgen::twin::TactileImage;
use gripgen_cli::{PressGeometry, load_presses};

/// Each image and circle of a set by a function.
fn each(set: &PressSet, new: impl Fn(&TactileImage, Circle) -> (TactileImage, Circle)) -> PressSet {
    let press = |press: &Press| {
        let (image, circle) = new(&press.image, press.circle.unwrap());
        Press { image, circle: Some(circle), ..press.clone() }
    };
    PressSet { rest: None, presses: set.presses.iter().map(press).collect(), ..*set }
}

/// Grey levels by pixel, column, row and colour, rounded.
fn drawn(image: &TactileImage, level: impl Fn(f64, f64, usize) -> f64) -> TactileImage {
    let width = image.width_px as usize;
    let at = |i: usize| {
        level((i / 3 % width) as f64, (i / 3 / width) as f64, i % 3).round().clamp(0.0, 255.0) as u8
    };
    TactileImage { rgb: (0..image.rgb.len()).map(at).collect(), ..*image }
}

/// A grey level between pixels.
fn between(image: &TactileImage, x: f64, y: f64, c: usize) -> f64 {
    let (w, h) = (image.width_px as usize, image.height_px as usize);
    let at = |x: usize, y: usize| f64::from(image.rgb[3 * (y.min(h - 1) * w + x.min(w - 1)) + c]);
    let (x, y) = (x.clamp(0.0, w as f64 - 1.0), y.clamp(0.0, h as f64 - 1.0));
    let (x0, y0, fx, fy) = (x as usize, y as usize, x.fract(), y.fract());
    let row = |y: usize| at(x0, y) * (1.0 - fx) + at(x0 + 1, y) * fx;
    row(y0) * (1.0 - fy) + row(y0 + 1) * fy
}

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn changes_of_real_presses_are_told_apart() {
    let folder = root().join("../shared/real/gelsight_shapes/balls");
    let geometry = PressGeometry { ball_m: Some(5.84e-3), metres_per_px: Some(0.059_259_259_2e-3) };
    let set = load_presses(&folder, geometry).unwrap();
    let half = |odd: usize| {
        let presses = set.presses.iter().skip(odd).step_by(2).cloned().collect();
        PressSet { presses, ..set.clone() }
    };
    let options = CalibrateOptions { folds: Some(2), ..Default::default() };
    let sensor = calibrate_presses(&half(0), &options).unwrap().sensor;
    let mut five = half(1);
    five.presses.retain({
        let mut count = 0;
        move |_| {
            count += 1;
            count % 2 == 1 && count < 10
        }
    });
    assert_eq!(five.presses.len(), 5);
    let dimmer = each(&five, |image, circle| {
        (drawn(image, |x, y, c| [0.85, 1.0, 1.1][c] * between(image, x, y, c)), circle)
    });
    let sloped = each(&five, |image, circle| {
        (drawn(image, |x, y, c| (1.0 + 0.1 * (x / 160.0 - 1.0)) * between(image, x, y, c)), circle)
    });
    let zoom = 1.06;
    let old = |v: f64| 159.5 + (v - 159.5) / zoom;
    let closer = each(&five, |image, circle| {
        let new = |v: f64| 159.5 + (v - 159.5) * zoom;
        let circle =
            Circle { x_px: new(circle.x_px), y_px: new(circle.y_px), radius_px: zoom * circle.radius_px };
        (drawn(image, |x, y, c| between(image, old(x), old(y), c)), circle)
    });
    let pyramid = sensor.pyramid.clone().unwrap();
    let share = pyramid.sink_in_fraction - 0.2;
    let stiffer = Pyramid { sink_in_fraction: share, restore_depth_fraction: share, ..pyramid };
    let other_gel = Sensor { pyramid: Some(stiffer), ..sensor.clone() };
    let cases = [
        ("as they are", &five, &sensor, Cause::Nothing),
        ("dimmer", &dimmer, &sensor, Cause::Light),
        ("a slope of light", &sloped, &sensor, Cause::Light),
        ("closer", &closer, &sensor, Cause::Scale),
        ("a file of another gel", &five, &other_gel, Cause::Gel),
    ];
    for (name, presses, file, cause) in cases {
        let found = check_day(presses, file).unwrap();
        let cost = found.cost;
        println!("{name}: {:?}, {cost:.1?}", found.cause);
        assert_eq!(found.cause, Some(cause), "{name}: {:?}", found.explanations);
        if cause != Cause::Nothing {
            assert!(cost.after.frame < 0.8 * cost.before.frame, "{name}: {cost:?}");
        }
    }
}
