//! Files that belong to a run folder or to measurements: no output is ever written onto one of them.

use crate::mark::mark_of;
use gripgen::record::{
    CAMPAIGN_FILE, IMPRINTS_FILE, PRESSES_FILE, PULLS_FILE, ROSBAG_FILE, SENSOR_FILE, TRACES_FOLDER,
};
use gripgen_report::CONTACT_SHEET;
use std::ffi::OsStr;
use std::path::Path;

/// Folder of the images of pulls.
pub const IMAGES_FOLDER: &str = "images";
/// Other names of the table of presses, that of imprints, and the mapping of bags.
const OTHER_TABLES: [&str; 3] = ["shapes.csv", "imprints.csv", ROSBAG_FILE];
/// Endings of what tables of measurements refer to.
const DATA: [&str; 11] = ["png", "jpg", "jpeg", "csv", "npy", "npz", "stl", "obj", "ply", "glb", "mcap"];

/// What a file belongs to, or would belong to if it were written; `None` where it is nobody's.
///
/// `path` is absolute and without links. `runs`: folders that become runs.
pub fn owner(path: &Path, runs: &[&Path]) -> Option<String> {
    let (folder, name) = (path.parent()?, path.file_name()?.to_string_lossy().into_owned());
    let inside = folder.file_name().unwrap_or_default();
    let is_run = |at: &Path| at.join("run.json").is_file() || runs.contains(&at);
    let run = |at: &Path| format!("the run in {}", at.display());
    let measured = |at: &Path| format!("the measurements in {}", at.display());
    if is_run(folder) && of_run(&name) {
        return Some(run(folder));
    }
    let above = folder.parent();
    if let Some(above) = above.filter(|above| inside == "inputs" && is_run(above)) {
        return Some(run(above));
    }
    let has = |at: &Path, table: &str| at.join(table).is_file();
    let has_pulls = has(folder, PULLS_FILE);
    if has_pulls && [PULLS_FILE, CAMPAIGN_FILE].contains(&name.as_str()) {
        return Some(measured(folder));
    }
    let of_pulls = [OsStr::new(TRACES_FOLDER), OsStr::new(IMAGES_FOLDER)].contains(&inside);
    if let Some(above) = above.filter(|above| of_pulls && has(above, PULLS_FILE)) {
        return Some(measured(above));
    }
    let tables = [SENSOR_FILE, PRESSES_FILE, IMPRINTS_FILE].into_iter().chain(OTHER_TABLES);
    for table in tables {
        if name == table && has(folder, table) {
            return Some(measured(folder));
        }
        // Images and meshes have whatever names the table gives them.
        let near = [Some(folder), above].into_iter().flatten().find(|at| has(at, table));
        if let Some(at) = near.filter(|_| table != SENSOR_FILE && is_data(path) && mark_of(path).is_none()) {
            return Some(measured(at));
        }
    }
    None
}

fn of_run(name: &str) -> bool {
    let shard =
        name.strip_prefix("shard-").is_some_and(|rest| rest.ends_with(".mcap") || rest.ends_with(".json"));
    let rehearsal = name.starts_with("rehearsal-") && name.ends_with(".json");
    shard
        || rehearsal
        || ["run.json", "index.csv", CONTACT_SHEET].contains(&name)
        || name.ends_with(".partial")
}

fn is_data(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    path.exists() && DATA.contains(&ending.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_runs_and_measurements_have_an_owner() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        for file in [
            "run/run.json",
            "run/inputs/a.stl",
            "pulls/pulls.csv",
            "presses/shapes.csv",
            "presses/balls/1.png",
            "sensor/sensor.csv",
            "plain/campaign.toml",
            "bags/rosbag.toml",
            "bags/one/one_0.mcap",
        ] {
            let path = root.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "x").unwrap();
        }
        let owned = |name: &str| owner(&root.join(name), &[&root.join("planned")]).is_some();
        for name in [
            "run/run.json",
            "run/shard-00000.mcap",
            "run/shard-00007.json",
            "run/rehearsal-0a1b2c3d.json",
            "run/index.csv",
            "run/contact-sheet.png",
            "run/inputs/a.stl",
            "run/inputs/new.stl",
            "planned/run.json",
            "pulls/pulls.csv",
            "pulls/campaign.toml",
            "pulls/traces/a.csv",
            "pulls/images/a_left.png",
            "presses/shapes.csv",
            "presses/balls/1.png",
            "sensor/sensor.csv",
            "bags/rosbag.toml",
            "bags/one/one_0.mcap",
        ] {
            assert!(owned(name), "{name}");
        }
        for name in [
            "run/report.html",
            "run/sample-000003.png",
            "plain/campaign.toml",
            "plain/pulls.csv",
            "pulls/report.html",
            "presses/sensor.npz",
            "sensor/twin.toml",
            "bags/report.html",
            "bags/twin.toml",
        ] {
            assert!(!owned(name), "{name}");
        }
    }
}
