//! `gripgen check`: what a sweep will be.

use crate::args::{CheckArgs, ConfigArgs, TalkArgs};
use crate::failure::{Failure, code};
use crate::output::{JsonSink, duration, size};
use gripgen::tactile::SimdLevel;
use gripgen::{Location, Plan, Project, plan};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &CheckArgs) -> Result<u8, Failure> {
    check(&args.config, args.json.json.as_deref(), &args.talk)
}

/// Loads, tries out and reports; `sweep --dry-run` is the same.
pub fn check(config: &ConfigArgs, json: Option<&str>, talk: &TalkArgs) -> Result<u8, Failure> {
    let project = Project::load(&Location::parse(&config.config), &config.set)?;
    let mut sink = JsonSink::open(json)?;
    let plan = plan(&project, SimdLevel::best()).map_err(Failure::new)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let failed: Vec<_> = plan.probes.iter().filter_map(|(i, failure)| Some((i, failure.as_ref()?))).collect();
    if sink.wanted() {
        let probes: Vec<_> =
            plan.probes.iter().map(|(i, failure)| json!({"index": i, "failure": failure})).collect();
        sink.document(&json!({
            "schema": "gripgen.plan/1",
            "name": project.name,
            "config_sha256": project.config_sha256,
            "samples": plan.samples,
            "shards": plan.shards,
            "estimated_bytes": plan.estimated_bytes,
            "estimated_cpu_s": plan.estimated_cpu.as_secs_f64(),
            "probes": probes,
        }))?;
    }
    if !talk.quiet {
        eprint!("{}", describe(&project, &plan, cores));
        for (index, failure) in &failed {
            eprintln!("warning: sample {index} will fail: {failure}");
        }
    }
    Ok(if failed.is_empty() { 0 } else { code::SAMPLES_FAILED })
}

/// The plan in words.
pub fn describe(project: &Project, plan: &Plan, jobs: usize) -> String {
    let sweep = &project.sweep;
    let mut text = format!(
        "{}: {} samples in {} shards, about {}\n",
        project.name,
        plan.samples,
        plan.shards,
        size(plan.estimated_bytes)
    );
    let cpu = plan.estimated_cpu.as_secs_f64();
    text += &format!("about {} on {jobs} cores\n", duration(cpu / jobs as f64));
    let varied: Vec<&str> = sweep.vary.iter().map(|v| v.key.as_str()).collect();
    text += &format!("varies: {}\n", varied.join(", "));
    text
}
