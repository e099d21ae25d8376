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

    let again = run(&plan);
    assert_code(&again, 1);
    assert!(text(&again.stderr).contains("holds measurements"), "{}", text(&again.stderr));
    for (arguments, part) in [
        (["--parts", "gaer"], "has no part `gaer`"),
        (["--pulls", "3"], "3 pulls are too few for 4 parts: at least 24"),
        (["--sessions", "0"], "0 sessions"),
    ] {
        let refused = run(&[&["campaign", "-o", &file][..], &arguments].concat());
        assert_code(&refused, 2);
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
}
