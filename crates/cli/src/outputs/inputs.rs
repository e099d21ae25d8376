//! What a command reads: files, the data of folders, and what configurations name.

use gripgen_measured::CAMPAIGN_FILE;
use std::path::{Path, PathBuf};

/// Endings of tables and of what they name. No verb that reads a folder of measurements writes a file of these kinds.
const DATA: [&str; 12] =
    [".csv", ".png", ".jpg", ".jpeg", ".npy", ".stl", ".obj", ".ply", ".glb", ".mcap", ".db3", ".bag"];
/// How far names are followed: a sweep names a twin, which names meshes.
const DEPTH: usize = 3;

/// Whether a file is an input, by links too, or in an input folder one of its data.
pub fn holds(input: &Path, path: &Path) -> bool {
    let (Ok(input), Ok(path)) = (input.canonicalize(), path.canonicalize()) else { return false };
    input == path || same_inode(&input, &path) || is_data_of(&input, &path)
}

/// Whether a file in a folder of measurements is one of those that are read. Twins, reports and sensor files may lie there too, and a
/// run has files of its own.
fn is_data_of(folder: &Path, path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let is_data = DATA.iter().any(|ending| name.ends_with(ending)) && !name.ends_with(".posterior.csv");
    path.starts_with(folder)
        && !folder.join("run.json").is_file()
        && (is_data || [CAMPAIGN_FILE, "rosbag.toml"].contains(&&*name))
}

#[cfg(unix)]
fn same_inode(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(one), Ok(other)) = (std::fs::metadata(a), std::fs::metadata(b)) else { return false };
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

/// A hard link is not seen; what is renamed onto one leaves the other name's content alone.
#[cfg(not(unix))]
fn same_inode(_: &Path, _: &Path) -> bool {
    false
}

/// A configuration file, the files that its strings name, and those that `--set` names. What is not there is left out.
pub fn of_config(path: &str, sets: &[(String, String)]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let base = if path.starts_with(gripgen::assets::ASSET_PREFIX) { None } else { Some(Path::new(path)) };
    for (_, value) in sets {
        let name = value.trim_matches(['"', '\'']);
        let folders = [Some(Path::new("")), base.and_then(Path::parent)];
        folders.into_iter().flatten().for_each(|folder| follow(&folder.join(name), DEPTH, &mut found));
    }
    if let Some(base) = base {
        follow(base, DEPTH, &mut found);
    }
    found
}

fn follow(path: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    if depth == 0 || !path.is_file() || found.iter().any(|known| known == path) {
        return;
    }
    found.push(path.into());
    if path.extension().is_none_or(|e| e != "toml") {
        return;
    }
    // The draws that a sweep may take from beside its twin.
    follow(&path.with_extension("posterior.csv"), depth, found);
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let folder = path.parent().unwrap_or(Path::new(""));
    // Of all that stands between two quotes only names of files are followed.
    text.split(['"', '\'']).for_each(|name| follow(&folder.join(name), depth - 1, found));
}
