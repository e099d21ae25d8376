//! Runs of a rig, from a campaign that a twin made: what reads sweeps reads them too.

use crate::common::baseline;
use gripgen::record::{
    Dataset, ExportDatasetError, ExportOptions, RigLog, RigPull, RigResult, RigRunInfo, RigStream, RunFolder,
    Verification, create_rig_run, decode_picture, discard_failed, export_parquet, missing_pulls, verify,
    write_rig_pull,
};
use gripgen::twin::config::{Feedback, Mechanics};
use gripgen::twin::draw::Drawn;
use gripgen::twin::{
    Campaign, MeasuredPull, Outcome, PerJaw, PlannedPull, Scenario, SlipLabel, TactileImage, Values,
    slip_label,
};
use gripgen::{Draw, Simulator};
use gripgen_cli::{
    PullDiagnoseOptions, calibrate_imprints, compare_pulls, diagnose_pull_table, simulate_campaign,
};
use gripgen_measured::load_pulls;
use gripgen_report::{contact_sheet, contact_sheet_samples, sample_picture};
use std::collections::BTreeMap;
use std::path::Path;

/// Grey levels of dirt on both gels: far more than a press changes.
const DIRT: i32 = 40;
/// The imprint constant that the images are made with; the shipped twin has another.
const IMPRINT_MM3_PER_N: f64 = 2.3;

fn campaign() -> Campaign {
    let pull = |i: u32| PlannedPull {
        part: if i.is_multiple_of(2) { "gear".into() } else { "long_shaft".into() },
        grip_force_n: 14.0 + 5.0 * f64::from(i),
        session: if i < 4 { "a".into() } else { "b".into() },
        pause_s: if i == 4 { 1500.0 } else { 0.0 },
        ..Default::default()
    };
    Campaign {
        label_tolerance_n: 3.0,
        stop_m: 5e-3,
        feedback: Some(Feedback::Measured),
        pulls: (0..8).map(pull).collect(),
    }
}

/// The campaign as a rig would have measured it: traces and labels of the twin, its images with dirt on the gels.
struct Fake {
    pulls: Vec<RigPull>,
    made: Vec<MeasuredPull>,
}

fn fake(images: bool) -> Fake {
    let made = simulate_campaign(&baseline(), &[], &campaign(), 3).unwrap().pulls.pulls;
    assert_eq!(made.len(), 8);
    let soft = |part: &str| (format!("parts.{part}.imprint_mm3_per_n"), IMPRINT_MM3_PER_N.to_string());
    let sets = [soft("gear"), soft("long_shaft")];
    let twin = Simulator::open(&baseline(), &sets, Mechanics::Reduced, true).unwrap();
    let pulls = made.iter().enumerate().map(|(i, pull)| rig_pull(&twin, i as u64, pull, images)).collect();
    Fake { pulls, made }
}

fn rig_pull(twin: &Simulator, index: u64, made: &MeasuredPull, images: bool) -> RigPull {
    let values = BTreeMap::from([
        ("part".to_string(), Drawn::Text(made.part.clone())),
        ("grip_force_n".to_string(), Drawn::Number(made.grip_force_n)),
    ]);
    let sample = twin.pull(&values, Draw { seed: 5, index }, images, false).unwrap();
    let Outcome::Pulled(pulled) = sample.outcome else { panic!("{:?}", sample.outcome) };
    let sensors = &twin.twin().optics;
    let rest = images.then(|| {
        PerJaw::from_fn(|jaw| {
            let sensor = twin.project().library.sensor(&sensors[jaw]).unwrap();
            let rgb = (0..3 * sensor.grid.len()).map(|i| sensor.rest[i % 3][i / 3].round() as u8).collect();
            dirty(&TactileImage {
                width_px: sensor.grid.width_px as u32,
                height_px: sensor.grid.height_px as u32,
                rgb,
            })
        })
    });
    let trace = made.trace.clone().unwrap();
    let slip_time_s = slip_label(&trace, 3.0, true).unwrap().slip_time_s;
    let label = SlipLabel { slip_time_s, max_pull_force_n: made.max_pull_force_n, censored: false };
    let stream = RigStream { name: "robot".into(), host_time_s: trace.time_s.clone(), ..Default::default() };
    let mut pull = sample.scenario.pull.clone();
    (pull.increment_n, pull.step_s, pull.stop_m) = (made.increment_n, made.step_s, 5e-3);
    let scenario = Scenario {
        seed: 0,
        index,
        group: index,
        repetition: 0,
        part: made.part.clone(),
        grip_pose: 0,
        grip_force_n: made.grip_force_n,
        covariates: made.covariates.clone(),
        pull,
        drawn: BTreeMap::from([
            ("humidity_pct".to_string(), Drawn::Number(40.0 + index as f64)),
            ("operator".to_string(), Drawn::Text("ann".into())),
        ]),
    };
    let grip = pulled.images.map(|both| PerJaw { left: dirty(&both.left), right: dirty(&both.right) });
    RigPull {
        scenario,
        result: RigResult::Slipped { label },
        images: grip,
        rest,
        trace: Some(trace),
        film: None,
        log: RigLog { streams: vec![stream], events: vec![] },
    }
}

/// Stripes of dirt, the same in both images of a pull.
fn dirty(image: &TactileImage) -> TactileImage {
    let stripe = |i: usize| if (i / 3 / 16).is_multiple_of(2) { DIRT } else { 0 };
    let rgb = image.rgb.iter().enumerate();
    let rgb = rgb.map(|(i, &v)| (i32::from(v) - stripe(i)).clamp(0, 255) as u8).collect();
    TactileImage { rgb, ..*image }
}

fn create(path: &Path) -> RunFolder {
    let recorded =
        "recorded = [\"grip_force_n\", \"part\", \"session\", \"time_s\", \"pull_index\", \"humidity_pct\"]";
    let config_toml = format!("[rig]\nrobot = \"lab\"\n[campaign]\nfeedback = \"independent\"\n{recorded}\n");
    let info = RigRunInfo { name: "lab".into(), gripgen_version: "0".into(), config_toml, pulls: 8 };
    create_rig_run(path, &info).unwrap()
}

#[test]
fn a_rig_run_is_a_campaign_that_was_measured() {
    let at = tempfile::tempdir().unwrap();
    let folder = create(at.path());
    let Fake { mut pulls, made } = fake(false);
    let whole = pulls.clone();
    pulls[0].result = RigResult::Failed { reason: "the robot stopped".into() };
    let RigResult::Slipped { label } = pulls[5].result else { panic!("it slipped") };
    pulls[5].result = RigResult::Censored { label };
    for pull in &pulls[..7] {
        write_rig_pull(&folder, pull).unwrap();
    }
    let loaded = load_pulls(at.path()).unwrap();
    let left_out =
        ["failed", "ended before the jaws slipped"].map(|w| format!("1 pulls were left out: they {w}"));
    assert_eq!(loaded.notes[..2], left_out);
    assert_eq!(loaded.notes[2..], ["1 pulls of the campaign are not made yet"]);
    let measured = loaded.pulls;
    assert_eq!(measured.feedback, Some(Feedback::Independent));
    assert_eq!(measured.recorded, ["part", "grip_force_n", "session", "pull_index", "time_s"]);
    assert_eq!((measured.label_tolerance_n, measured.stop_m), (3.0, 5e-3));
    let ids: Vec<&str> = measured.pulls.iter().map(|p| p.id.as_str()).collect();
    assert_eq!(ids, ["1", "2", "3", "4", "6"]);
    for found in &measured.pulls {
        let made = &made[found.id.parse::<usize>().unwrap()];
        assert_eq!((&found.part, found.max_pull_force_n), (&made.part, made.max_pull_force_n));
        let (c, wanted) = (&found.covariates, &made.covariates);
        assert_eq!((&c.session, c.time_s, c.pull_index), (&wanted.session, wanted.time_s, wanted.pull_index));
        let (trace, wanted) = (found.trace.as_ref().unwrap(), made.trace.as_ref().unwrap());
        assert_eq!(trace.time_s, wanted.time_s, "the reading without a load keeps its times");
        let close = |a: &f64, b: &f64| (a - b).abs() < 1e-5;
        assert!(trace.measured_force_n.iter().zip(&wanted.measured_force_n).all(|(a, b)| close(a, b)));
    }
    let names: Vec<&str> = measured.extra.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["humidity_pct", "operator"]);
    assert_eq!(measured.extra[0].values, Values::Numbers(vec![41.0, 42.0, 43.0, 44.0, 46.0]));
    assert_eq!(measured.extra[1].values, Values::Words(vec!["ann".into(); 5]));
    assert_eq!(measured.pulls[3].covariates.extra["pulls_since_rest"], Drawn::Number(0.0), "a new session");

    // The one that failed is made again, after the others.
    assert!(discard_failed(&folder, 0).unwrap());
    assert_eq!(missing_pulls(&folder).unwrap(), [0, 7]);
    let mut again = whole[0].clone();
    (again.scenario.covariates.time_s, again.scenario.covariates.pull_index) = (9000.0, 7);
    write_rig_pull(&folder, &again).unwrap();
    let loaded = load_pulls(at.path()).unwrap();
    assert_eq!(loaded.pulls.pulls.last().unwrap().id, "0", "in the order in which they were made");
    assert_eq!(loaded.pulls.extra[0].values, Values::Numbers(vec![41.0, 42.0, 43.0, 44.0, 46.0, 40.0]));
}

/// The dirt stands in the recorded rest frames and not in that of the sensor file.
#[test]
fn imprint_constants_come_from_the_recorded_rest_frames() {
    let at = tempfile::tempdir().unwrap();
    let folder = create(at.path());
    let Fake { pulls, .. } = fake(true);
    // Not all of them: what is there is enough.
    pulls.iter().skip(1).for_each(|pull| drop(write_rig_pull(&folder, pull).unwrap()));
    let measured = load_pulls(at.path()).unwrap().pulls;
    let found = calibrate_imprints(at.path(), &measured, &baseline(), &[]).unwrap();
    assert_eq!(found.parts.len(), 2, "{:?}", found.notes);
    for part in &found.parts {
        let c = &part.estimate.imprint_mm3_per_n;
        assert!((c.value / IMPRINT_MM3_PER_N - 1.0).abs() < 0.02, "{}: {c:?}", part.part);
        assert!(part.explained > 0.8, "{}: {}", part.part, part.explained);
    }

    let other = tempfile::tempdir().unwrap();
    let folder = create(other.path());
    for pull in pulls {
        write_rig_pull(&folder, &RigPull { rest: None, ..pull }).unwrap();
    }
    let found = calibrate_imprints(other.path(), &measured, &baseline(), &[]).unwrap();
    assert!(found.parts.iter().all(|part| part.explained < 0.6), "dirt is no press: {found:?}");
    assert!(found.notes.iter().any(|n| n.contains("do not look like")), "{:?}", found.notes);
}

/// Everything that reads a sweep, on a campaign that was interrupted and on one that is done.
#[test]
fn an_unfinished_rig_run_is_read_like_any_other() {
    let at = tempfile::tempdir().unwrap();
    let folder = create(at.path());
    let Fake { mut pulls, .. } = fake(true);
    pulls[2] = RigPull {
        result: RigResult::Failed { reason: "no image within 2 s".into() },
        images: None,
        rest: None,
        trace: None,
        log: RigLog::default(),
        ..pulls[2].clone()
    };
    for pull in pulls.iter().take(6) {
        write_rig_pull(&folder, pull).unwrap();
    }
    // Killed in the middle of the next one.
    let whole = std::fs::read(folder.shard_path(5)).unwrap();
    std::fs::write(at.path().join("shard-00006.mcap.partial"), &whole[..whole.len() / 3]).unwrap();
    assert!(!folder.write_index().unwrap());
    check(at.path(), &folder, &pulls, 6);
    for pull in pulls.iter().skip(6) {
        write_rig_pull(&folder, pull).unwrap();
    }
    assert!(folder.write_index().unwrap());
    check(at.path(), &folder, &pulls, 8);
    let index = std::fs::read_to_string(at.path().join("index.csv")).unwrap();
    assert_eq!(index.lines().count(), 9);
    assert!(index.lines().next().unwrap().ends_with("failure,humidity_pct"), "{index}");
}

fn check(path: &Path, folder: &RunFolder, pulls: &[RigPull], made: usize) {
    let checked = verify(path, |_| {}).unwrap();
    let wanted = Verification {
        good_shards: made as u64,
        missing_shards: 8 - made as u64,
        samples: made as u64,
        faults: vec![],
        ..Verification::default()
    };
    assert_eq!(checked, wanted);
    let rows = Dataset::open(path).unwrap();
    assert_eq!((rows.table().rows(), rows.image_size_px()), (made, Some((320, 240))));
    assert!(rows.table().numbers("mu_effective").unwrap().iter().all(|x| x.is_nan()));
    assert_eq!(rows.table().words("failure").unwrap()[2], "no image within 2 s");
    for (row, pull) in pulls.iter().take(made).enumerate() {
        assert_eq!(rows.record(row).unwrap().unwrap().images, pull.images, "pull {row}");
        assert_eq!(rows.rest(row).unwrap(), pull.rest, "pull {row}");
    }
    let exported = |images| -> Result<usize, ExportDatasetError> {
        let (mut out, mut last) = (Vec::new(), 0);
        export_parquet(&rows, ExportOptions { images, traces: true }, &mut out, |n| last = n)?;
        assert_eq!((last, &out[..4]), (made, &b"PAR1"[..]));
        Ok(out.len())
    };
    let raw = 4 * 3 * 320 * 240;
    assert!(exported(true).unwrap() > exported(false).unwrap() + raw, "images, gripped and at rest");

    let size = |png: Vec<u8>| {
        let picture = decode_picture(&png).unwrap();
        (picture.width_px, picture.height_px)
    };
    // Three images per jaw and no heights, also of the pull that failed.
    for pull in [1, 2] {
        assert_eq!(size(sample_picture(folder, pull, || None).unwrap()).0, 3 * 416 + 16);
    }
    assert_eq!(contact_sheet_samples(folder).unwrap().len(), made);
    assert!(size(contact_sheet(folder).unwrap()).0 > 1000);

    let measured = load_pulls(path).unwrap().pulls;
    let twin = Simulator::open(&baseline(), &[], Mechanics::Reduced, false).unwrap();
    let compared = compare_pulls(&measured, twin.twin(), &twin.project().library, 2).unwrap();
    assert_eq!((compared.pulls.n, measured.pulls.len()), (made - 1, made - 1));
    let options = PullDiagnoseOptions { jobs: 2, ..PullDiagnoseOptions::default() };
    let found =
        diagnose_pull_table(&measured, twin.twin(), &twin.project().library, &options, &|_| {}).unwrap();
    assert_eq!(found.diagnosis.data.pulls, Some(made - 1));
}
