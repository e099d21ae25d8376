//! Campaigns: planned, made on a twin, written, and read as measurements.

use crate::common::{baseline, library, overrides, twin_with_sets};
use gripgen::twin::config::Feedback;
use gripgen::twin::{Campaign, Jaw, PlannedPull, Twin};
use gripgen_cli::{calibrate_twin, detectable_in_campaign, edited_twin, simulate_campaign};
use gripgen_identify::pulls::calibrate::CalibrateRequest;
use gripgen_identify::pulls::detectable::DetectableEffect;
use gripgen_identify::{CampaignOptions, plan_campaign};
use gripgen_measured::{CAMPAIGN_FILE, campaign_toml, read_campaign, write_pull_folder};
use gripgen_measured::{Suspects, load_pulls_with};

/// Without noise and scatter the measurements are those of Coulomb's law.
#[test]
fn a_planned_campaign_is_made_on_the_twin() {
    let options =
        CampaignOptions { parts: vec!["gear".into(), "long_shaft".into()], pulls: 40, ..Default::default() };
    let plan = plan_campaign(&options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(CAMPAIGN_FILE);
    std::fs::write(&file, campaign_toml(&plan, "a test")).unwrap();
    let campaign = read_campaign(&file).unwrap();
    assert_eq!(campaign, plan);
    let quiet = overrides(&[
        ("wrist.noise_n", "0"),
        ("parts.gear.scatter", "0"),
        ("parts.long_shaft.scatter", "0"),
        ("parts.gear.mu", "0.2"),
        ("parts.long_shaft.mu", "0.2"),
        ("robot.lag_s", "0.0"),
        ("robot.dead_time_s", "0.0"),
    ]);
    let made = simulate_campaign(&baseline(), &quiet, &campaign, 5).unwrap();
    assert!(made.notes.is_empty(), "{:?}", made.notes);
    assert_eq!(made.pulls.pulls.len(), 40);
    for pull in &made.pulls.pulls {
        let limit = 2.0 * 0.2 * pull.grip_force_n;
        assert!((pull.max_pull_force_n / limit - 1.0).abs() < 0.02, "{limit}: {}", pull.max_pull_force_n);
        let trace = pull.trace.as_ref().unwrap();
        assert!((trace.time_s[0] + 0.5).abs() < 1e-9 && trace.measured_force_n[0] == 0.0);
        assert!((trace.time_s[1] - trace.time_s[0] - 0.01).abs() < 1e-9);
        assert_eq!(trace.time_s.iter().filter(|t| **t < 0.0).count(), 50);
    }
    let clock: Vec<f64> = made.pulls.pulls.iter().map(|p| p.covariates.time_s).collect();
    assert!(clock.windows(2).all(|t| t[1] > t[0] + 20.0), "{clock:?}");
    assert_eq!(clock.windows(2).filter(|t| t[1] - t[0] > 1500.0).count(), 2, "two pauses");

    let out = folder.path().join("measured");
    write_pull_folder(&out, &made.pulls).unwrap();
    // Without lag and noise the arm swings so that some labels contradict the rows of a thinned trace; here all are read back.
    let loaded = load_pulls_with(&[&out], Suspects::Include).unwrap();
    println!("{:?}", loaded.notes);
    let read = loaded.pulls;
    assert_eq!(read.pulls.len(), made.pulls.pulls.len());
    for (mut read, mut made) in read.pulls.into_iter().zip(made.pulls.pulls) {
        let (a, b) = (read.trace.take().unwrap(), made.trace.take().unwrap());
        assert!(read == made, "{read:?}");
        assert!(a.time_s == b.time_s && a.measured_force_n == b.measured_force_n, "{}", made.id);
        // Millimetres and back cost the last bit.
        assert!(a.displacement_m.iter().zip(&b.displacement_m).all(|(a, b)| (a - b).abs() < 1e-12));
    }
    assert_eq!(read.recorded.len(), 13);
}

#[test]
fn a_simulated_campaign_depends_on_its_seed_and_has_its_effects() {
    let pull = |grip_force_n| PlannedPull { part: "gear".into(), grip_force_n, ..Default::default() };
    let campaign = Campaign {
        label_tolerance_n: 3.0,
        stop_m: 5e-3,
        feedback: Some(Feedback::Independent),
        pulls: (0..6).map(|i| pull(20.0 + 5.0 * f64::from(i))).collect(),
    };
    let made = |pairs: &[(&str, &str)], seed| {
        simulate_campaign(&baseline(), &overrides(pairs), &campaign, seed).unwrap().pulls
    };
    let plain = made(&[], 1);
    assert!(plain == made(&[], 1));
    assert!(plain.pulls != made(&[], 2).pulls);
    assert_eq!(plain.feedback, Some(Feedback::Independent));
    let biased = made(&[("effects", "[{ name = \"sensor_bias\", bias_n = 1.5 }]")], 1);
    let unloaded = |m: &gripgen::twin::MeasuredPulls| {
        let trace = m.pulls[0].trace.as_ref().unwrap();
        trace.measured_force_n[..50].iter().sum::<f64>() / 50.0
    };
    assert!((unloaded(&biased) - unloaded(&plain) - 1.5).abs() < 1e-3, "the same noise, and the bias");
}

/// The twin that is written for a soft gel is as soft as the rig: shear stiffness is fitted as it acts, and a file has that of compliance 1.
#[test]
fn a_soft_gel_is_written_back_as_soft_as_it_is() {
    let sets = overrides(&[("gel.left.compliance", "4.0"), ("gel.left.shear_stiffness_n_per_mm", "24.0")]);
    let pulls = (0..24u32).map(|i| PlannedPull {
        part: "long_shaft".into(),
        grip_force_n: 15.0 + 5.0 * f64::from(i % 6),
        ..Default::default()
    });
    let campaign = Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: pulls.collect() };
    let measured = simulate_campaign(&baseline(), &sets, &campaign, 1).unwrap().pulls;
    let twin = twin_with_sets(&baseline(), &sets);
    let request = CalibrateRequest::default();
    let (_, edits) = calibrate_twin(&measured, &twin, &library(&twin), &request, 2).unwrap();
    let fitted = Twin::new(&edited_twin(&baseline(), &sets, &edits).unwrap()).unwrap();
    for jaw in Jaw::BOTH {
        let (true_n_per_m, found_n_per_m) =
            (twin.gel[jaw].shear_stiffness_n_per_m, fitted.gel[jaw].shear_stiffness_n_per_m);
        assert_eq!(true_n_per_m, 6e3);
        assert!((0.8..1.25).contains(&(found_n_per_m / true_n_per_m)), "{found_n_per_m} N/m");
    }
}

/// Sizes that a plan shows fall with the root of the number of pulls; mu (F + b) and mu (F - loss) are one line, so offset and loss are seen from the
/// same size and look alike; a column that does not vary shows nothing.
#[test]
fn a_plan_says_which_sizes_it_would_show() {
    let seen = |pulls: usize| {
        let options =
            CampaignOptions { parts: vec!["long_shaft".into()], pulls, ..CampaignOptions::default() };
        let campaign = plan_campaign(&options).unwrap();
        detectable_in_campaign(&baseline(), &[], &campaign, 1, 2).unwrap().unwrap()
    };
    let (few, many) = (seen(60), seen(240));
    let size = |all: &[DetectableEffect], name: &str| {
        all.iter().find(|e| e.name == name).and_then(|e| e.seen.as_ref()).map(|s| s.value.abs()).unwrap()
    };
    for name in ["load_offset", "rate_dependence", "dwell_ageing"] {
        let ratio = size(&few, name) / size(&many, name);
        assert!((1.5..2.7).contains(&ratio), "{name}: {ratio}");
    }
    assert!((size(&many, "load_offset") / size(&many, "grip_force_loss") - 1.0).abs() < 0.05, "{many:?}");
    let offset = many.iter().find(|e| e.name == "load_offset").unwrap();
    assert!(offset.alike.contains(&"grip_force_loss") && !offset.alike.contains(&"wear"), "{offset:?}");
    assert!(many.iter().all(|e| e.name != "temperature" && e.name != "off_centre"), "{many:?}");
}

#[test]
fn what_the_twin_does_not_have_is_refused() {
    let pull = PlannedPull { part: "gaer".into(), grip_force_n: 20.0, ..Default::default() };
    let mut campaign = Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: vec![pull] };
    let error = simulate_campaign(&baseline(), &[], &campaign, 1).unwrap_err().to_string();
    assert!(
        error.contains("pulls[0]: the twin has no part `gaer`; its parts: ball_bearing, gear"),
        "{error}"
    );
    campaign.pulls[0] = PlannedPull { part: "gear".into(), grip_force_n: 300.0, ..Default::default() };
    let error = simulate_campaign(&baseline(), &[], &campaign, 1).unwrap_err().to_string();
    assert!(error.contains("300 N per jaw, the gripper has at most 80 N"), "{error}");
}
