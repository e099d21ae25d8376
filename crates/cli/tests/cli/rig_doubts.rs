//! `gripgen rig pull` on a rig whose devices tell half the truth: nothing breaks, and no such label is taken for a good one.

use super::rig_served::Served;
use super::{assert_code, run, text, unmade};
use gripgen::record::{RunFolder, ShardReader};
use std::path::Path;

/// Slow enough that a fault is injected within the step that the test waited for.
const SPEED: [&str; 2] = ["--speed", "5"];
/// Where nothing is injected while a pull is under way.
const FAST: [&str; 2] = ["--speed", "20"];

/// Status and reason of each pull that a folder has.
fn pulls(out: &Path) -> Vec<(String, String)> {
    super::rig_served::pulls(out).into_iter().flatten().collect()
}

/// A pull during which something is said to the rig when it reaches a step; its exit code and what is stored.
fn pulled(
    rig: &mut Served,
    out: &Path,
    step: &str,
    fault: &str,
    again: &[(&str, &str)],
) -> (i32, Vec<(String, String)>, String) {
    let mut pulling = rig.pull(out, 1, &[]);
    pulling.until(&["1/1", step]);
    rig.inject(fault);
    for (step, fault) in again {
        pulling.until(&["1/1", step]);
        rig.inject(fault);
    }
    let code = pulling.ends();
    (code, pulls(out), pulling.said.clone())
}

/// A gripper that holds with another force than it was asked, a pull aside, a mass that is zeroed away and taken off, a camera that dies: kept,
/// suspect with the reason, and the command ends with 4, also when nothing is left to make.
#[test]
fn labels_that_something_contradicts_are_suspect() {
    let folder = tempfile::tempdir().unwrap();
    for (name, step, fault, again, words) in [
        (
            "force",
            ": the way down",
            "reports 8.0",
            &[][..],
            "the gripper reports 4.00 N per jaw, 25.00 N were asked",
        ),
        ("aside", ": grip images", "aside 30", &[], "with the force across it the pull takes"),
        ("mass", ": the way down", "hang 0.3", &[(": grip images", "hang 0")], "the sensor's zero is"),
        ("camera", ": pulling", "refuse camera-left", &[], "the left camera ended during the pull"),
    ] {
        let out = folder.path().join(name);
        let mut rig = Served::start(&SPEED);
        let (code, found, said) = pulled(&mut rig, &out, step, fault, again);
        assert_eq!(code, 4, "{name}: {said}");
        assert_eq!((found.len(), found[0].0.as_str()), (1, "suspect"), "{name}: {found:?}");
        assert!(found[0].1.contains(words), "{name}: {}", found[0].1);
        assert!(said.contains("1 pull with a suspect label"), "{name}: {said}");
        let verified = run(&["verify", out.to_str().unwrap()]);
        assert_code(&verified, 0);
        assert_eq!(
            rig.pull(&out, 1, &[]).ends(),
            4,
            "{name}: nothing is left to make, and the label is as it was"
        );
    }
}

/// What would spoil every pull is refused before anything moves.
#[test]
fn a_rig_that_is_not_as_its_file_says_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut rig = Served::start(&SPEED);
    let place = rig.place();
    rig.inject("slider 0.3");
    while !rig.found("robot").contains("speed slider 30 %") {}
    let (code, _) = rig.check();
    assert_eq!(code, Some(1));
    let mut refused = rig.pull(&folder.path().join("slow"), 1, &[]);
    assert_eq!(refused.ends(), 1);
    assert!(refused.said.contains("speed slider at 30 %"), "{}", refused.said);
    rig.inject("slider 1");
    while !rig.found("robot").contains("speed slider 100 %") {}

    let left = rig.flags.iter().find(|flag| flag.starts_with("cameras.left.port=")).unwrap().clone();
    let right = left.replace("left", "right");
    let mut refused = rig.pull(&folder.path().join("one"), 1, &["--set", &right]);
    assert_eq!(refused.ends(), 1);
    assert!(refused.said.contains("are one camera"), "{}", refused.said);

    let heavy = rig.rig("check", &["--json", "-q", "--set", "robot.payload_kg=2.4"]);
    assert_code(&heavy, 1);
    assert!(text(&heavy.stdout).contains("1.60 kg, 2.40 kg in the rig's file"), "{}", text(&heavy.stdout));
    rig.inject("hang 1.5");
    while !rig.found("force").contains("5 N are allowed") {}
    assert_eq!(rig.check().0, Some(1));
    assert_eq!(rig.place(), place, "nothing moved");
    rig.inject("hang 0");

    let mut refused =
        rig.pull(&folder.path().join("large"), 1, &["--set", "cameras.left.size_px=[640, 480]"]);
    assert_eq!(refused.ends(), 1);
    assert!(refused.said.contains("enlarged to 640 x 480 px"), "{}", refused.said);
}

/// A sign that is not the sensor's is told by its name, and the hint finds it.
#[test]
fn a_wrong_sign_of_the_force_is_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Served::start(&FAST);
    // 25 N slip above the force that a hand is told from, 12 N below it.
    for (name, grip_force_n) in [("strong", "25"), ("weak", "12")] {
        let out = folder.path().join(name);
        let wrong = ["--set", "robot.force_sign=1.0", "--grip-force-n", grip_force_n];
        let mut flags = vec!["--parts", "gear", "-o", out.to_str().unwrap()];
        flags.extend(wrong);
        let refused = rig.rig("pull", &flags);
        assert_code(&refused, 1);
        let said = text(&refused.stderr);
        assert!(
            said.contains("the force reads the wrong way") && said.contains("-1.0 fits this pull"),
            "{said}"
        );
        assert!(said.contains("`gripgen rig check --mass-kg 1.0` finds the sign"), "{said}");
        assert_eq!(pulls(&out)[0].0, "failed");
    }
}

/// The same picture with new stamps is a camera that stands still.
#[test]
fn a_camera_that_repeats_itself_is_frozen() {
    let (_folder, out) = unmade("lab");
    let mut rig = Served::start(&SPEED);
    let (code, found, said) = pulled(&mut rig, &out, ": rest images", "repeat right", &[]);
    assert_eq!(code, 1, "{said}");
    assert_eq!(found[0].0, "failed");
    assert!(
        found[0].1.contains("the right camera is frozen") && found[0].1.contains("byte by byte"),
        "{found:?}"
    );
    // It is made again; what failed is kept with its reason.
    rig.inject("thaw right");
    assert_eq!(rig.pull(&out, 1, &[]).ends(), 0);
    assert_eq!(pulls(&out), [("slipped".to_string(), String::new())]);
    let kept = std::fs::read_to_string(out.join("failed/shard-00000-1.json")).unwrap();
    assert!(kept.contains("the right camera is frozen"), "{kept}");
    let (sample, _) = ShardReader::open(&out.join("failed/shard-00000-1.mcap")).unwrap().pull(0).unwrap();
    assert!(sample.failure.contains("byte by byte"));
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);
}

/// Label of the first pull of a folder.
fn label_n(out: &Path) -> f64 {
    let folder = RunFolder::open(out).unwrap();
    let (sample, _) = ShardReader::open(&folder.shard_path(0)).unwrap().pull(0).unwrap();
    sample.max_pull_force_n.unwrap()
}

/// A force that trails is never a plain label that is off.
#[test]
fn a_lag_is_suspect() {
    let folder = tempfile::tempdir().unwrap();
    let mut rig = Served::start(&FAST);
    for lag in ["force-lag", "sensor-lag"] {
        rig.inject(&format!("{lag} 0.35"));
        let out = folder.path().join(lag);
        let code = rig.pull(&out, 1, &[]).ends();
        assert_eq!((code, pulls(&out)[0].0.as_str()), (4, "suspect"), "{lag}: {:?}", pulls(&out));
        rig.inject(&format!("{lag} 0"));
    }
}

/// What trails the command in the file of a rehearsal: the force and the displacement, s.
fn trails_s(stored: &Path) -> [f64; 2] {
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(stored).unwrap()).unwrap();
    let response = &found["rehearsal"]["response"];
    ["force", "displacement"].map(|of| {
        let s = |key: &str| response[of][key].as_f64().unwrap();
        s("lag_s") + s("dead_s")
    })
}

/// Rehearsed, the staircase is slow enough to be followed, and the label is that of a rig without lag.
#[test]
fn a_lag_is_rehearsed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut rig = Served::start(&FAST);
    let true_n = {
        assert_eq!(rig.pull(&path("true"), 1, &[]).ends(), 0);
        label_n(&path("true"))
    };
    let rehearse = |rig: &mut Served, name: &str| {
        let stored = path(name);
        let page = rig.rig("rehearse", &["--dwell-s", "1", "-o", stored.to_str().unwrap()]);
        assert_code(&page, 0);
        (trails_s(&stored), text(&page.stdout))
    };
    // The plant's own force mode trails too.
    let ([own_force_s, own_tool_s], _) = rehearse(&mut rig, "own.json");
    for lag in ["force-lag", "sensor-lag"] {
        rig.inject(&format!("{lag} 0.35"));
        let stored = format!("{lag}.json");
        let ([force_s, tool_s], page) = rehearse(&mut rig, &stored);
        // Two lags in series are read up to a tenth too long.
        assert!((force_s - own_force_s - 0.35).abs() < 0.06, "{lag}: {force_s} s, {own_force_s} s without");
        let of_the_loop_s = if lag == "force-lag" { 0.35 } else { 0.0 };
        let more_s = tool_s - own_tool_s;
        assert!((more_s - of_the_loop_s).abs() < 0.06, "{lag}: {tool_s} s, {own_tool_s} s without");
        assert!(page.contains("staircase"), "{page}");
        let stored = path(&stored);
        let stored = stored.to_str().unwrap();
        let out = path(&format!("{lag}-slow"));
        let mut slow = rig.pull(&out, 1, &["--rehearsal", stored]);
        let code = slow.ends();
        assert!(slow.said.contains("staircases are slowed"), "{}", slow.said);
        assert_eq!((code, pulls(&out)[0].0.as_str()), (0, "slipped"), "{lag}: {:?}", pulls(&out));
        let kept = |name: &str| name.starts_with("rehearsal-") && name.ends_with(".json");
        let names = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name());
        assert_eq!(names.filter(|name| kept(&name.to_string_lossy())).count(), 1);
        let off_n = label_n(&out) - true_n;
        assert!(off_n.abs() < 1.0, "{lag}: {} N, without lag {true_n} N", label_n(&out));
        rig.inject(&format!("{lag} 0"));
    }
}
