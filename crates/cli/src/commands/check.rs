//! `gripgen check`: what a sweep will be.

use crate::args::{CheckArgs, ConfigArgs, TalkArgs};
use crate::failure::{Failure, code};
use crate::output::{JsonSink, duration, size};
use gripgen::record::{proto::gripgen_v1::Status, status_name};
use gripgen::tactile::{LINEAR_PRESSURE_SHARE, SimdLevel};
use gripgen::{Location, Plan, Project, plan};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &CheckArgs) -> Result<u8, Failure> {
    check(&args.config, None, args.json.json.as_deref(), &args.talk)
}

/// Loads, tries out and reports; `sweep --dry-run` is the same.
pub fn check(
    config: &ConfigArgs,
    jobs: Option<usize>,
    json: Option<&str>,
    talk: &TalkArgs,
) -> Result<u8, Failure> {
    let project = Project::load(&Location::parse(&config.config), &config.set)?;
    let mut sink = JsonSink::open(json)?;
    let plan = plan(&project, SimdLevel::best())?;
    let jobs = jobs.unwrap_or_else(cores).max(1);
    let failed: Vec<_> = plan.probes.iter().filter(|p| p.failure.is_some()).collect();
    if sink.wanted() {
        let probes: Vec<_> = plan
            .probes
            .iter()
            .map(|p| json!({"index": p.index, "status": status_name(p.status), "failure": p.failure, "lag_exceeds_tolerance": p.lag_exceeds_tolerance, "pressure_over_modulus": p.pressure_over_modulus}))
            .collect();
        sink.document(&json!({
            "schema": "gripgen.plan/1",
            "name": project.name,
            "config_sha256": project.config_sha256,
            "samples": plan.samples,
            "shards": plan.shards,
            "estimated_bytes": plan.estimated_bytes,
            "estimated_cpu_s": plan.estimated_cpu.as_secs_f64(),
            "jobs": jobs,
            "probes": probes,
        }))?;
    }
    if !talk.quiet {
        eprint!("{}", describe(&project, &plan, jobs));
        for probe in &plan.probes {
            let index = probe.index;
            if probe.lag_exceeds_tolerance {
                eprintln!(
                    "warning: sample {index}: the force loop trails the staircase by more than half the label \
                     tolerance, its label may come before the slip; smaller increments or longer steps help"
                );
            }
            if let Some(share) = probe.pressure_over_modulus.filter(|share| *share > LINEAR_PRESSURE_SHARE) {
                eprintln!(
                    "warning: sample {index}: the contact's mean pressure is {share:.2} times the gel's modulus, linear \
                     elasticity holds to about {LINEAR_PRESSURE_SHARE}: press and image are an extrapolation; a lighter grip or \
                     a stiffer gel (young_modulus_mpa) stays inside, `model = \"pyramid\"` has no such limit"
                );
            }
            match probe.status {
                Status::Failed => {
                    eprintln!(
                        "warning: sample {index} will fail: {}",
                        probe.failure.as_deref().unwrap_or("")
                    );
                }
                Status::NoContact => {
                    eprintln!("warning: sample {index} misses the part (label 0, no_contact)");
                }
                Status::Censored => {
                    eprintln!("warning: sample {index} ends before the jaws slip (censored: a lower bound)");
                }
                _ => {}
            }
        }
    }
    Ok(if failed.is_empty() { 0 } else { code::SAMPLES_FAILED })
}

/// Worker threads where the user names none.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
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
