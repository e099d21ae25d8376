//! Diagnoses with a library that lacks the effect that acts.

use crate::diagnose::{diagnose, names, simulated, simulated_at, simulated_parts};
use gripgen::twin::draw::Drawn;
use gripgen::twin::{ExtraColumn, MeasuredPulls, Values};
use gripgen_identify::{CampaignOptions, Verdict};

/// Effects taken out of the library one at a time: what they did comes back as a dependence on the right column, and not
/// under another name.
#[test]
fn an_effect_that_the_library_lacks_comes_back_as_its_covariate() {
    lacking("anisotropy", "amplitude = 0.12\naxis_deg = 20.0", &["grip_angle_deg"]);
    // The planner does not heat: a temperature is made up, and labels fall by 2 % per kelvin.
    let mut measured = simulated("", 90, &[]);
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        let degrees = 23.0 + 4.0 * (i as f64 * 0.7).sin();
        pull.covariates.temperature_c = degrees;
        pull.max_pull_force_n *= 1.0 - 0.02 * (degrees - 23.0);
        pull.trace = None;
    }
    comes_back(&measured, "temperature", &["temperature_c"]);
}

/// The same of more effects.
#[test]
#[ignore = "slow: a campaign"]
fn more_effects_that_the_library_lacks_come_back_as_their_covariates() {
    lacking("off_centre", "inverse_lever_per_mm = 0.1", &["grip_offset_mm"]);
    let rate = ["force_increment_n", "step_time_s", "force_increment_n*step_time_s"];
    lacking("rate_dependence", "k = 0.08", &rate);
}

/// One operator of three grips one part of three 15 % weaker: neither acts alone.
#[test]
fn what_one_operator_does_to_one_part_is_their_product() {
    let parts = ["gear", "long_shaft", "ball_bearing"].map(String::from).to_vec();
    let mut measured = simulated_parts(parts, 108);
    let words: Vec<String> =
        (0..measured.pulls.len()).map(|i| ["anna", "ben", "cem"][(i * 7 + i / 5) % 3].into()).collect();
    for (pull, word) in measured.pulls.iter_mut().zip(&words) {
        pull.trace = None;
        if word == "cem" && pull.part == "gear" {
            pull.max_pull_force_n *= 0.85;
        }
        pull.covariates.extra.insert("operator".into(), Drawn::Text(word.clone()));
    }
    measured.extra = vec![ExtraColumn { name: "operator".into(), values: Values::Words(words) }];
    let found = diagnose(&measured, &[]).diagnosis;
    let unknown: Vec<&str> = found.unknown.iter().map(|u| u.covariate.as_str()).collect();
    assert_eq!((names(&found), unknown), (vec![], vec!["operator*part"]), "{:?}", found.notes);
}

/// The zero drifts by 3 N/h and is set anew at the start of each of three sessions.
#[test]
fn a_zero_that_each_session_sets_anew_is_not_a_drift_of_the_campaign() {
    let effect = "[[effects]]\nname = \"session_zero_drift\"\nrate_n_per_h = 3.0\n";
    let mut measured = simulated(effect, 90, &[]);
    measured.pulls.iter_mut().for_each(|pull| pull.trace = None);
    let found = diagnose(&measured, &[]).diagnosis;
    assert_eq!(names(&found), ["session_zero_drift"]);
    let rate = &found.effects[0].parameters["rate_n_per_h"];
    assert!(rate.low90 < 3.0 && 3.0 < rate.high90, "{rate:?}");
}

/// Without traces a law of the load and the noise of readings look alike at small forces. The friction is 2 mu (F + 3 N), the noise that of the
/// twin.
#[test]
#[ignore = "slow: a campaign"]
fn a_law_of_the_load_is_not_taken_for_noise() {
    let mut measured = simulated("[[effects]]\nname = \"load_offset\"\nb_n = 3.0\n", 90, &[]);
    measured.pulls.iter_mut().for_each(|pull| pull.trace = None);
    let found = diagnose(&measured, &[]).diagnosis;
    let first = found.effects.first().map(|e| e.name.as_str());
    let tied = ["load_offset", "grip_force_loss", "sensor_bias", "load_power_law"];
    assert!(first.is_some_and(|name| tied.contains(&name)), "{:?} {:?}", names(&found), found.notes);
}

/// One effect, in pulls at several angles and places.
fn lacking(id: &str, values: &str, columns: &[&str]) {
    let effect = format!("[[effects]]\nname = \"{id}\"\n{values}\n");
    let places = CampaignOptions {
        angles_deg: vec![0.0, 30.0, 60.0, 90.0],
        offsets_mm: vec![0.0, 2.0, 4.0],
        ..Default::default()
    };
    comes_back(&simulated_at(&effect, 90, &[], places), id, columns);
}

/// With the whole library the effect has its name, without it its column.
fn comes_back(measured: &MeasuredPulls, id: &str, columns: &[&str]) {
    let known = diagnose(measured, &[]).diagnosis;
    assert_eq!(names(&known).first(), Some(&id), "{id}: {:?} {:?}", names(&known), known.unknown);
    let d = diagnose(measured, &[id]).diagnosis;
    let first = d.unknown.first().map(|u| u.covariate.as_str());
    assert!(
        d.verdict == Verdict::Unknown && first.is_some_and(|c| columns.contains(&c)),
        "{id}: {:?} {:?}",
        names(&d),
        d.unknown
    );
}
