//! Diagnoses with a library that lacks the effect that acts.

use crate::diagnose::{diagnose, names, simulated, simulated_at};
use gripgen::twin::MeasuredPulls;
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
