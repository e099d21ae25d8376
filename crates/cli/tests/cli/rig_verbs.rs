//! `gripgen rig check`, `teach`, and what `pull` does before it connects.

use super::rig_served::Served;
use super::{assert_code, gripgen, run, text, unmade};
use std::path::Path;

/// Ports that nobody listens on.
const NOTHING: [&str; 6] = [
    "robot.rtde_port=1",
    "robot.dashboard_port=2",
    "robot.primary_port=3",
    "gripper.port=4",
    "cameras.left.port=5",
    "cameras.right.port=6",
];

fn nothing() -> Vec<&'static str> {
    NOTHING.iter().flat_map(|set| ["--set", *set]).collect()
}

#[test]
fn check_names_every_device_and_says_whether_it_answers() {
    let rig = Served::start(&["--speed", "20"]);
    let (code, json) = rig.check();
    assert_eq!(code, Some(0), "{json}");
    assert_eq!((&json["schema"], &json["ok"]), (&"gripgen.rigcheck/1".into(), &true.into()));
    drop(rig);
    let mut arguments = vec!["rig", "check", "--json"];
    arguments.extend(nothing());
    let none = run(&arguments);
    assert_code(&none, 1);
    let json: serde_json::Value = serde_json::from_slice(&none.stdout).unwrap();
    assert_eq!((&json["schema"], &json["ok"]), (&"gripgen.rigcheck/1".into(), &false.into()));
    let bad: Vec<&str> = json["checks"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|line| line["ok"] == false && line["found"].as_str().unwrap().contains("127.0.0.1:"))
        .map(|line| line["what"].as_str().unwrap())
        .collect();
    let devices = ["RTDE", "dashboard", "primary interface", "gripper", "left camera", "right camera"];
    assert_eq!(bad, devices);
}

#[test]
fn teach_writes_where_the_tool_is_and_keeps_the_rest_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rig.toml");
    let shipped = String::from_utf8(gripgen::assets::get("configs/rig.toml").unwrap().to_vec()).unwrap();
    std::fs::write(&file, &shipped).unwrap();
    let rig = Served::start(&["--at", "long_shaft"]);
    let taught = rig.rig("teach", &["bolt", "--rig", file.to_str().unwrap()]);
    assert_code(&taught, 0);
    let text_now = std::fs::read_to_string(&file).unwrap();
    let added = text_now.strip_prefix(shipped.trim_end()).expect("what was there is there, comments and all");
    let value: toml_edit::DocumentMut = added.parse().unwrap();
    let pose = value["poses"]["bolt"]["base_from_tool"].as_array().unwrap();
    let numbers: Vec<f64> = pose.iter().map(|x| x.as_float().unwrap()).collect();
    assert_eq!(&numbers[..3], [0.45, 0.06, 0.25], "the fixture of the shaft");
    // Again: the pose that is replaced is named, in case it was another part's.
    let again = rig.rig("teach", &["bolt", "--rig", file.to_str().unwrap()]);
    let said = text(&again.stdout);
    assert!(said.contains(", instead of 450.0, 60.0, 250.0 mm: 0.0 mm and 0.0 degrees away"), "{said}");
    let other = rig.rig("teach", &["gear", "--rig", file.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&other.stdout).unwrap();
    assert_eq!((&json["replaced"], &json["was"][1]), (&true.into(), &(-0.06).into()));
    let unknown = rig.rig(
        "teach",
        &["bolt", "--rig", file.to_str().unwrap(), "--set", "limits.workspace_high_mm=[700.0, 0.0, 600.0]"],
    );
    assert_code(&unknown, 1);
    assert!(text(&unknown.stderr).contains("y = 60.0 mm"), "{}", text(&unknown.stderr));
}

/// Pulls that nobody may make. Nothing listens on the ports: whoever connected would end with 1.
#[test]
fn a_campaign_beyond_the_limits_is_refused_before_anything_is_connected() {
    let (_folder, out) = unmade("lab");
    let refused = |more: &[&str], numbers: [&str; 2]| {
        let mut arguments = vec!["rig", "pull", "-o", out.to_str().unwrap()];
        arguments.extend(more);
        arguments.extend(nothing());
        let output = run(&arguments);
        assert_code(&output, 2);
        let said = text(&output.stderr);
        assert!(numbers.iter().all(|number| said.contains(number)), "{said}");
        assert!(said.contains("nothing was sent and nothing moved") && !out.exists(), "{said}");
    };
    refused(&["--parts", "gear", "--grip-force-n", "60"], ["120 N", "80 N"]);
    refused(
        &["--parts", "gear", "--set", "poses.gear.base_from_tool=[0.9, 0.0, 0.25, 3.14, 0.0, 0.0]"],
        ["900", "700"],
    );
    // Above the part, too.
    refused(
        &[
            "--parts",
            "gear",
            "--set",
            "motion.approach_mm=300",
            "--set",
            "limits.workspace_high_mm=[700.0, 500.0, 500.0]",
        ],
        ["550", "500"],
    );
    refused(&["--parts", "anvil"], ["anvil", "gear"]);
}

#[test]
fn what_would_be_done_is_told_without_a_rig() {
    let folder = tempfile::tempdir().unwrap();
    let of = |more: &[&str]| {
        let mut command = gripgen();
        command.args(["rig", "pull", "--parts", "gear"]).args(nothing()).args(more);
        let output = command.current_dir(folder.path()).output().unwrap();
        assert_code(&output, 0);
        text(&output.stdout)
    };
    let program = of(&["--print-program"]);
    assert!(program.starts_with("def gripgen_pull():\n") && program.ends_with("\nend\n"), "{program}");
    assert!(program.contains("rtde_set_watchdog(\"input_int_register_24\", 10.0, \"stop\")"), "{program}");
    assert!(program.contains("  max_force_n = 45.000000\n"), "{program}");
    assert!(of(&["--dry-run"]).contains("everything is inside the limits, nothing was sent"));
    let checked: serde_json::Value = serde_json::from_str(&of(&["--dry-run", "--json"])).unwrap();
    assert_eq!((&checked["event"], &checked["pulls"]), (&"checked".into(), &1.into()));
    assert!(is_empty(folder.path()), "nothing is written");
}

fn is_empty(folder: &Path) -> bool {
    std::fs::read_dir(folder).unwrap().next().is_none()
}

/// A folder of another rig is refused by the keys that differ, not by two hashes.
#[test]
fn a_changed_rig_names_the_keys() {
    let (_folder, out) = unmade("day");
    let pull =
        |more: &[&str]| run(&[&["rig", "pull", "-o", out.to_str().unwrap()], &nothing()[..], more].concat());
    // Nobody answers, but the folder is made.
    assert_code(&pull(&[]), 1);
    let before = std::fs::read(out.join("run.json")).unwrap();
    let other = pull(&["--set", "limits.pull_force_n=40"]);
    assert_code(&other, 3);
    let said = text(&other.stderr);
    assert!(
        said.contains("holds another run: rig.limits.pull_force_n is ") && said.contains(", 40.0 here"),
        "{said}"
    );
    assert!(said.contains("hint: choose another folder"), "{said}");
    assert_eq!(std::fs::read(out.join("run.json")).unwrap(), before);
    assert_code(&pull(&[]), 1);
}
