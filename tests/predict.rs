//! Predictions that fits are made with, against the simulator and closed forms.

use crate::common::{baseline, library, overrides, twin_at, twin_with, twin_with_sets};
use crate::diagnose::simulated;
use gripgen::Location;
use gripgen::twin::label::moments::label_moments;
use gripgen::twin::predict::{ModelEffect, PredictPulls as _, PullModel};
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{PullTrace, TraceRow, slip_label};
use gripgen_cli::{compare_pulls, given_model, pull_predictor};

/// The closed form of the label over white noise against the rule applied to 4000 noisy traces: before and at a slip
/// whose kinetic force stays within the tolerance for a while.
#[test]
fn the_expected_label_is_the_mean_over_noisy_traces() {
    let noise_n = 0.15;
    let desired: Vec<f64> = (0..700).map(|i| 1.0 + f64::from(i / 52)).collect();
    let reading: Vec<f64> =
        (0..700).map(|i| if i < 480 { f64::from(i) / 52.0 } else { 0.85 * 480.0 / 52.0 }).collect();
    let (mean, var) = label_moments(desired.iter().zip(&reading), 3.0, noise_n).unwrap();
    let (mut sum, mut square) = (0.0, 0.0);
    let draws = 4000_u32;
    for seed in 0..draws {
        let mut noise = Stream::new(u64::from(seed), 0, Purpose::ForceNoise);
        let trace: PullTrace = (0..700)
            .map(|i| TraceRow {
                time_s: i as f64 * 0.002,
                desired_force_n: desired[i],
                measured_force_n: reading[i] + noise_n * noise.normal(),
                displacement_m: 0.0,
            })
            .collect();
        let label = slip_label(&trace, 3.0, true).unwrap().max_pull_force_n;
        sum += label;
        square += label * label;
    }
    let n = f64::from(draws);
    let (seen, seen_var) = (sum / n, square / n - (sum / n).powi(2));
    assert!((mean - seen).abs() < 4.0 * (seen_var / n).sqrt(), "{mean} against {seen}");
    assert!((var / seen_var - 1.0).abs() < 0.15, "{var} against {seen_var}");
}

/// The fast prediction against the reduced mechanics, without noise and scatter: three step heights, four forces, static
/// and kinetic branch of the rule, and a lag.
#[test]
fn a_pull_without_inertia_is_the_reduced_one() {
    for ratio in ["1.0", "0.9"] {
        let sets = [
            ("wrist.noise_n", "0"),
            ("parts.long_shaft.scatter", "0"),
            ("parts.long_shaft.kinetic_ratio", ratio),
            ("robot.lag_s", "0.06"),
        ];
        let measured = simulated("", 40, &sets);
        let twin = twin_with_sets(&baseline(), &overrides(&sets));
        let found = compare_pulls(&measured, &twin, &library(&twin), 2).unwrap();
        println!("kinetic ratio {ratio}: {:.3} N, {:.2} %", found.pulls.rmse_n, found.pulls.mape_pct);
        assert!(found.pulls.mape_pct < 2.0, "kinetic ratio {ratio}: {found:?}");
    }
}

/// The prediction that fits are made with against the simulator: contacts that let go at once and that bend, static and kinetic
/// branch of the rule, a light and a heavy arm's damping. Springs for contacts that bend are 1.5 N off at 80 N.
#[test]
fn fits_see_what_the_simulator_does() {
    let mut measured = simulated("", 60, &[]);
    measured.feedback = Some(gripgen::twin::config::Feedback::Independent);
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        (pull.grip_force_n, pull.trace) = (8.0 + 1.2 * i as f64, None);
    }
    let twin = twin_at(&baseline());
    let library = library(&twin);
    let rows: Vec<usize> = (0..measured.pulls.len()).collect();
    for (by_area, ratio, damping) in
        [(0.0, 0.93, 2000.0), (1.0, 0.93, 2000.0), (1.0, 0.9, 100.0), (0.4, 1.0, 500.0)]
    {
        let predictor = pull_predictor(&measured, &twin, &library, 2);
        let mut model = given_model(&twin, predictor.part_names()).unwrap();
        (model.shear_by_area, model.kinetic_ratio, model.damping_n_s_per_m) = (by_area, ratio, damping);
        let fast = predictor.pulls(&model, &rows);
        let exact = predictor.labels_n(&model, &rows);
        let (mut off, mut all, mut worst) = (0.0, 0.0, 0.0_f64);
        for (fast, exact) in fast.iter().zip(&exact) {
            off += (fast.label_n - exact).abs();
            all += exact;
            worst = worst.max((fast.label_n - exact).abs());
        }
        println!(
            "by area {by_area}, ratio {ratio}, {damping} N s/m: {:.2} %, worst {worst:.2} N",
            100.0 * off / all
        );
        assert!(
            off < 0.01 * all && worst < 0.8,
            "by area {by_area}, ratio {ratio}, {damping} N s/m: {worst} N"
        );
    }
}

/// The same for tools that creep, each grip at its own rate: some as far as the stop while the jaws hold, some until they slip.
#[test]
fn fits_see_tools_that_creep() {
    let mut measured = simulated("", 60, &[]);
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        (pull.grip_force_n, pull.trace) = (8.0 + 1.2 * i as f64, None);
    }
    let twin = twin_at(&baseline());
    let library = library(&twin);
    let rows: Vec<usize> = (0..measured.pulls.len()).collect();
    let creep = gripgen::twin::effects::find("shear_creep").unwrap();
    for (by_area, rim) in [(0.0, 0.0), (0.0, 2.0 / 3.0), (1.0, 1.0 / 3.0)] {
        let predictor = pull_predictor(&measured, &twin, &library, 2);
        let mut model = given_model(&twin, predictor.part_names()).unwrap();
        (model.shear_by_area, model.kinetic_ratio) = (by_area, 0.95);
        let plain = predictor.pulls(&model, &rows);
        let values = creep.values(&[("rate_mm_per_n_s", 0.5), ("load_exponent", 0.3), ("rim_exponent", rim)]);
        model.effects = vec![ModelEffect::new(creep, values)];
        let fast = predictor.pulls(&model, &rows);
        let exact = predictor.labels_n(&model, &rows);
        let off = |k: usize| (fast[k].label_n - exact[k]).abs();
        let (sum, all) = (rows.iter().map(|&k| off(k)).sum::<f64>(), exact.iter().sum::<f64>());
        let worst = rows.iter().map(|&k| off(k)).fold(0.0, f64::max);
        let stopped = rows.iter().filter(|&&k| fast[k].label_n < 0.9 * plain[k].label_n).count();
        println!(
            "by area {by_area}, rim {rim}: {:.2} %, worst {worst:.2} N, {stopped} stopped",
            100.0 * sum / all
        );
        assert!((10..=50).contains(&stopped), "{stopped} of 60 end at the stop");
        assert!(
            sum < 0.012 * all && worst < 0.8,
            "by area {by_area}, rim {rim}: {sum} N of {all} N, worst {worst} N"
        );
    }
}

/// The same for a gain that drifts over four hours: a table of each pull where few share a profile, three of a profile and a parabola
/// in time where many do. The answers do not depend on what was asked before, or in which order.
#[test]
fn fits_see_a_gain_that_drifts() {
    let effect = "[[effects]]\nname = \"sensor_gain_drift\"\nrate_per_h = 0.04\n";
    let (_folder, file) = twin_with(effect);
    let twin = twin_at(&Location::Disk(file));
    let library = library(&twin);
    let mut measured = simulated("", 60, &[]);
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        (pull.grip_force_n, pull.trace) = (8.0 + 0.8 * i as f64, None);
        pull.covariates.time_s = 240.0 * i as f64;
    }
    let drift = ModelEffect::new(twin.effects[0].spec, twin.effects[0].values.clone());
    for (profiles, by_area) in [(1, 0.0), (1, 1.0), (12, 0.0), (12, 1.0)] {
        for (i, pull) in measured.pulls.iter_mut().enumerate() {
            pull.increment_n = 0.8 + 0.05 * (i % profiles) as f64;
        }
        let rows: Vec<usize> = (0..measured.pulls.len()).collect();
        let predictor = pull_predictor(&measured, &twin, &library, 2);
        let mut model = given_model(&twin, predictor.part_names()).unwrap();
        (model.shear_by_area, model.kinetic_ratio, model.effects) = (by_area, 0.93, vec![drift.clone()]);
        let fast = predictor.pulls(&model, &rows);
        let exact = predictor.labels_n(&model, &rows);
        let plain = predictor.labels_n(&PullModel { effects: vec![], ..model.clone() }, &rows);
        let mean = |x: &dyn Fn(usize) -> f64| rows.iter().map(|&i| x(i)).sum::<f64>() / rows.len() as f64;
        let off = mean(&|i| (fast[i].label_n - exact[i]).abs()) / mean(&|i| exact[i]);
        let acts = mean(&|i| (plain[i] - exact[i]).abs()) / mean(&|i| exact[i]);
        println!("{profiles} profiles, by area {by_area}: {:.2} % of {:.1} %", 100.0 * off, 100.0 * acts);
        assert!(off < 0.003 && acts > 0.05, "{profiles} profiles, by area {by_area}: {off}, {acts}");
        let other = pull_predictor(&measured, &twin, &library, 1);
        let mut nearby = model.clone();
        nearby.mu[0] *= 1.07;
        other.pulls(&nearby, &rows);
        for &row in rows.iter().rev().filter(|row| profiles > 1 && *row % 7 == 0) {
            assert_eq!(other.pulls(&model, &[row])[0], fast[row], "pull {row}");
        }
        assert_eq!(other.pulls(&model, &rows), fast, "{profiles} profiles, by area {by_area}");
    }
}

/// A slip is read with the scatter of the friction, and at the end of the sensor's range with hardly any: all grips read the same there.
#[test]
fn slips_at_the_end_of_the_range_hardly_scatter() {
    let limit_n = 30.0;
    let (_folder, file) =
        twin_with(&format!("[[effects]]\nname = \"sensor_saturation\"\nlimit_n = {limit_n}\n"));
    let twin = twin_at(&Location::Disk(file));
    let library = library(&twin);
    let mut measured = simulated("", 40, &[]);
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        (pull.grip_force_n, pull.trace) = (8.0 + 6.0 * i as f64, None);
    }
    let rows: Vec<usize> = (0..measured.pulls.len()).collect();
    let predictor = pull_predictor(&measured, &twin, &library, 1);
    let mut model = given_model(&twin, predictor.part_names()).unwrap();
    model.scatter = 0.05;
    let plain = predictor.slips(&model, &rows);
    model.effects = vec![ModelEffect::new(twin.effects[0].spec, twin.effects[0].values.clone())];
    let ended = predictor.slips(&model, &rows);
    let (mut below, mut beyond) = (0, 0);
    for (plain, ended) in plain.iter().zip(&ended) {
        assert!((plain.label_sd_n / (0.05 * plain.limit_n) - 1.0).abs() < 1e-9, "{plain:?}");
        if plain.limit_n < 0.8 * limit_n {
            below += 1;
            assert!((ended.label_sd_n / plain.label_sd_n - 1.0).abs() < 0.05, "{ended:?}");
        } else if plain.limit_n > 1.2 * limit_n {
            beyond += 1;
            assert!(ended.label_sd_n < 0.01 * plain.label_sd_n, "{ended:?}");
            assert!((ended.limit_reading_n - limit_n).abs() < 0.1, "{ended:?}");
        }
    }
    assert!(below >= 5 && beyond >= 5, "{below} below, {beyond} beyond");
}
