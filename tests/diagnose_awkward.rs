//! Campaigns that are harder than a simulator's own: noisy sensors without traces, bad pulls, effects of one session alone, a gripper
//! that speaks into the sensor.

use crate::common::{baseline, library, twin_at};
use crate::diagnose::{diagnose, names, simulated};
use gripgen::twin::draw::Drawn;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{ExtraColumn, MeasuredPulls, PullTrace, TraceRow, Values};
use gripgen_cli::{calibrate_twin, edited_twin};
use gripgen_identify::Verdict;
use gripgen_identify::pulls::calibrate::CalibrateRequest;

/// Labels alone, as they are copied from a screen.
fn labels_alone(mut measured: MeasuredPulls) -> MeasuredPulls {
    for pull in &mut measured.pulls {
        pull.trace = None;
        pull.max_pull_force_n = (pull.max_pull_force_n * 10.0).round() / 10.0;
    }
    measured
}

/// A sensor with three times the noise that the twin says reads labels higher. That is its noise and no offset of the friction: the
/// calibration says so, and the diagnosis names nothing.
#[test]
#[ignore = "slow: a campaign"]
fn labels_say_how_noisy_their_sensor_is() {
    let twin = twin_at(&baseline());
    let noise = |measured: &MeasuredPulls| {
        let found = calibrate_twin(measured, &twin, &library(&twin), &CalibrateRequest::default(), 2);
        let noise = found.unwrap().0.baseline["wrist.noise_n"].clone();
        assert!(noise.low90 < noise.value && noise.value < noise.high90, "{noise:?}");
        noise.value
    };
    let noisy = labels_alone(simulated("", 60, &[("wrist.noise_n", "0.4")]));
    let quiet = labels_alone(simulated("", 60, &[("wrist.noise_n", "0.05")]));
    let (noisy_n, quiet_n) = (noise(&noisy), noise(&quiet));
    assert!(noisy_n > 0.2 && quiet_n < 0.2 && noisy_n > 2.0 * quiet_n, "{noisy_n} {quiet_n}");
    let found = diagnose(&noisy, &[]).diagnosis;
    assert_eq!(found.verdict, Verdict::None, "{:?} {:?}", names(&found), found.unknown);
}

/// Jaws that slide fast are at the stop before a noisy reading is the label, so that labels go with the rate of the pull. That is the arm,
/// and no friction that depends on the rate.
#[test]
#[ignore = "slow: a campaign"]
fn labels_say_how_fast_the_jaws_slide() {
    let own = [("wrist.noise_n", "0.35"), ("robot.feedback", "independent")];
    let light = [own[0], own[1], ("robot.damping_n_s_per_m", "100.0")];
    let found = diagnose(&labels_alone(simulated("", 60, &light)), &[]).diagnosis;
    assert_eq!(found.verdict, Verdict::None, "{:?} {:?}", names(&found), found.unknown);
    let damping = &found.baseline["robot.damping_n_s_per_m"];
    assert!(damping.value > 40.0 && damping.value < 250.0, "{damping:?}");
    let twin = twin_at(&baseline());
    let heavy = labels_alone(simulated("", 60, &own));
    let heavy = calibrate_twin(&heavy, &twin, &library(&twin), &CalibrateRequest::default(), 2).unwrap().0;
    assert!(!heavy.baseline.contains_key("robot.damping_n_s_per_m"), "{:?}", heavy.baseline);
}

/// A sensor that ends above all levels but the strongest: pulls of the other levels know nothing of its end, so that errors on held-out
/// levels do not fall, and the answer says on what it rests.
#[test]
#[ignore = "slow: a campaign"]
fn the_end_of_a_range_that_one_level_reaches_is_no_news_to_the_others() {
    let end = "[[effects]]\nname = \"sensor_saturation\"\nlimit_n = 23.0\n";
    let measured = labels_alone(simulated(end, 60, &[]));
    let beyond = measured.pulls.iter().filter(|p| p.max_pull_force_n > 22.5);
    let forces_n: Vec<f64> = beyond.map(|p| p.grip_force_n).collect();
    assert!(forces_n.len() > 2 && forces_n.iter().all(|force_n| *force_n > 79.0), "{forces_n:?}");
    let found = diagnose(&measured, &[]).diagnosis;
    assert_eq!(names(&found), ["sensor_saturation"], "{:?} {:?}", found.unknown, found.hints);
    let error = found.error.as_ref().unwrap();
    assert!(error.after.rmse_n < error.before.rmse_n.map(|e| 0.8 * e), "{error:?}");
    let levels = error.by.levels.as_ref().unwrap();
    assert!(levels.after.rmse_n > levels.before.rmse_n.map(|e| 0.9 * e), "{levels:?}");
    assert!(
        found.deciding.iter().any(|note| note.contains("one level of the grip force")),
        "{:?}",
        found.notes
    );
    // Three pulls lie close together by chance.
    let mut three = measured;
    let mut left = 3;
    three.pulls.retain(|p| {
        let beyond = p.max_pull_force_n > 22.5;
        left -= i32::from(beyond);
        !beyond || left >= 0
    });
    let found = diagnose(&three, &[]).diagnosis;
    assert!(!names(&found).contains(&"sensor_saturation"), "{:?}", found.effects);
}

/// A first pull that went wrong is an outlier. A conditioning that lasts for half a pull explains it, and nothing else.
#[test]
fn one_bad_pull_is_no_effect() {
    let mut measured = labels_alone(simulated("", 60, &[]));
    measured.pulls[0].max_pull_force_n *= 0.5;
    let found = diagnose(&measured, &[]).diagnosis;
    assert_eq!(found.verdict, Verdict::None, "{:?} {:?}", names(&found), found.unknown);
    assert_eq!(found.data.outliers, [measured.pulls[0].id.clone()]);
}

/// Friction that grows with the dwell in the second session alone comes back as that pair of columns, and the twin that is written
/// has it in that session alone.
#[test]
#[ignore = "slow: a campaign"]
fn what_acts_in_one_session_is_found_there() {
    let table = "[[effects]]\nname = \"table\"\ncovariate = \"dwell_s\"\nwhere = { session = \"2\" }\nx = [0.5, 90.0]\n\
                 factor = [1.0, 1.5]\nphysical = false\n";
    let measured = simulated(table, 150, &[]);
    assert!(measured.pulls.iter().any(|p| p.covariates.session == "2" && p.covariates.dwell_s > 5.0));
    let found = diagnose(&measured, &[]);
    let unknown: Vec<&str> = found.diagnosis.unknown.iter().map(|u| u.covariate.as_str()).collect();
    assert_eq!(unknown, ["dwell_s*session"], "{:?}", names(&found.diagnosis));
    assert!(
        found.diagnosis.notes.iter().any(|n| n.contains("where session is 2")),
        "{:?}",
        found.diagnosis.notes
    );
    let written = edited_twin(&baseline(), &[], &found.edits).unwrap();
    let own = written.effects.iter().find(|e| e.name == "table").expect("a table");
    assert_eq!(own.parameters["where"].as_table().unwrap()["session"].as_str(), Some("2"));
    let error = found.diagnosis.error.unwrap();
    assert!(error.after.rmse_n < error.before.rmse_n.map(|e| 0.8 * e), "{error:?}");
}

/// Readings that rise by 20 mN for each newton of the grip, with and without a load: mu takes it in, the readings without a load
/// show it. A zero that walks about is nothing of the kind, and labels that walk with it are no second witness of anything.
#[test]
fn cross_talk_of_the_grip_shows_without_a_load() {
    let with = |zero_n: &dyn Fn(f64, usize) -> f64| {
        let mut measured = simulated("", 60, &[]);
        for (i, pull) in measured.pulls.iter_mut().enumerate() {
            let more_n = zero_n(pull.grip_force_n, i);
            let row = |r: TraceRow| TraceRow { measured_force_n: r.measured_force_n + more_n, ..r };
            pull.trace = pull.trace.as_ref().map(|trace| trace.rows().map(row).collect::<PullTrace>());
            pull.max_pull_force_n += more_n;
        }
        diagnose(&measured, &[]).diagnosis
    };
    let found = with(&|grip_n, _| 0.02 * grip_n);
    let unknown: Vec<&str> = found.unknown.iter().map(|u| u.covariate.as_str()).collect();
    assert!(unknown.contains(&"grip_force_n"), "{unknown:?} {:?}", names(&found));
    assert!(found.notes.iter().any(|n| n.contains("cross-talk")), "{:?}", found.notes);
    let mut noise = Stream::new(5, 0, Purpose::ForceNoise);
    let walk: Vec<f64> = (0..60)
        .scan(0.0, |zero, _| {
            *zero = 0.9 * *zero + 0.13 * noise.normal();
            Some(*zero)
        })
        .collect();
    let found = with(&|_, i| walk[i]);
    assert_eq!(found.verdict, Verdict::None, "{:?} {:?}", names(&found), found.unknown);
}

/// A wear that has hardly bent yet: depth and pull count say one product, and slopes leave a depth of nothing open. The likelihood does not:
/// the wear is named, with an interval that ends before nothing.
#[test]
#[ignore = "slow: a minute"]
fn a_wear_that_has_hardly_bent_is_a_name() {
    let wear = "[[effects]]\nname = \"wear\"\ndepth = 0.8\nn0 = 250.0\n";
    let found = diagnose(&labels_alone(simulated(wear, 90, &[])), &[]).diagnosis;
    assert_eq!(names(&found), ["wear"], "{:?} {:?}", found.unknown, found.hints);
    let depth = &found.effects[0].parameters["depth"];
    assert!(depth.low90 > 0.05 && depth.high90 > 0.8, "{depth:?}");
}

/// Friction in humid heat, in a room that is cold and moist towards the end: a step of friction from there on beside a curve of the humidity is
/// as likely as the temperature beside that curve, and less so once the product of both stands there too.
#[test]
#[ignore = "slow: a campaign"]
fn what_is_tied_may_explain_more_beside_a_curve() {
    let mut measured = labels_alone(simulated("", 75, &[]));
    let mut humidity_pct = Vec::new();
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        let phase = i as f64;
        let (middle, swing) = if i < 60 { (40.0, 17.0) } else { (60.0, 12.0) };
        let humidity = middle + swing * ((2.4 * phase).sin() + 0.5 * (1.1 * phase).cos());
        let degrees = if i < 60 { 22.8 + 0.9 * (0.4 * phase).sin() } else { 19.8 + 0.3 * phase.cos() };
        let (h, t) = ((humidity - 47.0) / 18.0, (degrees - 22.0) / 2.0);
        pull.covariates.temperature_c = degrees;
        pull.covariates.extra.insert("humidity_pct".into(), Drawn::Number(humidity));
        humidity_pct.push(humidity);
        pull.max_pull_force_n *= (0.16 * (0.6 * h + 0.4 * t + 0.5 * h * t - 0.3 * h * h)).exp();
    }
    measured.extra.push(ExtraColumn { name: "humidity_pct".into(), values: Values::Numbers(humidity_pct) });
    let d = diagnose(&measured, &[]).diagnosis;
    assert_eq!(names(&d), ["temperature"], "{d:?}");
    assert!(d.unknown.iter().any(|u| u.covariate == "humidity_pct*temperature_c"), "{:?}", d.unknown);
    let error = d.error.as_ref().unwrap();
    assert!(error.after.rmse_n < error.before.rmse_n.map(|e| 0.4 * e), "{error:?}");
}
