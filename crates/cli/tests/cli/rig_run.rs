//! Runs of a rig: what the verbs for run folders say of them.

use super::{assert_code, gripgen, run, text};
use gripgen::record::{RigLog, RigPull, RigResult, RigRunInfo, RunFolder, create_rig_run, write_rig_pull};
use gripgen::twin::{Covariates, PerJaw, PullSettings, PullTrace, Scenario, SlipLabel, TactileImage};
use std::collections::BTreeMap;
use std::path::Path;

/// Three pulls of a gear; of the last one there is no shard.
fn unfinished(path: &Path) -> RunFolder {
    let config_toml = "[rig]\n[campaign]\n".into();
    let info = RigRunInfo { name: "lab".into(), gripgen_version: "0".into(), config_toml, pulls: 3 };
    let folder = create_rig_run(path, &info).unwrap();
    let label = SlipLabel { slip_time_s: 0.2, max_pull_force_n: 6.5, censored: false };
    write_rig_pull(&folder, &pull(0, RigResult::Slipped { label })).unwrap();
    write_rig_pull(&folder, &pull(1, RigResult::Failed { reason: "no contact with the robot".into() }))
        .unwrap();
    folder
}

fn pull(index: u64, result: RigResult) -> RigPull {
    let settings = PullSettings {
        increment_n: 1.0,
        start_n: None,
        step_s: 0.1,
        step_jitter: 0.0,
        stop_m: 5e-3,
        direction: [0.0, 0.0, 1.0],
        max_force_n: None,
        max_time_s: 60.0,
        label_tolerance_n: 3.0,
    };
    let scenario = Scenario {
        seed: 0,
        index,
        group: index,
        repetition: 0,
        part: "gear".into(),
        grip_pose: 0,
        grip_force_n: 20.0,
        covariates: Covariates::default(),
        pull: settings,
        drawn: BTreeMap::new(),
    };
    let image = |level| TactileImage { width_px: 8, height_px: 6, rgb: vec![level; 144] };
    let trace = PullTrace {
        time_s: vec![-0.1, 0.0, 0.2, 0.3],
        desired_force_n: vec![0.0, 3.0, 7.0, 8.0],
        measured_force_n: vec![0.0, 3.0, 6.5, 2.0],
        displacement_m: vec![0.0, 0.0, 1e-4, 6e-3],
    };
    RigPull {
        scenario,
        result,
        images: Some(PerJaw { left: image(90), right: image(95) }),
        rest: Some(PerJaw { left: image(60), right: image(61) }),
        trace: Some(trace),
        film: None,
        log: RigLog::default(),
    }
}

#[test]
fn an_unfinished_run_of_a_rig_is_told_and_shown() {
    let temporary = tempfile::tempdir().unwrap();
    let at = temporary.path().join("lab");
    let folder = unfinished(&at);
    let path = at.to_str().unwrap();
    let info = run(&["info", path]);
    assert_code(&info, 0);
    let said = text(&info.stdout);
    assert!(said.starts_with("lab (rig), "), "{said}");
    assert!(said.contains("2 of 3 pulls, 1 missing, 1 failed, "), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&run(&["info", path, "--json"]).stdout).unwrap();
    let counts = ["samples", "done", "missing", "failed"].map(|key| json[key].as_u64().unwrap());
    assert_eq!((json["source"].as_str().unwrap(), counts), ("rig", [3, 2, 1, 1]));

    let verified = run(&["verify", path]);
    assert_code(&verified, 0);
    assert_eq!(text(&verified.stdout), "ok: 2 shards, 2 samples, 1 shard not made yet\n");
    for (arguments, file) in
        [(vec!["show", path], "contact-sheet.png"), (vec!["show", path, "1"], "sample-000001.png")]
    {
        assert_code(&run(&arguments), 0);
        assert!(at.join(file).exists(), "{file}");
    }
    let out = at.join("all.parquet");
    assert_code(&gripgen().args(["export", path, "--to", "parquet", "-o"]).arg(&out).output().unwrap(), 0);
    assert!(std::fs::read(out).unwrap().starts_with(b"PAR1"));
    let missing = run(&["export", path, "--sample", "2", "-o", at.join("one.mcap").to_str().unwrap()]);
    assert_code(&missing, 1);
    assert!(text(&missing.stderr).contains("hint: run the campaign again"), "{}", text(&missing.stderr));

    // A shard whose writer died before its sidecar.
    std::fs::remove_file(folder.sidecar_path(0)).unwrap();
    let verified = run(&["verify", path]);
    assert_code(&verified, 5);
    assert!(text(&verified.stderr).contains("has no sidecar; running the campaign again makes it anew"));
    assert!(text(&run(&["info", path]).stdout).contains("1 of 3 pulls, 2 missing, 1 failed, "));
}
