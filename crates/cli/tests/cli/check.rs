//! `gripgen check`, and what `gripgen sweep` says of a configuration.

use super::{QUICKSTART, assert_code, run, sweep_args, text, unmade};

const DRIFT: &str = "effects=[{name=\"sensor_drift\", rate_n_per_h=0.5}]";
const STILL: &str =
    "the twin depends on time_s (effect sensor_drift), this sweep has 0 in every sample: add vary.time_s";
const QUICK: [&str; 6] = ["--set", "mechanics=reduced", "--set", "images=none", "--set", "trace=none"];

/// What a twin depends on and a sweep leaves at one value is said once by both verbs, and stands in the JSON of both.
#[test]
fn a_column_that_the_twin_depends_on_and_the_sweep_leaves_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let with = |more: &[&str]| run(&[&["check", QUICKSTART, "--json"], &QUICK[..], more].concat());
    let check = with(&["--set", DRIFT]);
    assert_code(&check, 0);
    assert_eq!(text(&check.stderr).matches(STILL).count(), 1, "{}", text(&check.stderr));
    let json: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
    assert_eq!(json["warnings"], serde_json::json!([STILL]));
    let varied = with(&["--set", DRIFT, "--set", "vary.time_s=[0, 3600]"]);
    assert_code(&varied, 0);
    assert!(!text(&varied.stderr).contains("depends on"), "{}", text(&varied.stderr));
    let json: serde_json::Value = serde_json::from_slice(&varied.stdout).unwrap();
    assert_eq!(json["warnings"], serde_json::json!([]));

    let out = folder.path().join("run");
    let refused = run(&sweep_args(out.to_str().unwrap(), &[&QUICK[..], &["--set", DRIFT]].concat()));
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains(STILL), "{}", text(&refused.stderr));
    assert!(text(&refused.stderr).contains("--allow-constant") && !out.exists());
    let lines = folder.path().join("lines.json");
    let more = ["--set", DRIFT, "--allow-constant", "--json", lines.to_str().unwrap()];
    let sweep = run(&sweep_args(out.to_str().unwrap(), &[&QUICK[..], &more].concat()));
    assert_code(&sweep, 0);
    assert_eq!(text(&sweep.stderr).matches(STILL).count(), 1, "{}", text(&sweep.stderr));
    let warning = serde_json::json!({"event": "warning", "warning": STILL});
    let lines = std::fs::read_to_string(lines).unwrap();
    let events = lines.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    assert_eq!(events.filter(|event| event["event"] == "warning").collect::<Vec<_>>(), [warning]);
}

/// A grid of another size: the hint works, and so does the example of `--help`.
#[test]
fn a_grid_of_another_size_is_drawn_at_random() {
    let asked = ["check", QUICKSTART, "--set", "samples=12", "--set", "mechanics=reduced"];
    let refused = run(&asked);
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains("--set design=random"), "{}", text(&refused.stderr));
    let drawn = run(&[&asked[..], &["--set", "design=random"]].concat());
    assert_code(&drawn, 0);
    assert!(text(&drawn.stderr).contains("12 samples"), "{}", text(&drawn.stderr));
}

/// With Coulomb friction pose and contact carry nothing, and images are said to be worthless; with friction by pressure they carry
/// something. Shares sum to 1.
#[test]
fn images_that_say_nothing_of_the_label_are_warned_of() {
    let with = |twin: &str| {
        let twin = format!("twin=asset:configs/{twin}.toml");
        let sets =
            ["--set", &twin, "--set", "mechanics=reduced", "--set", "design=random", "--set", "samples=8"];
        let check = run(&[&["check", QUICKSTART, "--json"], &sets[..]].concat());
        assert_code(&check, 0);
        let json: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
        let shares = json["label_shares"]["shares"].as_object().unwrap();
        let of = |name: &str| shares[name].as_f64().unwrap();
        let sum: f64 = shares.values().filter_map(serde_json::Value::as_f64).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{shares:?}");
        let warned = text(&check.stderr).contains("images say nothing of these labels");
        assert!(text(&check.stderr).contains("label variance: grip force "), "{}", text(&check.stderr));
        (of("grip_force"), json["label_shares"]["seen"].as_f64().unwrap(), warned)
    };
    let (force, seen, warned) = with("twin-baseline");
    assert!(force > 0.5 && seen < 0.001 && warned, "{force} {seen}");
    let (_, seen, warned) = with("twin-contact");
    assert!(seen > 0.01 && !warned, "{seen}");
    // Neighbours in a grid share part and force; pairs are drawn from all of it.
    let grid = run(&["check", QUICKSTART, "--json", "--set", "mechanics=reduced"]);
    let json: serde_json::Value = serde_json::from_slice(&grid.stdout).unwrap();
    let seen = json["label_shares"]["seen"].as_f64().unwrap();
    assert!(seen > 0.1, "{seen}");
}

#[test]
fn only_what_varies_is_said_to_vary() {
    let one = ["--set", "vary.part=[\"gear\"]", "--set", "vary.grip_force_n=20"];
    let check = run(&[&["check", QUICKSTART], &QUICK[..], &one].concat());
    assert_code(&check, 0);
    let said = text(&check.stderr);
    assert!(said.contains("varies: grip_angle_deg, grip_offset_mm, grip_pose\n"), "{said}");
}

/// Slips of the hand have a hint that names what was meant.
#[test]
fn a_folder_and_a_key_without_its_section_have_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("my sweep");
    let empty = run(&["sweep", folder.path().to_str().unwrap()]);
    assert_code(&empty, 2);
    assert!(text(&empty.stderr).contains("gripgen init"), "{}", text(&empty.stderr));
    assert_code(&run(&["init", at.to_str().unwrap(), "-q"]), 0);
    for verb in ["check", "sweep"] {
        let refused = run(&[verb, at.to_str().unwrap()]);
        assert_code(&refused, 2);
        let (said, wanted) = (text(&refused.stderr), format!("'{}'", at.join("sweep.toml").display()));
        assert!(said.contains(&wanted), "{said}");
    }
    let twin = at.join("twin.toml");
    let refused = run(&["sweep", twin.to_str().unwrap()]);
    assert_code(&refused, 2);
    assert!(
        text(&refused.stderr).contains("is a key of a twin; the file of a sweep names its twin"),
        "{}",
        text(&refused.stderr)
    );
    let refused = run(&["sweep", QUICKSTART, "--samples", "6"]);
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains("--set samples=VALUE changes it"), "{}", text(&refused.stderr));
    let refused = run(&["check", QUICKSTART, "--set", "grip_force_n=20"]);
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains("vary.grip_force_n"), "{}", text(&refused.stderr));
}

#[test]
fn check_and_dry_run_say_what_it_takes_and_write_nothing() {
    let (_folder, out) = unmade("run");
    let dry = run(&sweep_args(out.to_str().unwrap(), &["--dry-run", "--json"]));
    assert_code(&dry, 0);
    assert!(!out.exists());
    let plan: serde_json::Value = serde_json::from_slice(&dry.stdout).unwrap();
    assert_eq!((&plan["samples"], &plan["shards"]), (&24.into(), &4.into()));
    assert!(plan["estimated_bytes"].as_u64().unwrap() > 24 * 50_000);
    let check = run(&["check", QUICKSTART]);
    assert_code(&check, 0);
    assert!(text(&check.stderr).contains("200 samples") && text(&check.stderr).contains("about"));
    // A sweep whose samples fail is told before it is run.
    let failing = run(&[
        "check",
        QUICKSTART,
        "--set",
        "twin=asset:configs/twin.toml",
        "--set",
        "vary.grip_force_n=[10]",
    ]);
    assert_code(&failing, 4);
    assert!(text(&failing.stderr).contains("20 to 80 N"), "{}", text(&failing.stderr));
}
