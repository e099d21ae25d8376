//! Measured pulls from every place they may be in.

use crate::common::{jobs, run, small_project};
use gripgen::record::ShardReader;
use gripgen::twin::config::Feedback;
use gripgen_measured::{Suspects, load_pulls, load_pulls_with};

#[test]
fn a_run_folder_is_a_campaign() {
    let project = small_project(&[
        "vary.grip_force_n=[10, 20, 30]",
        "images=none",
        "vary.session=[\"a\", \"b\"]",
        "vary.parts.gear.mu=[0.1, 0.2]",
    ]);
    let folder = tempfile::tempdir().unwrap();
    let summary = run(&project, folder.path(), jobs(2));
    let loaded = load_pulls(folder.path()).unwrap();
    let failed = summary.failed;
    assert_eq!(loaded.pulls.pulls.len() as u64, summary.samples - failed);
    assert!(failed > 0, "10 N lie outside the fit of every part");
    assert_eq!(loaded.notes[0], format!("{failed} pulls were left out: they failed"));
    assert!(loaded.notes[1].starts_with("traces of 24 of 32 pulls are used"), "{:?}", loaded.notes);
    assert!(loaded.pulls.extra.is_empty(), "an experiment does not know the drawn coefficient");
    assert_eq!(loaded.pulls.feedback, Some(Feedback::Measured));
    assert_eq!((loaded.pulls.label_tolerance_n, loaded.pulls.stop_m), (3.0, 5e-3));
    let pull = &loaded.pulls.pulls[0];
    let index: u64 = pull.id.parse().unwrap();
    let shard = folder.path().join(format!("shard-{:05}.mcap", index / 5));
    let record = ShardReader::open(&shard).unwrap().record(index).unwrap();
    assert_eq!(Some(pull.max_pull_force_n), record.sample.max_pull_force_n);
    assert_eq!((&pull.part, &pull.covariates.session), (&record.sample.part, &record.sample.session));
    // One reading in five of the stored trace.
    let (used, stored) = (pull.trace.as_ref().unwrap(), record.trace.unwrap());
    assert!(used.rows().eq(stored.rows().step_by(5)), "{} rows of {}", used.len(), stored.len());
    assert!((pull.covariates.grip_angle_rad - 30f64.to_radians()).abs() < 1e-12);
}

#[test]
fn a_run_without_a_slip_says_why() {
    let project = small_project(&["vary.grip_force_n=[10]", "images=none"]);
    let folder = tempfile::tempdir().unwrap();
    run(&project, folder.path(), jobs(1));
    let error = load_pulls(folder.path()).unwrap_err().to_string();
    assert!(error.contains("no pull of this run can be used: 4 pulls were left out: they failed"), "{error}");
}

#[test]
fn a_folder_with_neither_names_the_table() {
    let error = load_pulls(tempfile::tempdir().unwrap().path()).unwrap_err().to_string();
    assert!(error.contains("pulls.csv"), "{error}");
}

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn the_shared_campaigns_are_read() {
    for (name, pulls, traces, extra) in
        [("a", 80, 80, 0), ("b", 110, 28, 0), ("c", 220, 55, 0), ("d", 84, 21, 0), ("f", 110, 28, 1)]
    {
        let folder = crate::common::root().join(format!("../shared/measured/lab-{name}"));
        let loaded = load_pulls_with(&[&folder], Suspects::Include).unwrap().pulls;
        let traced = loaded.pulls.iter().filter(|p| p.trace.is_some()).count();
        assert_eq!((loaded.pulls.len(), traced, loaded.extra.len()), (pulls, traces, extra), "{name}");
        assert_eq!(loaded.recorded.len(), 13);
        assert_eq!(loaded.feedback, Some(Feedback::Independent));
        // The label is a force of the trace, which is stored at a fifth of the rate it was taken at.
        for pull in loaded.pulls.iter().filter(|p| p.trace.is_some()) {
            let trace = pull.trace.as_ref().unwrap();
            let near = trace.measured_force_n.iter().map(|f| (f - pull.max_pull_force_n).abs());
            assert!(near.fold(f64::INFINITY, f64::min) < 0.6, "{name} {}", pull.id);
        }
    }
}
