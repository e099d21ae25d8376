use super::*;

#[test]
fn a_folder_of_something_else_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let e = Dataset::open(folder.path()).err().unwrap().to_string();
    assert!(e.contains(&folder.path().display().to_string()) && e.contains("run.json"), "{e}");
}
