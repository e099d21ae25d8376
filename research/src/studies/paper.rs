//! Runs the experiment of Wucherer et al. 2023 with and without the paper's correction, and writes the report.
//!
//! `cargo xtask research paper [FOLDER]` leaves the two runs and `paper.md` in FOLDER
//! (`runs/paper-report` where it is left out); `docs/paper.md` is a copy, to which three sections and a link were added by hand.

mod cells;
mod picture;
mod report;

use crate::{StudyResult, arguments};
use gripgen::record::RunFolder;
use gripgen::tactile::SimdLevel;
use gripgen::{Location, Project, SweepOptions, sweep};
use report::paper_report;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

fn sweep_into(out: &Path, sets: &[(&str, &str)]) -> Result<RunFolder, Box<dyn Error>> {
    let sets: Vec<(String, String)> =
        sets.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let project = Project::load(&Location::parse("asset:configs/paper.toml"), &sets)?;
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let options = SweepOptions { jobs, slice: None, simd: SimdLevel::best() };
    let summary = sweep(&project, out, options, &AtomicBool::new(false), |_| {})?;
    eprintln!("{}: {} samples, {} failed", out.display(), summary.samples, summary.failed);
    Ok(RunFolder::open(out)?)
}

pub fn run() -> StudyResult {
    let out = PathBuf::from(arguments().next().unwrap_or_else(|| "runs/paper-report".into()));
    let corrected = sweep_into(&out.join("corrected"), &[])?;
    let plain =
        sweep_into(&out.join("plain"), &[("twin", "asset:configs/twin-baseline.toml"), ("images", "none")])?;
    let report = paper_report(&corrected, &plain)?;
    std::fs::create_dir_all(out.join("images"))?;
    std::fs::write(out.join("paper.md"), &report.markdown)?;
    std::fs::write(out.join("images/paper.png"), &report.picture_png)?;
    println!("{}", out.join("paper.md").display());
    Ok(())
}
