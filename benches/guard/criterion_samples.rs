//! What criterion wrote: `<benchmark>/new/benchmark.json` has the name, `sample.json` beside it the times.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

#[derive(Deserialize)]
struct Benchmark {
    full_id: String,
}

#[derive(Deserialize)]
struct Sample {
    /// Calls of each sample.
    iters: Vec<f64>,
    /// Their time together, ns.
    times: Vec<f64>,
}

/// Nanoseconds per call, by name, of the benchmarks that were measured since `started`.
pub fn since(folder: &Path, started: SystemTime) -> BTreeMap<String, Vec<f64>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()) {
            if path.file_name().is_some_and(|name| name == "new") {
                found.extend(read(&path, started));
            } else {
                open.push(path);
            }
        }
    }
    found
}

fn read(folder: &Path, started: SystemTime) -> Option<(String, Vec<f64>)> {
    let path = folder.join("sample.json");
    // Clocks of file systems are coarse.
    let written = std::fs::metadata(&path).ok()?.modified().ok()?;
    if written + std::time::Duration::from_millis(50) < started {
        return None;
    }
    let text = |path: &Path| std::fs::read_to_string(path).ok();
    let Benchmark { full_id } = serde_json::from_str(&text(&folder.join("benchmark.json"))?).ok()?;
    let Sample { iters, times } = serde_json::from_str(&text(&path)?).ok()?;
    Some((full_id, times.iter().zip(&iters).map(|(time, calls)| time / calls).collect()))
}
