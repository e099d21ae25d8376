//! `gripgen check`: what a sweep will be.

use crate::args::{CheckArgs, ConfigArgs, JsonArgs, TalkArgs};
use crate::failure::{Failure, code};
use crate::output::{JsonSink, count, duration, size};
use crate::outputs::Outputs;
use gripgen::record::{proto::gripgen_v1::Status, status_name};
use gripgen::tactile::{LINEAR_PRESSURE_SHARE, SimdLevel};
use gripgen::{Location, Plan, Project, plan};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &CheckArgs) -> Result<u8, Failure> {
    check("check", &args.config, None, &args.json, &args.talk)
}

/// Loads, tries out and reports; `sweep --dry-run` is the same.
pub fn check(
    verb: &'static str,
    config: &ConfigArgs,
    jobs: Option<usize>,
    json: &JsonArgs,
    talk: &TalkArgs,
) -> Result<u8, Failure> {
    let mut outputs = Outputs::of(verb, json.force).reads_config(&config.config, &config.set);
    let mut sink = JsonSink::open(json.json.as_deref(), &mut outputs)?;
    let project = Project::load(&Location::parse(&config.config), &config.set)?;
    let plan = plan(&project, SimdLevel::best())?;
    let jobs = jobs.unwrap_or_else(cores).max(1);
    let failed: Vec<_> = plan.probes.iter().filter(|p| p.failure.is_some()).collect();
    if sink.wanted() {
        let probes: Vec<_> = plan
            .probes
            .iter()
            .map(|p| json!({"index": p.index, "status": status_name(p.status), "failure": p.failure, "lag_exceeds_tolerance": p.lag_exceeds_tolerance, "pressure_over_modulus": p.pressure_over_modulus}))
            .collect();
        let grips: Vec<_> = plan
            .grips
            .iter()
            .map(|g| {
                let failed: Vec<_> = g
                    .failed
                    .iter()
                    .map(|(index, failure)| json!({"index": index, "failure": failure}))
                    .collect();
                json!({"part": g.part, "grip_pose": g.grip_pose, "tried": g.tried, "failed": failed})
            })
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
            "grips": grips,
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
    if !talk.quiet {
        eprint!("{}", warnings(&plan));
    }
    let grips_fail = plan.grips.iter().any(|g| !g.failed.is_empty());
    Ok(if failed.is_empty() && !grips_fail { 0 } else { code::SAMPLES_FAILED })
}

/// What a sweep over these grips and meshes will run into.
fn warnings(plan: &Plan) -> String {
    let mut text = String::new();
    for (part, open_edges) in &plan.open_meshes {
        text += &format!(
            "warning: the mesh of {part} is open: {open_edges} edges belong to one triangle only, gels sink into its holes\n"
        );
    }
    for grip in plan.grips.iter().filter(|g| !g.failed.is_empty()) {
        let (index, reason) = &grip.failed[0];
        text += &format!(
            "warning: {} of {} grips tried at the ends of the sweep's forces, offsets and angles fail with grip_pose {} of {}; \
             sample {index}: {reason}\n",
            grip.failed.len(),
            grip.tried,
            grip.grip_pose,
            grip.part
        );
    }
    if plan.grips.iter().any(|g| !g.failed.is_empty()) {
        text += "hint: `gripgen init` tries grips before it proposes them; narrow [vary], or move the grips in the twin\n";
    }
    text
}

/// Worker threads where the user names none.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The plan in words.
pub fn describe(project: &Project, plan: &Plan, jobs: usize) -> String {
    let sweep = &project.sweep;
    let mut text = format!(
        "{}: {} in {}, about {}\n",
        project.name,
        count(plan.samples, "sample"),
        count(plan.shards, "shard"),
        size(plan.estimated_bytes)
    );
    let cpu = plan.estimated_cpu.as_secs_f64();
    text += &format!("about {} on {}\n", duration(cpu / jobs as f64), count(jobs as u64, "core"));
    let varied: Vec<&str> = sweep.vary.iter().map(|v| v.key.as_str()).collect();
    text += &format!("varies: {}\n", varied.join(", "));
    text
}
