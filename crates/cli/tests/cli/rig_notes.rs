//! What a lab notes of its pulls: in the campaign, on the command line, asked for between pulls; stored, and read back.

use super::rig_served::{Served, pulls};
use super::{assert_code, run, text, unmade};
use gripgen::twin::Values;
use gripgen_measured::load_pulls_of;
use std::path::Path;

const FAST: [&str; 2] = ["--speed", "20"];

fn column(out: &Path, name: &str) -> Values {
    let loaded = load_pulls_of(&[out]).unwrap();
    loaded
        .pulls
        .extra
        .iter()
        .find(|column| column.name == name)
        .unwrap_or_else(|| panic!("{name}"))
        .values
        .clone()
}

fn cell(out: &Path, row: usize, name: &str) -> String {
    let index = std::fs::read_to_string(out.join("index.csv")).unwrap();
    let mut lines = index.lines().map(|line| line.split(',').map(String::from).collect::<Vec<_>>());
    let at = lines.next().unwrap().iter().position(|column| column == name).unwrap();
    lines.nth(row).unwrap()[at].clone()
}

#[test]
fn columns_of_the_command_line_and_of_the_keyboard_are_stored_and_read_back() {
    let (_folder, out) = unmade("lab");
    let rig = Served::start(&FAST);
    let notes = ["--column", "operator=anna", "--ask", "temperature_c,humidity_pct"];
    // A decimal comma is asked for again; an empty line notes nothing.
    let mut pulling = rig.pull_answering(&out, 2, &notes, "21.5\n43,5\n43.5\n22\n\n");
    pulling.ends_with(0);
    assert!(pulling.said.contains("pull 1, gear at 25 N: temperature_c?"), "{}", pulling.said);
    assert!(pulling.said.contains("write the number with a point. pull 1,"), "{}", pulling.said);
    assert_eq!(["21.5", "22"].map(String::from), [0, 1].map(|row| cell(&out, row, "temperature_c")));
    assert_eq!(["43.5", ""].map(String::from), [0, 1].map(|row| cell(&out, row, "humidity_pct")));
    assert_eq!(column(&out, "operator"), Values::Words(vec!["anna".into(); 2]));
    let loaded = load_pulls_of(&[&out]).unwrap().pulls;
    assert!(loaded.recorded.iter().any(|name| name == "temperature_c"), "{:?}", loaded.recorded);
    assert_eq!(loaded.pulls[0].covariates.temperature_c, 21.5);
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);
    // Another person goes on: the names belong to the run, the values do not.
    let others = ["--column", "operator=bert", "--ask", "temperature_c,humidity_pct"];
    assert_eq!(rig.pull_answering(&out, 2, &others, "").ends(), 0);
    let mut refused = rig.pull(&out, 2, &[]);
    refused.ends_with(3);
    assert!(
        refused
            .said
            .contains("campaign.recorded has \"humidity_pct\", \"operator\", \"temperature_c\" there alone"),
        "{}",
        refused.said
    );
}

/// Only what was measured is stored; a pull whose temperature was not measured says nothing of it.
#[test]
fn what_was_not_measured_is_not_stored() {
    let (_folder, out) = unmade("lab");
    let rig = Served::start(&FAST);
    let mut pulling = rig.pull_answering(&out, 2, &["--ask", "temperature_c"], "n/a\n21\n");
    pulling.ends_with(0);
    assert_eq!(["", "21"].map(String::from), [0, 1].map(|row| cell(&out, row, "temperature_c")));
    let loaded = load_pulls_of(&[&out]).unwrap();
    assert!(loaded.pulls.recorded.iter().any(|name| name == "temperature_c"));
    assert!(loaded.pulls.pulls[0].covariates.missing.contains("temperature_c"));
    assert!(!loaded.pulls.pulls[1].covariates.missing.contains("temperature_c"));
    let said = "temperature_c: 1 cell is missing, these pulls say nothing of it";
    assert!(loaded.notes.iter().any(|note| note == said), "{:?}", loaded.notes);
    // There is no person: the rig is stopped safely, and the hint says what works.
    let (_folder, alone) = unmade("alone");
    let mut stopped = rig.pull(&alone, 1, &["--ask", "temperature_c"]);
    stopped.ends_with(1);
    assert!(stopped.said.contains("`temperature_c` was asked for, and the input ended"), "{}", stopped.said);
    assert!(stopped.said.contains("`--column NAME=VALUE` notes one value for all pulls"), "{}", stopped.said);
}

#[test]
fn columns_of_an_entry_are_made_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let (campaign, out) = (folder.path().join("c.toml"), folder.path().join("lab"));
    let entry = |note: &str| format!("[[pulls]]\npart = \"gear\"\ngrip_force_n = 25\n{note}");
    let write = |notes: [&str; 2]| std::fs::write(&campaign, notes.map(entry).concat()).unwrap();
    write(["operator = \"anna\"\nlot = 3\n", "operator = \"bert\"\n"]);
    let rig = Served::start(&FAST);
    let of = ["--campaign", campaign.to_str().unwrap(), "-o", out.to_str().unwrap(), "-q"];
    assert_code(&rig.rig("pull", &of), 0);
    assert_eq!(pulls(&out).len(), 2);
    assert_eq!(column(&out, "operator"), Values::Words(vec!["anna".into(), "bert".into()]));
    assert_eq!([0, 1].map(|row| cell(&out, row, "lot")), ["3".to_string(), String::new()]);
    // A misspelt key is no column, and another campaign is told by what differs.
    write(["dwel_s = 3\n", ""]);
    let refused = rig.rig("pull", &of);
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains("pulls[0]: unknown field `dwel_s`: did you mean `dwell_s`?"));
    write(["operator = \"anna\"\nlot = 4\n", "operator = \"bert\"\n"]);
    let other = rig.rig("pull", &of);
    assert_code(&other, 3);
    assert!(
        text(&other.stderr).contains("campaign.pulls[0].lot is 3.0 there, 4.0 here"),
        "{}",
        text(&other.stderr)
    );
}

/// What was typed is refused before anything is connected.
#[test]
fn columns_that_cannot_be_noted_are_refused() {
    let (_folder, out) = unmade("lab");
    for (flags, words) in [
        (&["--column", "operator="][..], "--column operator: there is no value"),
        (&["--column", "temperature_c=warm"], "`temperature_c` is `warm`, it must be a number"),
        (&["--column", "max_pull_force_n=3"], "written by the rig itself"),
        (&["--ask", "temperature"], "did you mean `temperature_c`?"),
        (&["--column", "operator=a", "--ask", "operator"], "the column operator is given twice"),
    ] {
        let refused = run(&[&["rig", "pull", "-o", out.to_str().unwrap()], flags].concat());
        assert_code(&refused, 2);
        assert!(text(&refused.stderr).contains(words) && !out.exists(), "{words}: {}", text(&refused.stderr));
    }
}
