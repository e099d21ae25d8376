//! `gripgen rig pull` when something goes wrong in the middle: what it says, what it leaves, and that it goes on.

use super::rig_served::{PATIENCE, Served, pulls};
use super::{assert_code, run, text, unmade};
use gripgen::record::{RunFolder, ShardReader};
use std::path::Path;
use std::time::{Duration, Instant};

/// Slow enough that a fault is injected within the step that the test waited for.
const SPEED: [&str; 2] = ["--speed", "5"];

fn statuses(out: &Path) -> Vec<String> {
    pulls(out).into_iter().map(|pull| pull.map_or("missing".into(), |(status, _)| status)).collect()
}

/// Counts of `gripgen info`: done, missing, failed. And `verify` finds nothing wrong.
#[track_caller]
fn assert_counts(out: &Path, counts: [u64; 3]) {
    let info = run(&["info", out.to_str().unwrap(), "--json"]);
    assert_code(&info, 0);
    let json: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!(["done", "missing", "failed"].map(|key| json[key].as_u64().unwrap()), counts, "{json}");
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);
}

/// A pull that is stopped is over by then, in seconds of the rig's own clock: no busy machine makes that go faster.
const LONGEST_S: f64 = 20.0;

/// How long the rig went on after its safety mode was no more `NORMAL`, by its own clock.
fn stopped_after_s(out: &Path, pull: u64) -> f64 {
    let folder = RunFolder::open(out).unwrap();
    let log = ShardReader::open(&folder.shard_path(pull)).unwrap().rig_log(pull).unwrap();
    let robot = log.streams.iter().find(|stream| stream.name == "robot").unwrap();
    let (_, safety) = robot.columns.iter().find(|(name, _)| name == "safety_mode").unwrap();
    let stopped = safety.iter().position(|mode| *mode != 1.0).expect("the stop was seen");
    robot.device_time_s.last().unwrap() - robot.device_time_s[stopped]
}

#[test]
fn an_emergency_stop_fails_one_pull_and_the_same_command_finishes_the_campaign() {
    let (_folder, out) = unmade("lab");
    let mut rig = Served::start(&SPEED);
    let mut pulling = rig.pull(&out, 3, &[]);
    pulling.until(&["2/3", ": pulling"]);
    rig.inject("estop");
    pulling.ends_with(1);
    let said = &pulling.said;
    assert!(
        said.contains("ROBOT_EMERGENCY_STOP; the robot stands still, the gripper keeps what it holds"),
        "{said}"
    );
    assert_eq!(statuses(&out), ["slipped", "failed", "missing"], "{said}");
    let after_s = stopped_after_s(&out, 1);
    assert!(after_s < LONGEST_S, "{after_s} s");
    let failure = pulls(&out).remove(1).unwrap().1;
    assert_eq!(failure, "the robot is in ROBOT_EMERGENCY_STOP");
    assert_counts(&out, [2, 1, 1]);

    // The button is still pressed; then it is released, and nobody has allowed power.
    let mut refused = rig.pull(&out, 3, &["--power-on"]);
    refused.ends_with(1);
    assert!(refused.said.contains("ROBOT_EMERGENCY_STOP: this is left to a person"), "{}", refused.said);
    rig.inject("release-estop");
    while !rig.found("robot").starts_with("POWER_OFF, NORMAL") {
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut refused = rig.pull(&out, 3, &[]);
    refused.ends_with(1);
    assert!(refused.said.contains("allow --power-on"), "{}", refused.said);
    assert_eq!(statuses(&out), ["slipped", "failed", "missing"]);

    rig.pull(&out, 3, &["--power-on"]).ends_with(0);
    assert_eq!(statuses(&out), ["slipped"; 3]);
    assert_counts(&out, [3, 0, 0]);
}

#[test]
fn a_protective_stop_is_left_only_when_somebody_says_so() {
    let (_folder, out) = unmade("lab");
    let mut rig = Served::start(&SPEED);
    let mut pulling = rig.pull(&out, 1, &[]);
    pulling.until(&["1/1", ": the way down"]);
    rig.inject("protective-stop");
    pulling.ends_with(1);
    assert!(pulling.said.contains("PROTECTIVE_STOP; the robot stands still"), "{}", pulling.said);
    let after_s = stopped_after_s(&out, 0);
    assert!(after_s < LONGEST_S, "{after_s} s");
    let place = rig.place();
    let mut refused = rig.pull(&out, 1, &["--power-on"]);
    refused.ends_with(1);
    assert!(refused.said.contains("allow --unlock"), "{}", refused.said);
    assert!(rig.found("robot").contains("PROTECTIVE_STOP") && rig.place() == place, "nothing moved");
    // A robot is locked for five seconds, by its own clock.
    let began = Instant::now();
    while rig.pull(&out, 1, &["--unlock"]).ends() != 0 {
        assert!(began.elapsed() < PATIENCE);
    }
    assert_eq!(statuses(&out), ["slipped"]);
}

#[test]
fn ctrl_c_stops_the_robot_and_the_same_command_goes_on() {
    let (_folder, out) = unmade("lab");
    let rig = Served::start(&SPEED);
    let mut pulling = rig.pull(&out, 2, &[]);
    pulling.until(&["2/2", ": pulling"]);
    pulling.interrupt();
    pulling.ends_with(130);
    assert!(pulling.said.contains("interrupted; the robot stands still"), "{}", pulling.said);
    assert!(rig.found("robot").ends_with("program stopped"));
    assert_eq!(statuses(&out), ["slipped", "failed"]);
    rig.pull(&out, 2, &[]).ends_with(0);
    assert_eq!(statuses(&out), ["slipped"; 2]);
}

/// SIGKILL: nobody says stop, nobody says goodbye.
#[test]
fn a_host_that_dies_stops_the_robot_and_leaves_no_half_pull() {
    let (_folder, out) = unmade("lab");
    let rig = Served::start(&SPEED);
    for moment in [": pulling", ": gripping", ": the way down"] {
        let mut pulling = rig.pull(&out, 2, &[]);
        pulling.until(&["2/2", moment]);
        pulling.process.kill().unwrap();
        pulling.end();
        // The watchdog hears nothing any more.
        let began = Instant::now();
        while !rig.found("robot").ends_with("program stopped") {
            assert!(began.elapsed() < PATIENCE, "{moment}");
        }
        let place = rig.place();
        assert_eq!(rig.place(), place, "{moment}: it stands");
        assert_eq!(statuses(&out), ["slipped", "missing"], "{moment}");
        assert_counts(&out, [1, 1, 0]);
    }
    rig.pull(&out, 2, &[]).ends_with(0);
    assert_eq!(statuses(&out), ["slipped"; 2]);
    let table = run(&["info", out.to_str().unwrap()]);
    assert!(text(&table.stdout).contains("2 of 2 pulls"), "{}", text(&table.stdout));
}
