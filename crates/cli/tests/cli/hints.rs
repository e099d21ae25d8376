//! Hints, followed: what an error tells people to do is done, and the same command then works.

use super::{QUICKSTART, assert_code, reference, run, text};
use std::path::Path;
use std::process::Output;

/// Eight pulls of a gear, with the header that a test wants.
fn table(folder: &Path, header: &str) {
    let rows: String = (1..=8).map(|i| format!("p{i},gear,{},{}\n", 10 * i, 3 * i)).collect();
    std::fs::write(folder.join("pulls.csv"), format!("{header}\n{rows}")).unwrap();
}

/// The hint of a command that is refused; it names what is to be done.
#[track_caller]
fn hint(refused: &Output, names: &str) -> String {
    let said = text(&refused.stderr);
    assert_ne!(refused.status.code(), Some(0), "{said}");
    let hint = said.split("hint: ").nth(1).unwrap_or_else(|| panic!("no hint: {said}")).to_string();
    assert!(hint.contains(names), "`{names}` is not in: {hint}");
    hint
}

/// The first command between back quotes, as words behind the program's name.
#[track_caller]
fn command(hint: &str) -> Vec<String> {
    let program = |words: &&str| words.split(' ').next().is_some_and(|word| word.ends_with("gripgen"));
    let quoted = hint.split('`').skip(1).step_by(2).find(program);
    let words = quoted.unwrap_or_else(|| panic!("no command in: {hint}"));
    words.split_whitespace().skip(1).map(String::from).collect()
}

#[track_caller]
fn works(command: &[&str]) {
    assert_code(&run(command), 0);
}

#[test]
fn flags_that_hints_name_are_what_was_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (out, taken) = (path("out.png"), path("taken.csv"));
    std::fs::write(&taken, "mine").unwrap();
    let part = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/parts/gear/part.stl");
    let render = ["render", part, "--sensor", "asset:sensors/gelsight_synthetic/sensor.npz", "-o", &out];
    let depth = hint(&run(&render), "--depth-mm");
    let value =
        depth.split("--depth-mm ").nth(1).and_then(|rest| rest.split(['`', ',', ' ']).next()).unwrap();
    works(&[&render[..], &["--depth-mm", value]].concat());
    let again = [&render[..], &["--depth-mm", value]].concat();
    hint(&run(&again), "--force");
    works(&[&again[..], &["--force"]].concat());
    let plan = ["campaign", "--parts", "gear", "-o", &path("plan.toml"), "--csv", &taken];
    hint(&run(&plan), "--force");
    works(&[&plan[..], &["--force"]].concat());
}

#[test]
fn a_column_that_is_named_as_the_hint_says_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let measured = folder.path().to_str().unwrap();
    table(folder.path(), "pull_id,part,grip_force,max_pull_force_n");
    let refused = run(&["info", measured]);
    let said = text(&refused.stderr);
    assert!(said.contains("did you mean `grip_force`? name it `grip_force_n`"), "{said}");
    table(folder.path(), "pull_id,part,grip_force_n,max_pull_force_n");
    works(&["info", measured]);
    std::fs::write(folder.path().join("campaign.toml"), "label_tolerance_n = \"3\"\n").unwrap();
    let keys = command(&hint(&run(&["info", measured]), "gripgen schema campaign"));
    let words: Vec<&str> = keys.iter().map(String::as_str).collect();
    assert!(text(&run(&words).stdout).contains("label_tolerance_n"));
}

#[test]
fn a_run_that_is_damaged_is_repaired_by_the_commands_of_its_hint() {
    let (_folder, out) = reference();
    std::fs::write(out.join("shard-00001.mcap"), "damaged").unwrap();
    let repair = command(&hint(&run(&["verify", out.to_str().unwrap()]), "--repair"));
    let words: Vec<&str> = repair.iter().map(String::as_str).collect();
    let repaired = run(&words);
    assert!([Some(0), Some(5)].contains(&repaired.status.code()), "{}", text(&repaired.stderr));
    works(&super::sweep_args(out.to_str().unwrap(), &["-q"]));
    works(&["verify", out.to_str().unwrap()]);
}

#[test]
fn keys_and_folders_of_a_sweep_are_what_the_hint_says() {
    let (_folder, out) = reference();
    let other = super::sweep_args(out.to_str().unwrap(), &["-q", "--set", "seed=8"]);
    hint(&run(&other), "another folder");
    let elsewhere = out.with_file_name("other");
    works(&super::sweep_args(elsewhere.to_str().unwrap(), &["-q", "--set", "seed=8"]));
    let typed = ["check", QUICKSTART, "--set", "sample=4"];
    hint(&run(&typed), "samples");
    let at_a_store = ["sweep", QUICKSTART, "-o", "s3://bucket/run"];
    let refused = run(&at_a_store);
    assert_code(&refused, 2);
    hint(&refused, "folder");
    assert!(!Path::new("s3:").exists(), "no folder of that name");
}
