//! `gripgen check`: what a sweep will be.

use crate::args::{CheckArgs, ConfigArgs, JsonArgs, TalkArgs};
use crate::failure::{Failure, code};
use crate::load;
use crate::output::{JsonSink, count, duration, size};
use crate::outputs::Outputs;
use crate::shell;
use crate::{Beyond, LabelShares, Unvaried, beyond, label_shares, unvaried};
use crate::{Plan, plan};
use gripgen::record::{proto::gripgen_v1::Status, status_name};
use gripgen::tactile::{LINEAR_PRESSURE_SHARE, SimdLevel};
use gripgen::twin::config::ImageStorage;
use gripgen::{Location, Project};
use serde_json::json;
use std::path::Path;

/// Runs the verb.
pub fn run(args: &CheckArgs) -> Result<u8, Failure> {
    check(&args.config, None, &args.json, &args.talk)
}

/// Loads, tries out and reports; `sweep --dry-run` is the same.
pub fn check(
    config: &ConfigArgs,
    jobs: Option<usize>,
    json: &JsonArgs,
    talk: &TalkArgs,
) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(json.force).reads_config(&config.config, &config.set);
    let mut sink = JsonSink::open(json.json.as_deref(), &mut outputs)?;
    let project = load(config)?;
    let plan = plan(&project, SimdLevel::best())?;
    let jobs = jobs.unwrap_or_else(load::jobs).max(1);
    let failed: Vec<_> = plan.probes.iter().filter(|p| p.failure.is_some()).collect();
    let shares = label_shares(&project, jobs);
    let warnings =
        [of_columns(&project), of_probes(&plan), of_plan(&plan), of_shares(&project, shares.as_ref())]
            .concat();
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
            "unverified_sensors": unverified_sensors(&project),
            "label_shares": shares.as_ref().map(LabelShares::json),
            "warnings": warnings,
        }))?;
    }
    if !talk.quiet {
        eprint!("{}", describe(&project, &plan, jobs));
        shares.iter().for_each(|shares| eprintln!("{shares}"));
        for warning in &warnings {
            eprintln!("warning: {warning}");
        }
        if plan.grips.iter().any(|g| !g.failed.is_empty()) {
            eprintln!(
                "hint: `gripgen init` tries grips before it proposes them; narrow [vary], or move the grips in the twin"
            );
        }
    }
    let grips_fail = plan.grips.iter().any(|g| !g.failed.is_empty());
    Ok(if failed.is_empty() && !grips_fail { 0 } else { code::SAMPLES_FAILED })
}

/// The sensor files of the twin that stand for a real sensor and were not compared with it.
fn unverified_sensors(project: &Project) -> Vec<&str> {
    let optics = project.twin.optics.iter().map(|(_, optics)| optics);
    let unverified = optics.filter(|optics| project.library.sensor(optics).is_ok_and(|s| s.unverified));
    let mut names: Vec<&str> = unverified.map(|optics| optics.sensor.as_str()).collect();
    names.dedup();
    names
}

/// The sweep that was named.
pub(super) fn load(config: &ConfigArgs) -> Result<Project, Failure> {
    let path = Path::new(&config.config);
    if path.is_dir() {
        let inside = path.join("sweep.toml");
        let hint = match inside.is_file() {
            true => format!("its sweep is {}", shell::quoted(&shell::path(&inside))),
            false => "name the TOML file of a sweep; `gripgen init FOLDER` writes one into a folder".into(),
        };
        return Err(
            Failure::usage(format!("{}: this is a folder, a file is wanted", path.display())).hint(hint)
        );
    }
    Ok(Project::load(&Location::parse(&config.config), &config.set)?)
}

/// What the twin depends on and the sweep leaves at one value, or beyond what the twin knows of it, a sentence each.
pub(super) fn of_columns(project: &Project) -> Vec<String> {
    let still = unvaried(project);
    let beyond = beyond(project);
    still.iter().map(Unvaried::to_string).chain(beyond.iter().map(Beyond::to_string)).collect()
}

/// That the sweep varies every column on which its twin depends: a set without them teaches that they do nothing.
///
/// # Errors
///
/// A column that has one value in every sample.
pub(super) fn all_varied(project: &Project) -> Result<(), Failure> {
    let still: Vec<String> = unvaried(project).iter().map(Unvaried::to_string).collect();
    if still.is_empty() {
        return Ok(());
    }
    Err(Failure::usage(still.join("\n"))
        .hint("add the line to the sweep file, or make every sample at one value with --allow-constant"))
}

/// What the samples that were tried out run into.
fn of_probes(plan: &Plan) -> Vec<String> {
    let mut all = Vec::new();
    for probe in &plan.probes {
        let index = probe.index;
        if probe.lag_exceeds_tolerance {
            all.push(format!(
                "sample {index}: the force loop trails the staircase by more than half the label tolerance, its label may come \
                 before the slip; smaller increments or longer steps help"
            ));
        }
        if let Some(share) = probe.pressure_over_modulus.filter(|share| *share > LINEAR_PRESSURE_SHARE) {
            all.push(format!(
                "sample {index}: the contact's mean pressure is {share:.2} times the gel's modulus, linear elasticity holds to \
                 about {LINEAR_PRESSURE_SHARE}: press and image are an extrapolation; a lighter grip or a stiffer gel \
                 (young_modulus_mpa) stays inside, `model = \"pyramid\"` has no such limit"
            ));
        }
        match probe.status {
            Status::Failed => {
                all.push(format!("sample {index} will fail: {}", probe.failure.as_deref().unwrap_or("")));
            }
            Status::NoContact => all.push(format!("sample {index} misses the part (label 0, no_contact)")),
            Status::Censored => {
                all.push(format!("sample {index} ends before the jaws slip (censored: a lower bound)"));
            }
            _ => {}
        }
    }
    all
}

/// What a sweep over these grips and meshes will run into.
fn of_plan(plan: &Plan) -> Vec<String> {
    let open = plan.open_meshes.iter().map(|(part, open_edges)| {
        format!(
            "the mesh of {part} is open: {open_edges} edges belong to one triangle only, gels sink into its holes"
        )
    });
    let failing = plan.grips.iter().filter(|g| !g.failed.is_empty()).map(|grip| {
        let (index, reason) = &grip.failed[0];
        format!(
            "{} of {} grips tried at the ends of the sweep's forces, offsets and angles fail with grip_pose {} of {}; sample \
             {index}: {reason}",
            grip.failed.len(),
            grip.tried,
            grip.grip_pose,
            grip.part
        )
    });
    open.chain(failing).collect()
}

/// Share of the label's variance below which images say nothing of it.
const NOTHING: f64 = 0.01;

/// What images can teach of the labels, where that is little.
fn of_shares(project: &Project, shares: Option<&LabelShares>) -> Vec<String> {
    let has_images = project.sweep.images != ImageStorage::None;
    let little = shares.filter(|shares| has_images && shares.seen < NOTHING);
    let said = |shares: &LabelShares| {
        format!(
            "images say nothing of these labels but which part it is: pose and contact move {:.1} % of their variance. Friction \
             that depends on the contact changes that: priors = [\"asset:priors/friction.toml\", ...] (docs/training.md)",
            100.0 * shares.seen
        )
    };
    little.map(said).into_iter().collect()
}

/// The shares as JSON.
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
    let varies = sweep.vary.iter().filter(|v| v.distribution.constant().is_none());
    let varied: Vec<&str> = varies.map(|v| v.key.as_str()).collect();
    let varied = if varied.is_empty() { "nothing".into() } else { varied.join(", ") };
    text += &format!("varies: {varied}\n");
    for sensor in unverified_sensors(project) {
        text += &format!("{sensor}: no press of the real sensor was compared with this file\n");
    }
    text
}
