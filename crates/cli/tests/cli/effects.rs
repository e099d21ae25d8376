//! `gripgen effects`.

use super::run;
use gripgen::twin::effects::LIBRARY;
use serde_json::Value;
use std::process::Output;

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_slice(&run(arguments).stdout).unwrap()
}

/// The catalogue lists every effect, explains one with its curve, draws it, and helps with a typing error.
#[test]
fn effects_are_listed_explained_and_drawn() {
    let list = text(&run(&["effects"]));
    let all = json(&["effects", "--json"]);
    let ids: Vec<&str> = all.as_array().unwrap().iter().map(|e| e["id"].as_str().unwrap()).collect();
    assert!(ids.iter().copied().eq(LIBRARY.iter().map(|s| s.id)), "{ids:?}");
    for spec in LIBRARY {
        let line = list.lines().find(|l| l.split_whitespace().next() == Some(spec.id));
        assert!(line.is_some_and(|l| l.ends_with(spec.about)), "{}: {line:?}", spec.id);
    }
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("curve.svg");
    let page = text(&run(&["effects", "load_power_law", "--plot", svg.to_str().unwrap()]));
    assert!(page.contains("  formula     mu' = mu (F_G / f_ref_n)^n\n"), "{page}");
    // (5 N / 40 N)^-0.15 is the longest bar, of 32 characters.
    assert!(page.contains(&format!("\n{:>22}   1.366 {}\n", "5", "#".repeat(32))), "{page}");
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg xmlns"));
    let curve = &json(&["effects", "load_power_law", "--json"])["f_max"];
    let numbers =
        |key: &str| curve[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    let (force_n, ratio) = (numbers("x"), numbers("ratio"));
    assert_eq!((&curve["covariate"], force_n.len(), ratio.len()), (&Value::from("grip_force_n"), 25, 25));
    assert_eq!((force_n[0], force_n[24]), (5.0, 80.0));
    assert!((ratio[0] - 1.366).abs() < 1e-3 && (ratio[24] - 0.901).abs() < 1e-3, "{ratio:?}");
    let typo = run(&["effects", "load_powerlaw"]);
    assert_eq!(typo.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&typo.stderr).contains("did you mean `load_power_law`?"));
}

/// Where an effect can be found, with what has to vary there, or why nowhere.
#[test]
fn a_page_says_where_an_effect_is_found() {
    for (id, wanted) in [
        ("sensor_bias", "pulls"),
        ("sensor_drift", "pulls, sensor tables, of pulls where time_s varies"),
        ("load_power_law", "pulls, of pulls where grip_force_n varies"),
        ("exposure", "presses"),
        ("light_drift", "presses, where time_s varies"),
        ("shear_strength", "nothing: "),
    ] {
        let page = text(&run(&["effects", id]));
        let found = page.lines().find_map(|l| l.strip_prefix("  found in    ")).unwrap_or_default();
        let begins = wanted.ends_with(": ");
        assert!(if begins { found.starts_with(wanted) } else { found == wanted }, "{id}: {found}");
    }
}
