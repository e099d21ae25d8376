//! What follows from a diagnosis: the next pulls beside its files, and commands that can be copied.

use crate::Diagnosed;
use crate::args::DiagnoseArgs;
use crate::commands::rig::load_rig;
use crate::failure::Failure;
use crate::output::program;
use crate::outputs::{Outputs, is_special};
use crate::shell;
use crate::{NextPulls, unvaried};
use gripgen::record::{RIG_SOURCE, RunFolder};
use gripgen::twin::can_be_drawn;
use gripgen::{BASELINE_TWIN, Location, Project};
use gripgen_identify::{Channel, Diagnosis, Verdict};
use gripgen_measured::campaign_toml;
use std::path::{Path, PathBuf};

/// The sweep that works with every twin of ours.
const SHIPPED_SWEEP: &str = "asset:configs/quickstart.toml";

/// A number behind a name that is taken, at most.
const MOST: u32 = 99;

/// The file of the next pulls, where files are written at all: next to the twin, the JSON or the report.
pub fn next_file(args: &DiagnoseArgs) -> Option<PathBuf> {
    let json = args.json.json.as_deref().filter(|p| *p != "-").map(Path::new);
    let written = [args.out.as_deref(), json, args.report.as_deref()];
    let beside = written.into_iter().flatten().find(|path| !is_special(path))?;
    Some(beside.with_file_name("next.toml"))
}

/// Writes the campaign that separates what is tied. Where no pulls are left to make, the plan of an earlier diagnosis goes.
pub fn write_next(
    args: &DiagnoseArgs,
    outputs: &Outputs,
    diagnosed: &mut Diagnosed,
) -> Result<Option<PathBuf>, Failure> {
    let Some(path) = next_file(args) else { return Ok(None) };
    let Some(next) = &diagnosed.next else {
        let of_pulls = diagnosed.diagnosis.channel == Channel::Pulls;
        if of_pulls && outputs.remove(&path)? && !args.talk.quiet {
            eprintln!("removed {}: no pulls are left to make", path.display());
        }
        return Ok(None);
    };
    let text = next_toml(next, &args.measured, &args.twin, &diagnosed.diagnosis.data.sha256);
    outputs.write(&path, text.as_bytes())?;
    let own = diagnosed.diagnosis.effects.iter_mut().filter(|e| next.separates(&e.name));
    for separate in own.filter_map(|e| e.separate_by.as_mut()) {
        separate.campaign = Some(path.display().to_string());
    }
    Ok(Some(path))
}

/// The text of the next pulls; `twin` is the name of the one that was diagnosed.
pub fn next_toml(next: &NextPulls, measured: &Path, twin: &str, sha256: &str) -> String {
    let about = format!(
        "Planned by `gripgen diagnose` of {} with the twin {twin}.\nMeasurements: SHA-256 {sha256}\n{}.\nKeys are described in docs/format.md. `gripgen rig pull` makes these pulls where there is a rig.toml; for any other rig they are a list.",
        measured.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        next.text(),
    );
    campaign_toml(&next.campaign, &about)
}

/// What to do next: a sentence, and a command or nothing. At most two.
pub fn next_steps(args: &DiagnoseArgs, diagnosed: &Diagnosed, next: Option<&Path>) -> Vec<(String, String)> {
    let diagnosis = &diagnosed.diagnosis;
    if diagnosis.other_unit && diagnosis.verdict == Verdict::Insufficient {
        let text = "Write max_pull_force_n in newtons and grip_force_n in newtons of one jaw (force_convention = \"total\" in campaign.toml, where it is that of both), and diagnose again.";
        return vec![(text.into(), String::new())];
    }
    let mut steps = Vec::new();
    if let (Some(path), Some(plan)) = (next, &diagnosed.next) {
        steps.push(pulls_step(args, path, plan));
    }
    let found = matches!(diagnosis.verdict, Verdict::Effect | Verdict::Unknown);
    match &args.out {
        Some(out) if found => steps.push(sweep_step(args, out, diagnosis)),
        None if found => steps.push(("Write the corrected twin:".into(), again(args, next))),
        // Where pulls are planned already, another campaign is none of the next steps.
        _ if next.is_none() && plans_pulls(diagnosis) => {
            steps.push(("Plan pulls that can answer:".into(), plan_campaign(args)));
        }
        _ => {}
    }
    steps
}

fn plans_pulls(diagnosis: &Diagnosis) -> bool {
    diagnosis.verdict == Verdict::Insufficient && diagnosis.channel == Channel::Pulls
}

/// The next pulls: by a rig where the measurements are of one that is known, otherwise a list.
fn pulls_step(args: &DiagnoseArgs, next: &Path, plan: &NextPulls) -> (String, String) {
    let last = args.also.last().unwrap_or(&args.measured);
    let most_n = plan.campaign.pulls.iter().map(|pull| pull.grip_force_n).fold(0.0, f64::max);
    if let Some(rig) = rig_of(args, last, most_n) {
        let words = [program(), "rig", "pull", &shell::operand(&rig), "--campaign", &shell::path(next)];
        let out = unused("runs/next", "");
        let rest = ["--after", &shell::path(last), "-o", &shell::path(&out)];
        let text = "Make the pulls that tell apart what these could not:";
        return (text.into(), shell::command_line(&[&words[..], &rest[..]].concat()));
    }
    let limited = if args.rig.is_some() { "" } else { "; --rig RIG.toml plans only what a gripper can do" };
    let what = if plan.apart.is_empty() { "" } else { ", which tell apart what these could not" };
    let text = format!(
        "Make the pulls that {} lists{what} (up to {most_n} N a jaw{limited}).",
        shell::quoted(&next.to_string_lossy())
    );
    (text, String::new())
}

/// The rig that made the last measurements, if its file is known and its gripper is strong enough.
fn rig_of(args: &DiagnoseArgs, last: &Path, most_n: f64) -> Option<String> {
    if !RunFolder::open(last).is_ok_and(|run| run.info().source == RIG_SOURCE) {
        return None;
    }
    let usual = || Path::new("rig.toml").is_file().then(|| "rig.toml".to_string());
    let rig = args.rig.clone().or_else(usual)?;
    load_rig(&rig, &[]).is_ok_and(|rig| rig.gripper.force_per_jaw_n[1] >= most_n).then_some(rig)
}

/// A sweep with the corrected twin: that beside the twin, or the shipped one for a shipped twin, otherwise in words.
fn sweep_step(args: &DiagnoseArgs, out: &Path, diagnosis: &Diagnosis) -> (String, String) {
    let text = "Make training data with the corrected twin";
    let set = format!("twin={}", out.display());
    let sweep = match Location::parse(&args.twin) {
        Location::Disk(twin) => {
            let sweep = twin.with_file_name("sweep.toml");
            sweep.is_file().then(|| shell::path(&sweep))
        }
        Location::Asset(_) => Some(SHIPPED_SWEEP.to_string()),
    };
    match sweep {
        Some(sweep) => {
            let out_folder = unused("runs/corrected", "");
            let mut words = vec![program(), "sweep", &sweep, "--set", &set];
            let mut sets = vec![("twin".to_string(), out.display().to_string())];
            // Priors are of rigs that were not measured: they would draw what the twin now knows.
            if has_priors(&sweep) {
                words.extend(["--set", "priors=[]"]);
                sets.push(("priors".into(), "[]".into()));
            }
            let project = Project::load(&Location::parse(&sweep), &sets).ok();
            let ranges = project.as_ref().map(columns_to_vary).unwrap_or_default();
            let others = project.as_ref().map(|project| not_pulled(project, diagnosis)).unwrap_or_default();
            words.extend(ranges.iter().flat_map(|range| ["--set", range]));
            // What has no range in the twin stays as it is.
            if project.as_ref().is_some_and(|project| unvaried(project).len() > ranges.len()) {
                words.push("--allow-constant");
            }
            let out = shell::path(&out_folder);
            words.extend(["-o", &out]);
            (format!("{text}{others}:"), shell::command_line(&words))
        }
        None => {
            let set = shell::command_line(&["--set", &set]);
            (format!("{text}: `gripgen sweep` of your sweep file with {set}."), String::new())
        }
    }
}

/// Whether a sweep names files of priors.
fn has_priors(sweep: &str) -> bool {
    let text = Location::parse(sweep).read_text().ok();
    let table = text.and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("priors"))
}

/// Columns that the corrected twin depends on and the sweep leaves at one value: where the twin knows them, and the sweep takes them.
fn columns_to_vary(project: &Project) -> Vec<String> {
    let still = unvaried(project).into_iter();
    let drawn = still.filter(|column| can_be_drawn(&column.key));
    drawn.filter_map(|column| Some(format!("vary.{}={}", column.key, column.values?))).collect()
}

/// What the sweep draws and nobody pulled: the pulls say nothing of its friction.
fn not_pulled(project: &Project, diagnosis: &Diagnosis) -> String {
    let part = |key: &'_ String| key.strip_prefix("parts.")?.strip_suffix(".mu").map(String::from);
    let pulled: Vec<String> = diagnosis.baseline.keys().filter_map(part).collect();
    if diagnosis.channel != Channel::Pulls || pulled.is_empty() {
        return String::new();
    }
    let drawn = project.sweep.drawn_parts();
    let others: Vec<&str> = drawn.iter().copied().filter(|part| pulled.iter().all(|p| p != part)).collect();
    let of = pulled.join(", ");
    match others.len() {
        0 => String::new(),
        n if n == drawn.len() => format!(" (the pulls were of {of}, which this sweep does not draw)"),
        1 => format!(" (the pulls were of {of}; {} keeps the mu that it had)", others[0]),
        _ => format!(" (the pulls were of {of}; the other parts keep the mu that they had)"),
    }
}

/// The same diagnosis again, with the twin written. The plan that was just written is the same again.
fn again(args: &DiagnoseArgs, next: Option<&Path>) -> String {
    let mut words = vec![program().to_string(), "diagnose".into(), shell::path(&args.measured)];
    for also in &args.also {
        words.extend(["--also".into(), shell::path(also)]);
    }
    if args.include_suspect {
        words.push("--include-suspect".into());
    }
    words.extend(twin_words(&args.twin, &args.set, args.rig.as_deref()));
    if let Some(sensor) = &args.sensor {
        words.extend(["--sensor".into(), shell::operand(sensor)]);
    }
    if !args.without.is_empty() {
        words.extend(["--without".into(), args.without.join(",")]);
    }
    words.extend(["-o".into(), shell::path(&unused("diagnosed", ".toml"))]);
    if next == Some(Path::new("next.toml")) {
        words.push("--force".into());
    }
    shell::command_line(&words)
}

/// A first campaign of the parts of the twin.
fn plan_campaign(args: &DiagnoseArgs) -> String {
    let out = shell::path(&unused("campaign", ".toml"));
    let mut words = vec![program().to_string(), "campaign".into(), "-o".into(), out];
    words.extend(twin_words(&args.twin, &args.set, args.rig.as_deref()));
    shell::command_line(&words)
}

/// Twin, changed keys and rig as they were typed; what is the default is left out.
pub fn twin_words(twin: &str, set: &[(String, String)], rig: Option<&str>) -> Vec<String> {
    let mut words = Vec::new();
    if twin != BASELINE_TWIN {
        words.extend(["--twin".into(), shell::operand(twin)]);
    }
    for (key, value) in set {
        words.extend(["--set".into(), format!("{key}={value}")]);
    }
    if let Some(rig) = rig {
        words.extend(["--rig".into(), shell::operand(rig)]);
    }
    words
}

/// `STEM.END`, or the first with a number behind its stem that does not exist.
fn unused(stem: &str, end: &str) -> PathBuf {
    let plain = PathBuf::from(format!("{stem}{end}"));
    let numbered = (2..=MOST).map(|k| PathBuf::from(format!("{stem}-{k}{end}")));
    std::iter::once(plain.clone()).chain(numbered).find(|at| !at.exists()).unwrap_or(plain)
}

#[cfg(test)]
mod tests;
