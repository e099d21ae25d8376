//! Peak memory of a sweep and of one ten times larger, each in a process of its own.
//!
//! `cargo bench --bench memory` prints both, also with a pixel size of its own for every sample, for which no sensor can
//! be shared. The peak must not depend on the number of samples.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;

use gripgen::tactile::SimdLevel;
use gripgen::{Location, Project, SweepOptions, sweep};
use guard::baseline::Unit;
use std::process::{Command, ExitCode};
use std::sync::atomic::AtomicBool;

/// Set in the child processes: samples and jobs.
const CHILD: &str = "GRIPGEN_MEMORY_BENCH";

fn main() -> ExitCode {
    if let Ok(task) = std::env::var(CHILD) {
        child(&task);
        return ExitCode::SUCCESS;
    }
    let Some(mut run) = guard::Run::from_args("memory") else { return ExitCode::SUCCESS };
    let cases = [(1, "one"), (2, "one"), (2, "varied")];
    let all = cases.into_iter().flat_map(|(jobs, sensors)| [64, 640].map(|samples| (jobs, sensors, samples)));
    let named = all.map(|case @ (jobs, sensors, samples)| {
        (format!("memory/{sensors}/{jobs}_jobs/{samples}_samples"), case)
    });
    let wanted: Vec<_> = named.filter(|(name, _)| run.wants(name)).collect();
    if !wanted.is_empty() {
        println!("{:>8} {:>5} {:>8} {:>12} {:>14}", "samples", "jobs", "sensors", "peak MB", "on disk MB");
    }
    for (name, (jobs, sensors, samples)) in wanted {
        let output = Command::new(std::env::current_exe().unwrap())
            .env(CHILD, format!("{samples} {jobs} {sensors}"))
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        println!("{samples:>8} {jobs:>5} {sensors:>8} {}", text.trim_end());
        let peak_mb = text.split_whitespace().next().and_then(|word| word.parse().ok());
        run.measured(&name, Unit::Megabytes, Vec::from_iter(peak_mb));
    }
    run.finish()
}

fn child(task: &str) {
    let words: Vec<&str> = task.split(' ').collect();
    let [samples, jobs, sensors] = words[..] else { panic!("{task}") };
    let mut sets = vec![("design", "random"), ("samples", samples), ("shard_samples", "16")];
    if sensors == "varied" {
        sets.push(("vary.optics.left.mm_per_px", "{ uniform = [0.08, 0.09] }"));
    }
    let sets: Vec<(String, String)> = sets.into_iter().map(|(k, v)| (k.into(), v.into())).collect();
    let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap();
    let out = tempfile::tempdir().unwrap();
    let options = SweepOptions { jobs: jobs.parse().unwrap(), slice: None, simd: SimdLevel::best() };
    sweep(&project, out.path(), options, &AtomicBool::new(false), |_| {}).unwrap();
    let disk: u64 =
        std::fs::read_dir(out.path()).unwrap().map(|e| e.unwrap().metadata().unwrap().len()).sum();
    println!(
        "{:>12} {:>14.1}",
        peak_mb().map_or("unknown".into(), |mb| format!("{mb:.1}")),
        disk as f64 * 1e-6
    );
}

/// Largest resident size of this process so far, from the kernel.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kb: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kb * 1024e-6)
}
