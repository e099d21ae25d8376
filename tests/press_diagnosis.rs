//! Presses whose optics were changed by formulas of the test, diagnosed.

use crate::common::root;
use crate::presses::block;
use gripgen::tactile::presses::{Circle, Indenter, IndenterPose, Press, PressContact, PressScene, PressSet};
use gripgen::tactile::{Sensor, finish};
use gripgen::twin::{OpticsState, TactileImage};
use gripgen_cli::{PressCovariate, PressDiagnosisInput, PressValues, diagnose_presses, measured_presses};
use gripgen_identify::{Diagnosis, Verdict};
use gripgen_measured::PressColumns;
use std::sync::Arc;

const PRESSES: usize = 12;
const BALL_M: f64 = 6e-3;

fn sensor() -> Sensor {
    let bytes = std::fs::read(root().join("assets/sensors/gelsight_synthetic/sensor.npz")).unwrap();
    Sensor::from_npz(&bytes, None, None).unwrap()
}

/// Presses of the shipped sensor with its noise; `change`: share of the way through, row-major (u, v), grey levels.
fn presses(sensor: &Sensor, change: impl Fn(f64, [f64; 2], [f64; 3]) -> [f64; 3]) -> PressSet {
    let scene = PressScene::new(sensor, BALL_M);
    let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
    let press = |i: usize| {
        let place = |k: usize| ((i * k * 37 + 11 * k) % 100) as f64 / 100.0;
        let circle = Circle {
            x_px: w as f64 * (0.25 + 0.5 * place(3)),
            y_px: h as f64 * (0.25 + 0.5 * place(5)),
            radius_px: 18.0 + 8.0 * place(7),
        };
        let seen = scene.change_seen(Some(&PressContact::of_circle(circle)), &OpticsState::default());
        let image = finish(sensor, Some(&seen), Some(i as u64 + 1));
        let rgb = image.rgb.chunks_exact(3).enumerate().flat_map(|(p, rgb)| {
            let at = |k: usize, n: usize| 2.0 * k as f64 / n as f64 - 1.0;
            let place = [at(p % w, w), at(p / w, h)];
            change(i as f64 / PRESSES as f64, place, [rgb[0], rgb[1], rgb[2]].map(f64::from))
                .map(|v| v.round().clamp(0.0, 255.0) as u8)
        });
        let image = TactileImage { rgb: rgb.collect(), ..image };
        Press::of_ball(format!("press-{i:02}"), image, Some(circle))
    };
    PressSet {
        metres_per_px: sensor.grid.metres_per_px,
        ball_m: BALL_M,
        rest: Some(finish(sensor, None, None)),
        presses: (0..PRESSES).map(press).collect(),
    }
}

fn diagnosis(set: &PressSet, sensor: &Sensor, covariates: Vec<PressCovariate>) -> Diagnosis {
    let input = PressDiagnosisInput {
        set,
        sensor,
        time_s: None,
        covariates,
        marked: true,
        sha256: "0".into(),
        kept_effects: Vec::new(),
    };
    diagnose_presses(&input, &mut |_, _| {}).diagnosis
}

fn names(d: &Diagnosis) -> Vec<&str> {
    d.effects.iter().map(|e| e.name.as_str()).collect()
}

fn mse(d: &Diagnosis) -> (f64, f64) {
    let error = d.error.as_ref().unwrap();
    (error.before.mse.unwrap(), error.after.mse.unwrap())
}

/// Nothing is found where there is nothing, and the error is that of the noise.
#[test]
fn presses_as_the_sensor_file_has_them_lack_nothing() {
    let sensor = sensor();
    let d = diagnosis(&presses(&sensor, |_, _, p| p), &sensor, Vec::new());
    assert_eq!((d.verdict, names(&d), d.unknown.len()), (Verdict::None, vec![], 0), "{d:?}");
    let floor = d.noise_floor_mse.unwrap();
    assert!((mse(&d).0 / floor - 1.0).abs() < 0.15, "{} and {floor}", mse(&d).0);
}

/// Light that settles as a stretched exponential of the order is a drift, and its error goes down to nearly the noise.
#[test]
fn light_that_settles_is_a_drift() {
    let sensor = sensor();
    let set = presses(&sensor, |share, _, p| {
        let settled = 1.0 - (-(share / 0.8_f64).powf(1.1)).exp();
        [p[0] * (1.0 - 0.08 * settled), p[1] * (1.0 - 0.05 * settled), p[2] * (1.0 - 0.10 * settled)]
    });
    let d = diagnosis(&set, &sensor, Vec::new());
    assert_eq!((d.verdict, names(&d)), (Verdict::Effect, vec!["light_drift"]), "{d:?}");
    assert!(d.effects[0].parameters["blue_per_h"].high90 < 0.0);
    assert!(mse(&d).1 < 0.25 * mse(&d).0, "{:?}", mse(&d));
}

/// A constant that is added to images with contact, through whole levels.
#[test]
fn a_constant_is_an_offset_with_its_value() {
    let sensor = sensor();
    let set = presses(&sensor, |_, _, [r, g, b]| [r + 4.0, g - 3.0, b + 2.0]);
    let d = diagnosis(&set, &sensor, Vec::new());
    assert_eq!(names(&d), ["rest_offset"], "{d:?}");
    for (name, value) in [("red", 4.0), ("green", -3.0), ("blue", 2.0)] {
        let p = &d.effects[0].parameters[name];
        assert!((p.value - value).abs() < 0.1, "{name}: {}", p.value);
    }
}

/// What follows a column of the table and no effect of the library is unknown, by the column's name.
#[test]
fn light_that_follows_a_lamp_is_unknown_by_the_name_of_its_column() {
    let sensor = sensor();
    let volts: Vec<f64> = (0..PRESSES).map(|i| ((i * 5 + 2) % 12) as f64 / 11.0).collect();
    let by_press = volts.clone();
    let set = presses(&sensor, move |share, _, p| {
        let v = by_press[(share * PRESSES as f64).round() as usize];
        p.map(|x| x * (1.0 + 0.06 * (2.0 * v - 1.0)))
    });
    let column = PressCovariate { name: "lamp_v".into(), values: PressValues::Numbers(volts) };
    let d = diagnosis(&set, &sensor, vec![column]);
    assert_eq!((d.verdict, d.unknown[0].covariate.as_str()), (Verdict::Unknown, "lamp_v"), "{d:?}");
}

/// A white balance that is not that of the sensor file.
#[test]
fn a_colour_cast_that_all_presses_have_is_a_white_balance() {
    let sensor = sensor();
    let d = diagnosis(&presses(&sensor, |_, _, [r, g, b]| [1.05 * r, g, 0.95 * b]), &sensor, Vec::new());
    assert_eq!(names(&d), ["press_gain"]);
    let of = |name: &str| d.effects[0].parameters[name].value;
    assert!(
        (of("red") - 1.05).abs() < 0.005 && (of("blue") - 0.95).abs() < 0.005,
        "{} {}",
        of("red"),
        of("blue")
    );
}

/// Bodies on a stage whose zero is 0.12 mm off, at several depths and places: the depth is named with its offset.
#[test]
fn bodies_that_are_deeper_than_the_table_says_have_another_depth() {
    let sensor = sensor();
    let scene = PressScene::new(&sensor, BALL_M);
    let press = |i: u32| {
        let at = IndenterPose {
            x_px: 110.0 + 33.0 * f64::from(i % 4),
            y_px: 80.0 + 40.0 * f64::from(i % 3),
            rotation_rad: 0.4 * f64::from(i),
        };
        let of = |travel_mm: f64, image| {
            let indenter = Indenter::of_mesh("block", &block(), at, travel_mm * 1e-3, &sensor.grid).unwrap();
            Press::of_body(format!("press-{i}"), image, Arc::new(indenter))
        };
        let stated_mm = 0.3 + 0.08 * f64::from(i % 5);
        let there = PressContact::of(&of(stated_mm + 0.12, finish(&sensor, None, None)));
        let change = scene.change_seen(there.as_ref(), &OpticsState::default());
        of(stated_mm, finish(&sensor, Some(&change), Some(u64::from(i) + 1)))
    };
    let set = PressSet {
        metres_per_px: sensor.grid.metres_per_px,
        ball_m: BALL_M,
        rest: Some(finish(&sensor, None, None)),
        presses: (0..6).map(press).collect(),
    };
    let d = diagnosis(&set, &sensor, Vec::new());
    assert_eq!(names(&d), ["press_depth"]);
    let of = |name: &str| d.effects[0].parameters[name].value;
    for depth_mm in [0.3, 0.6] {
        let found_mm = of("factor") * depth_mm + of("offset_mm");
        assert!((found_mm - depth_mm - 0.12).abs() < 0.03, "{depth_mm}: {found_mm}");
    }
    let (before, after) = mse(&d);
    let floor = d.noise_floor_mse.unwrap();
    assert!(after - floor < 0.15 * (before - floor), "{before} {after} {floor}");
    assert!(d.plain.as_ref().is_some_and(|plain| plain.contains("pressed in deeper")), "{:?}", d.plain);
}

/// Too few presses are said to be too few.
#[test]
fn three_presses_are_too_few() {
    let sensor = sensor();
    let mut set = presses(&sensor, |_, _, p| p);
    set.presses.truncate(3);
    let d = diagnosis(&set, &sensor, Vec::new());
    assert_eq!(d.verdict, Verdict::Insufficient);
    assert!(d.notes[0].contains("3 presses with a visible contact, 4 are needed"), "{:?}", d.notes);
}

/// Without marks and without a frame at rest the sensor file's shows where the contacts are; a press without one takes its row
/// of the table with it.
#[test]
fn contacts_that_nobody_marked_are_found_beside_the_sensor_file() {
    let sensor = sensor();
    let mut set = presses(&sensor, |_, _, p| p);
    let truth: Vec<Circle> = set.presses.iter().filter_map(|p| p.circle).collect();
    set.rest = None;
    set.presses.iter_mut().for_each(|p| p.circle = None);
    let blank = Press::of_ball("blank", finish(&sensor, None, None), None);
    set.presses.insert(3, blank);
    let columns = PressColumns {
        names: set.presses.iter().map(|p| p.name.clone()).collect(),
        time_s: Some((0..set.presses.len()).map(|i| i as f64).collect()),
        covariates: Vec::new(),
    };
    let measured = measured_presses(set, columns, &sensor);
    assert_eq!(measured.circles.without_contact, ["blank"]);
    assert_eq!(measured.circles.found.len(), PRESSES);
    assert_eq!(measured.columns.time_s.unwrap()[..5], [0.0, 1.0, 2.0, 4.0, 5.0]);
    assert!(!measured.marked && measured.set.rest.is_none());
    for (press, truth) in measured.set.presses.iter().zip(truth) {
        let found = press.circle.unwrap();
        let off = (found.x_px - truth.x_px).hypot(found.y_px - truth.y_px);
        assert!(off < 4.0, "{}: {found:?} for {truth:?}", press.name);
    }
}
