//! Planning a campaign, and making it on a twin.

use super::{assert_code, run, text};

#[test]
fn a_campaign_is_planned_and_made_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (file, measured) = (at("campaign.toml"), at("measured"));
    let plan = ["campaign", "-o", &file, "--parts", "gear", "--pulls", "24", "--simulate", &measured];
    let output = run(&[&plan[..], &["--json"]].concat());
    assert_code(&output, 0);
    let said: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!((&said["pulls"], &said["no_load"]), (&24.into(), &6.into()));
    assert!(said["minutes"].as_f64().unwrap() > 50.0, "{said}");
    assert!(std::fs::read_to_string(&file).unwrap().contains("kind = \"no_load\""));
    assert_eq!(std::fs::read_to_string(at("measured/pulls.csv")).unwrap().lines().count(), 25);

    // Without a rig the plan is one for the shipped rig, inside the range of the twin's laws: nothing fails.
    let forces = |twin: &str, name: &str| {
        let (file, made) = (at(&format!("{name}.toml")), at(name));
        let output = run(&["campaign", "-o", &file, "--twin", twin, "--pulls", "24", "--simulate", &made]);
        assert_code(&output, 0);
        let talk = text(&output.stderr);
        assert!(!talk.contains("left out"), "{talk}");
        // The diagnosis that is proposed names the twin, unless it is the default.
        let named = if twin.ends_with("/twin.toml") { format!(" --twin {twin}") } else { String::new() };
        assert!(talk.lines().any(|line| line.ends_with(&format!(" diagnose {made}{named}"))), "{talk}");
        let plan = std::fs::read_to_string(&file).unwrap();
        let forces = plan.split("grip_force_n = ").skip(1);
        let forces: Vec<f64> = forces.map(|f| f.split(',').next().unwrap().parse().unwrap()).collect();
        assert!(forces.len() >= 24, "{plan}");
        forces
    };
    let within =
        |all: Vec<f64>, low: f64| all.iter().filter(|f| **f != 0.0).all(|f| (low..=40.0).contains(f));
    assert!(within(forces("asset:configs/twin-baseline.toml", "plain"), 0.1));
    assert!(within(forces("asset:configs/twin.toml", "papers"), 20.0));

    assert_code(&run(&plan), 2);
    let again = run(&[&plan[..], &["--force"]].concat());
    assert_code(&again, 2);
    assert!(text(&again.stderr).contains("this exists and is no empty folder"), "{}", text(&again.stderr));
    for (arguments, part) in [
        (["--parts", "gaer"], "has no part `gaer`"),
        (["--pulls", "3"], "3 pulls are too few for 4 parts: at least 24"),
        (["--sessions", "0"], "0 sessions"),
    ] {
        let refused = run(&[&["campaign", "-o", &file, "--force"][..], &arguments].concat());
        assert_code(&refused, 2);
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
}
