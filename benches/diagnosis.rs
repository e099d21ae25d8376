//! How long a diagnosis of 440 pulls with 88 traces takes, on all cores: nothing to find, an effect on friction, one on the
//! readings that runs with the clock (the slowest kind), and both.
//!
//! `cargo bench --bench diagnosis`. The unit beside seconds is what a plain comparison of the same pulls with a twin takes in
//! the same run: fits are made of such predictions.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;

use gripgen::twin::{MeasuredPulls, Twin};
use gripgen::{Library, Location, load_twin_document};
use gripgen_cli::{PullDiagnoseOptions, compare_pulls, diagnose_pull_table, simulate_campaign};
use gripgen_identify::{CampaignOptions, plan_campaign};
use guard::baseline::Unit;
use std::process::ExitCode;
use std::time::Instant;

const PULLS: usize = 440;
/// Every so many pulls one keeps its trace.
const TRACE_EVERY: usize = 5;

const CASES: [(&str, &str); 4] = [
    ("nothing", ""),
    ("dwell_ageing", "[[effects]]\nname = \"dwell_ageing\"\nbeta = 0.05\n"),
    ("sensor_gain_drift", "[[effects]]\nname = \"sensor_gain_drift\"\nrate_per_h = 0.03\n"),
    (
        "both",
        "[[effects]]\nname = \"dwell_ageing\"\nbeta = 0.05\n[[effects]]\nname = \"sensor_gain_drift\"\nrate_per_h = 0.03\n",
    ),
];

fn main() -> ExitCode {
    let Some(mut run) = guard::Run::from_args("diagnosis") else { return ExitCode::SUCCESS };
    let cases: Vec<_> = CASES.iter().filter(|(name, _)| run.wants(&format!("diagnosis/{name}"))).collect();
    if cases.is_empty() {
        return ExitCode::SUCCESS;
    }
    let base = Location::parse("asset:configs/twin-baseline.toml");
    let twin = Twin::new(&load_twin_document(&base, &[]).unwrap().read_twin().unwrap()).unwrap();
    let library = Library::of_twin(&twin, &base).unwrap();
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    println!("{PULLS} pulls, {} traces, {jobs} threads", PULLS.div_ceil(TRACE_EVERY));
    println!("{:20} {:>10} {:>14}  found", "campaign", "seconds", "comparisons");
    for (name, effects) in cases {
        let measured = campaign(effects);
        let started = Instant::now();
        compare_pulls(&measured, &twin, &library, jobs).unwrap();
        let once_s = started.elapsed().as_secs_f64();
        let started = Instant::now();
        let options = PullDiagnoseOptions { jobs, ..PullDiagnoseOptions::default() };
        let found = diagnose_pull_table(&measured, &twin, &library, &options, &|_| {}).unwrap();
        let seconds = started.elapsed().as_secs_f64();
        let named: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
        println!("{name:20} {seconds:10.1} {:14.0}  {}", seconds / once_s, named.join(", "));
        run.measured(&format!("diagnosis/{name}"), Unit::Seconds, vec![seconds]);
    }
    run.finish()
}

fn campaign(effects: &str) -> MeasuredPulls {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("twin.toml");
    let base = include_str!("../assets/configs/twin-baseline.toml");
    std::fs::write(&file, format!("{base}\n{effects}")).unwrap();
    let parts = ["ball_bearing", "long_shaft", "gear", "roller_bearing"].map(String::from).to_vec();
    let options = CampaignOptions { parts, pulls: PULLS, sessions: 4, ..Default::default() };
    let plan = plan_campaign(&options).unwrap();
    let mut measured = simulate_campaign(&Location::Disk(file), &[], &plan, 5).unwrap().pulls;
    for (i, pull) in measured.pulls.iter_mut().enumerate() {
        if i % TRACE_EVERY != 0 {
            pull.trace = None;
        }
    }
    measured
}
