//! What several tests share.

use gripgen::tactile::SimdLevel;
use gripgen::twin::{Outcome, Pulled, Twin};
use gripgen::{
    BASELINE_TWIN, Library, LoadError, Location, Project, SweepOptions, SweepSummary, generate,
    load_twin_document, sweep,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// The root of the repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A project from a shipped configuration with overrides `key=value`.
pub fn project(config: &str, sets: &[&str]) -> Project {
    load(config, sets).unwrap_or_else(|e| panic!("{config}: {e}"))
}

/// The same, or why there is none.
pub fn load(config: &str, sets: &[&str]) -> Result<Project, LoadError> {
    let sets =
        sets.iter().map(|s| s.split_once('=').map(|(k, v)| (k.trim().into(), v.trim().into())).unwrap());
    Project::load(&Location::parse(config), &sets.collect::<Vec<_>>())
}

/// Overrides as keys and values.
pub fn overrides(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

/// The shipped twin without effects.
pub fn baseline() -> Location {
    Location::parse(BASELINE_TWIN)
}

/// A twin with overrides.
pub fn twin_with_sets(at: &Location, sets: &[(String, String)]) -> Twin {
    Twin::new(&load_twin_document(at, sets).unwrap().read_twin().unwrap()).unwrap()
}

pub fn twin_at(at: &Location) -> Twin {
    twin_with_sets(at, &[])
}

/// The files of a twin that names embedded ones only.
pub fn library(twin: &Twin) -> Library {
    Library::of_twin(twin, &baseline()).unwrap()
}

/// A file with the baseline twin and `effects`.
pub fn twin_with(effects: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("twin.toml");
    let base = std::fs::read_to_string(root().join("assets/configs/twin-baseline.toml")).unwrap();
    std::fs::write(&file, format!("{base}\n{effects}")).unwrap();
    (folder, file)
}

/// The sweep in a folder.
pub fn project_in(folder: &Path, sets: &[(&str, &str)]) -> Project {
    let at = Location::Disk(folder.join("sweep.toml"));
    Project::load(&at, &overrides(sets)).unwrap_or_else(|e| panic!("{at}: {e}"))
}

/// Writes `twin.toml` and `sweep.toml` into a folder and loads the sweep.
pub fn write_project(folder: &Path, twin: &str, sweep: &str) -> Project {
    std::fs::write(folder.join("twin.toml"), twin).unwrap();
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    project_in(folder, &[])
}

/// A sample that is a pull; `None` where the jaws meet nothing.
pub fn pulled(project: &Project, index: u64) -> Option<Box<Pulled>> {
    match generate(project, index, SimdLevel::best()).outcome {
        Outcome::Pulled(pulled) => Some(pulled),
        Outcome::NoContact { .. } => None,
        Outcome::Failed { reason } => panic!("{reason}"),
    }
}

/// A small sweep with the paper's twin: 12 samples in shards of 5, all parts, cheap pulls.
pub fn small_project(sets: &[&str]) -> Project {
    let mut all = vec![
        "twin=asset:configs/twin.toml",
        "vary.grip_force_n=[20, 25, 30]",
        "vary.grip_offset_mm=[0]",
        "vary.grip_pose=[0]",
        "vary.grip_angle_deg=[30]",
        "shard_samples=5",
    ];
    all.extend(sets);
    project("asset:configs/quickstart.toml", &all)
}

/// Options for `jobs` threads.
pub fn jobs(jobs: usize) -> SweepOptions {
    SweepOptions { jobs, slice: None, simd: SimdLevel::best() }
}

/// Whether the long versions of tests are wanted.
pub fn slow() -> bool {
    std::env::var_os("GRIPGEN_SLOW_TESTS").is_some()
}

/// Runs a sweep to its end.
pub fn run(project: &Project, out: &Path, options: SweepOptions) -> SweepSummary {
    sweep(project, out, options, &AtomicBool::new(false), |_| {}).unwrap()
}

/// Every file of a folder with its content.
pub fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.file_type().unwrap().is_file())
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .collect()
}

/// Asserts that two folders hold the same files with the same bytes.
pub fn assert_same(a: &Path, b: &Path, what: &str) {
    let (a, b) = (content(a), content(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{what}: other files");
    for (name, bytes) in &a {
        assert!(b[name] == *bytes, "{what}: {name} differs");
    }
}
