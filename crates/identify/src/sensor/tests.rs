//! Diagnoses of made-up sensors whose formulas are not those of the library.

mod benchmark;
mod generator;

use super::noise::{Noise, draw};
use super::{SensorData, SensorDiagnosis, SensorOptions, calibrate_sensor, compare_sensor, diagnose_sensor};
use crate::diagnosis::Verdict;
use crate::draws::Draws;
use crate::permutation::Covariate;
use generator::{Case, Effect, Made, NoiseKind, make};

fn answer(made: &Made) -> SensorDiagnosis {
    diagnose_sensor(&made.data, &SensorOptions { simulations: 100, ..SensorOptions::default() })
}

fn case(effect: Effect, size: f64, noise: NoiseKind, seed: u64) -> Case {
    Case { effects: vec![effect], size, noise, seed, sessions: 1 + (seed % 3) as usize, rows: 1800 }
}

const NAMED: [(Effect, &str); 7] = [
    (Effect::Drift, "sensor_drift"),
    (Effect::GainDrift, "sensor_gain_drift"),
    (Effect::Quadratic, "sensor_quadratic"),
    (Effect::Saturation, "sensor_saturation"),
    (Effect::Lowpass, "sensor_lowpass"),
    (Effect::Creep, "sensor_creep"),
    (Effect::Hysteresis, "sensor_hysteresis"),
];

/// Autocorrelated noise is not an effect.
#[test]
fn nothing_is_found_where_nothing_is() {
    for (noise, seeds) in [(NoiseKind::White, 0..3), (NoiseKind::Slow, 0..3), (NoiseKind::Smooth, 4..6)] {
        for seed in seeds {
            let d = answer(&make(&case(Effect::None, 1.0, noise, seed))).diagnosis;
            assert_eq!(d.verdict, Verdict::None, "{noise:?} {seed}: {:?} {:?}", d.effects, d.unknown);
            assert!(d.effects.is_empty() && d.unknown.is_empty() && d.error.is_some());
        }
    }
}

/// Each effect is named, with formulas that are not the library's, in slow and in white noise.
#[test]
fn effects_are_named_at_four_times_the_detectable_size() {
    let mut missed = Vec::new();
    for (k, (effect, name)) in NAMED.into_iter().enumerate() {
        let noise = if k % 2 == 0 { NoiseKind::White } else { NoiseKind::Slow };
        let made = make(&case(effect, 4.0, noise, 100 + k as u64));
        let answer = answer(&made);
        let error = answer.diagnosis.error.as_ref().unwrap();
        let first = answer.diagnosis.effects.first();
        if !first.is_some_and(|e| e.class.iter().any(|c| c == name)) {
            missed.push((name, answer.diagnosis.effects.clone(), answer.diagnosis.unknown.clone()));
        }
        assert!(error.after.rmse_n <= error.before.rmse_n, "{name}: {error:?}");
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// What the library lacks is unknown, with the column that does it.
#[test]
fn a_column_of_unknown_meaning_is_named() {
    for effect in [Effect::Temperature, Effect::TemperatureGain] {
        let d = answer(&make(&case(effect, 3.0, NoiseKind::White, 7))).diagnosis;
        assert_eq!(d.verdict, Verdict::Unknown, "{:?}", d.effects);
        assert_eq!(d.unknown[0].covariate, "temperature_c");
        assert!(d.unknown[0].p_value < 0.01 && d.unknown[0].strength > 0.0);
    }
}

/// Values and baseline come back, within their intervals, for a sensor that reads in other units and upside down.
#[test]
fn values_do_not_depend_on_the_unit_of_the_reading() {
    let made = make(&case(Effect::Drift, 4.0, NoiseKind::White, 4));
    let d = answer(&made).diagnosis;
    let mut scaled = made.data;
    scaled.measured_force_n.iter_mut().for_each(|v| *v *= -0.03);
    let other =
        diagnose_sensor(&scaled, &SensorOptions { simulations: 100, ..SensorOptions::default() }).diagnosis;
    let rate = |d: &crate::diagnosis::Diagnosis| d.effects[0].parameters["rate_n_per_h"].value;
    assert_eq!(
        (d.effects[0].name.as_str(), other.effects[0].name.as_str()),
        ("sensor_drift", "sensor_drift")
    );
    assert!((rate(&d) / rate(&other) - 1.0).abs() < 0.02, "{} {}", rate(&d), rate(&other));
    let gain = |d: &crate::diagnosis::Diagnosis| d.baseline["sessions.S1.gain"].value;
    assert!((gain(&other) / gain(&d) + 0.03).abs() < 1e-4);
}

/// A force that rises with the clock: a gain that drifts and a bent line are one and the same.
#[test]
fn what_cannot_be_told_apart_is_said() {
    let n = 900;
    let mut draws = Draws::new(4, 4);
    let force: Vec<f64> = (0..n).map(|i| f64::from(i) * 0.05).collect();
    let data = SensorData {
        time_s: (0..n).map(|i| f64::from(i) * 0.1).collect(),
        measured_force_n: force.iter().map(|f| f + 0.002 * f * f + 0.1 * draws.normal()).collect(),
        reference_force_n: force,
        session: vec![0; n as usize],
        sessions: vec!["1".into()],
        extra: vec![],
    };
    let d = diagnose_sensor(&data, &SensorOptions { simulations: 100, ..SensorOptions::default() }).diagnosis;
    let class = &d.effects[0].class;
    for name in ["sensor_quadratic", "sensor_gain_drift"] {
        assert!(class.iter().any(|c| c == name), "{class:?}");
    }
    assert!(d.effects[0].separate_by.is_some());
    let weights: f64 =
        d.effects[0].weight + d.effects[0].indistinguishable_from.iter().map(|r| r.weight).sum::<f64>();
    assert!(weights <= 1.0 + 1e-9);
    assert_eq!(d.not_excited, [gripgen_twin::effects::FORCE_RATE]);
}

/// Two effects are both named, in white noise and in noise that slow noise beside one of them alone would explain as well.
#[test]
fn two_effects_are_both_named() {
    for (noise, seed) in [(NoiseKind::White, 12), (NoiseKind::Mixed, 301)] {
        let mut both = case(Effect::Drift, 6.0, noise, seed);
        both.effects.push(Effect::Quadratic);
        let d = answer(&make(&both)).diagnosis;
        assert_eq!(d.names(), ["sensor_drift", "sensor_quadratic"], "{noise:?}");
        // Which way a line bends below zero is not asked of forces above it.
        let odd = d.effects.iter().find_map(|e| e.parameters.get("odd"));
        assert!(odd.is_some_and(|p| (p.value, p.low90, p.high90) == (0.0, 0.0, 0.0)), "{odd:?}");
    }
}

/// Every fault is an answer, never a panic and never a name.
#[test]
fn bad_tables_are_insufficient() {
    let good = make(&case(Effect::Quadratic, 4.0, NoiseKind::White, 3)).data;
    let rows = |n: usize| {
        let mut d = good.clone();
        for column in [&mut d.time_s, &mut d.reference_force_n, &mut d.measured_force_n] {
            column.truncate(n);
        }
        d.session.truncate(n);
        d.extra.clear();
        d
    };
    let changed = |f: &dyn Fn(&mut SensorData)| {
        let mut d = rows(400);
        f(&mut d);
        d
    };
    let cases = [
        ("0 rows", SensorData::default()),
        ("1 rows", rows(1)),
        ("session S1: 9 rows", rows(9)),
        ("reference force is 5 N", changed(&|d| d.reference_force_n.fill(5.0))),
        ("measured force is 1 all", changed(&|d| d.measured_force_n.fill(1.0))),
        ("factor of", changed(&|d| d.measured_force_n.iter_mut().for_each(|v| *v *= 30_000.0))),
        ("another unit", changed(&|d| d.reference_force_n.iter_mut().for_each(|v| *v *= 1000.0))),
        ("time moves by 0 s", changed(&|d| d.time_s.fill(3.0))),
        ("no session", changed(&|d| d.measured_force_n.fill(f64::NAN))),
        ("times, but", changed(&|d| d.time_s.truncate(3))),
    ];
    for (text, data) in cases {
        let d = diagnose_sensor(&data, &SensorOptions::default()).diagnosis;
        assert_eq!(d.verdict, Verdict::Insufficient, "{text}: {:?}", d.effects);
        assert!(d.effects.is_empty() && d.unknown.is_empty() && d.error.is_none());
        assert!(d.notes.iter().any(|n| n.contains(text)), "{text}: {:?}", d.notes);
    }
}

/// Spikes are named and do not matter.
#[test]
fn spikes_are_named_and_not_used() {
    let mut made = make(&case(Effect::None, 1.0, NoiseKind::White, 2));
    let top = made.data.measured_force_n.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for row in [100, 777, 1500] {
        made.data.measured_force_n[row] += 5.0 * top;
    }
    let d = answer(&made).diagnosis;
    assert_eq!(d.verdict, Verdict::None, "{:?} {:?}", d.effects, d.unknown);
    assert_eq!(d.data.outliers, ["row 101", "row 778", "row 1501"]);
}

/// Intervals of gain and offset hold although neighbours are alike: by independent rows they would be far too short.
#[test]
fn calibration_intervals_respect_autocorrelation() {
    let mut covered = 0;
    for seed in 0..40 {
        let noise = draw(Noise { correlation: 0.97, white: 0.0 }, &even(600), &mut Draws::new(seed, 8));
        let force: Vec<f64> = (0..600).map(|i| 20.0 + 20.0 * libm::sin(f64::from(i) * 0.02)).collect();
        let data = SensorData {
            time_s: (0..600).map(|i| f64::from(i) * 0.01).collect(),
            measured_force_n: force.iter().zip(&noise).map(|(f, e)| 1.0 + 0.9 * f + e).collect(),
            reference_force_n: force,
            session: vec![0; 600],
            sessions: vec!["1".into()],
            extra: vec![],
        };
        let found = calibrate_sensor(&data).unwrap();
        let gain = &found.sessions[0].gain;
        covered += u32::from((gain.low90..=gain.high90).contains(&0.9));
        assert!(found.sessions[0].lag_one > 0.8);
    }
    assert!((30..=40).contains(&covered), "{covered} of 40, 36 expected");
}

fn even(n: usize) -> Vec<f64> {
    (0..n).map(|i| if i == 0 { f64::INFINITY } else { 1.0 }).collect()
}

/// A comparison with the effect that made the data leaves the noise; without it, more.
#[test]
fn comparisons_refit_gain_and_offset() {
    let spec = gripgen_twin::effects::find("sensor_quadratic").unwrap();
    let force: Vec<f64> = (0..200).map(|i| f64::from(i % 40)).collect();
    let data = SensorData {
        time_s: (0..200).map(f64::from).collect(),
        measured_force_n: force.iter().map(|f| 3.0 - 0.5 * (f + 0.004 * f * f)).collect(),
        reference_force_n: force,
        session: (0..200).map(|i| i / 100).collect(),
        sessions: vec!["a".into(), "b".into()],
        extra: vec![],
    };
    let with = compare_sensor(&data, &[(spec, &[0.004, 0.0])]).unwrap();
    let without = compare_sensor(&data, &[]).unwrap();
    assert!(with.rmse_n < 1e-9 && without.rmse_n > 0.1, "{with:?} {without:?}");
    assert_eq!(with.by_session.len(), 2);
    assert!(compare_sensor(&SensorData::default(), &[]).is_err());
}
