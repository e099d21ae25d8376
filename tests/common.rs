//! What several tests share.

use gripgen::tactile::SimdLevel;
use gripgen::{Location, Project, SweepOptions, SweepSummary, sweep};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// The root of the repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A project from a shipped configuration with overrides `key=value`.
pub fn project(config: &str, sets: &[&str]) -> Project {
    let sets: Vec<(String, String)> = sets
        .iter()
        .map(|s| s.split_once('=').map(|(k, v)| (k.trim().into(), v.trim().into())).unwrap())
        .collect();
    Project::load(&Location::parse(config), &sets).unwrap_or_else(|e| panic!("{config}: {e}"))
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
