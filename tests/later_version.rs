//! Runs that another version of gripgen made, in whole or in part.

use crate::common::{jobs, root, run, small_project};
use gripgen::record::{Dataset, FolderError, INDEX_COLUMNS, RunFolder, repair, verify};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Changes a JSON file of a run.
fn change(folder: &Path, name: &str, with: impl FnOnce(&mut Value)) {
    let path = folder.join(name);
    let mut document: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    with(&mut document);
    std::fs::write(&path, serde_json::to_vec_pretty(&document).unwrap()).unwrap();
}

/// A run of 12 samples in three shards.
fn made() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&[]), folder.path(), jobs(2));
    folder
}

/// What lies in a folder, by name.
fn contents(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap()).filter(|e| e.path().is_file());
    let mut all: Vec<_> = entries.map(|e| (e.file_name(), std::fs::read(e.path()).unwrap())).collect();
    all.sort();
    all
}

#[test]
fn fields_that_are_not_known_are_passed_over() {
    let folder = made();
    for name in ["run.json", "shard-00001.json"] {
        change(folder.path(), name, |document| document["weather"] = json!({"rain": true}));
    }
    let before = contents(folder.path());
    let checked = verify(folder.path(), |_| {}).unwrap();
    assert_eq!((checked.good_shards, checked.samples, checked.faults), (3, 12, vec![]));
    assert_eq!(Dataset::open(folder.path()).unwrap().table().rows(), 12);
    assert!(run(&small_project(&[]), folder.path(), jobs(2)).complete, "the same sweep has nothing to do");
    assert!(contents(folder.path()) == before);
}

/// Such a shard is refused with its file by everything that reads it, and stays.
#[test]
fn a_sidecar_that_cannot_be_read_is_neither_undone_nor_repaired_away() {
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 2] = [
        (|sidecar| sidecar["schema"] = json!("gripgen.shard/2"), "its schema is `gripgen.shard/2`"),
        (|sidecar| sidecar["gripgen_version"] = json!("9.0.0"), "`gripgen_version` is 9.0.0"),
    ];
    for (changed, wanted) in cases {
        let folder = made();
        change(folder.path(), "shard-00001.json", changed);
        let before = contents(folder.path());
        let checked = verify(folder.path(), |_| {}).unwrap();
        assert_eq!((checked.good_shards, checked.missing_shards, checked.faults.len()), (2, 0, 1));
        assert!(
            checked.faults[0].contains("shard-00001.json") && checked.faults[0].contains(wanted),
            "{checked:?}"
        );
        let run_folder = RunFolder::open(folder.path()).unwrap();
        assert!(repair(&run_folder, &checked).unwrap().is_empty());
        let as_read = Dataset::open(folder.path()).err().unwrap().to_string();
        assert_eq!(as_read, checked.faults[0], "verify says what readers say");
        let swept =
            gripgen::sweep(&small_project(&[]), folder.path(), jobs(2), &AtomicBool::new(false), |_| {});
        assert_eq!(swept.err().unwrap().to_string(), as_read);
        assert!(contents(folder.path()) == before, "{wanted}: nothing was touched");
    }
}

/// A run of another version is read as far as it can be. What is broken in it stays: this version does not make it again.
#[test]
fn a_run_of_another_version_is_never_repaired() {
    let folder = made();
    change(folder.path(), "run.json", |run| run["gripgen_version"] = json!("9.0.0"));
    let checked = verify(folder.path(), |_| {}).unwrap();
    assert_eq!(checked.faults.len(), 3, "its shards are of this version: {checked:?}");
    for shard in 0..3 {
        let name = format!("shard-0000{shard}.json");
        change(folder.path(), &name, |sidecar| sidecar["gripgen_version"] = json!("9.0.0"));
    }
    let checked = verify(folder.path(), |_| {}).unwrap();
    assert_eq!((checked.good_shards, checked.faults), (3, vec![]));
    assert_eq!(Dataset::open(folder.path()).unwrap().table().rows(), 12);

    // Another type of a field, one cell more in each row: what a later version may write. And damage of the index.
    change(folder.path(), "shard-00000.json", |sidecar| sidecar["failed"] = json!("none"));
    change(folder.path(), "shard-00002.json", |sidecar| {
        for row in sidecar["rows"].as_array_mut().unwrap() {
            row.as_array_mut().unwrap().push(json!("dry"));
        }
    });
    std::fs::write(folder.path().join("index.csv"), "another,index\n").unwrap();
    let before = contents(folder.path());
    let run_folder = RunFolder::open(folder.path()).unwrap();
    for shard in [0, 2] {
        let e = run_folder.finished(shard).unwrap_err();
        assert!(
            matches!(e, FolderError::OtherVersion { .. }) && e.to_string().contains("gripgen 9.0.0 made it"),
            "{e}"
        );
    }
    let checked = verify(folder.path(), |_| {}).unwrap();
    assert_eq!((checked.good_shards, checked.faults.len()), (1, 2), "{checked:?}");
    assert!(repair(&run_folder, &checked).unwrap().is_empty());
    std::fs::write(folder.path().join("shard-00001.mcap"), "damaged").unwrap();
    let checked = verify(folder.path(), |_| {}).unwrap();
    assert!(checked.faults.len() == 3 && repair(&run_folder, &checked).unwrap().is_empty(), "{checked:?}");
    assert_eq!(contents(folder.path()).len(), before.len());
}

/// Runs whose index has the first columns, with a field that is not known in one of their documents.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn runs_of_the_first_layout_are_read() {
    let reports = root().join("../shared/reports/15-unknown-fields-of-a-later-version");
    for name in ["run-with-a-new-field-in-run.json", "run-with-a-new-field-in-a-sidecar"] {
        let folder = reports.join(name);
        let checked = verify(&folder, |_| {}).unwrap();
        assert_eq!((checked.good_shards, checked.samples, checked.faults), (1, 4, vec![]), "{name}");
        let run = Dataset::open(&folder).unwrap();
        let at = |column: &str| INDEX_COLUMNS.iter().position(|c| *c == column).unwrap();
        let sidecar = RunFolder::open(&folder).unwrap().finished(0).unwrap().unwrap();
        for row in &sidecar.rows {
            assert!(row[at("peak_force_n")].is_empty() && row[at("mu_drawn")].is_empty(), "{row:?}");
            assert!(row[at("mu_effective")].parse::<f64>().unwrap() > 0.0, "{row:?}");
        }
        assert_eq!(run.table().rows(), 4);
    }
}
