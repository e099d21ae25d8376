//! What follows from a diagnosis: the next pulls beside its files, and commands that can be copied.

use crate::args::DiagnoseArgs;
use crate::commands::rig::load_rig;
use crate::failure::Failure;
use crate::mark::{Format, mark_of};
use crate::output::program;
use crate::outputs::Outputs;
use crate::shell;
use gripgen::identify::{Channel, Diagnosis, Verdict};
use gripgen::record::{RIG_SOURCE, RunFolder};
use gripgen_measured::campaign_toml;
use gripgen::twin::can_be_drawn;
use gripgen::{BASELINE_TWIN, Diagnosed, Location, Project};
use crate::{NextPulls, unvaried};
use std::path::{Path, PathBuf};

/// The sweep that works with every twin of ours.
const SHIPPED_SWEEP: &str = "asset:configs/quickstart.toml";

/// A number behind a name that is taken, at most.
const MOST: u32 = 99;

/// What became of the file with the next pulls.
#[derive(Debug, Default)]
pub struct NextFile {
    /// Where they were written.
    pub path: Option<PathBuf>,
    /// What became of a file that was there.
    pub said: Option<String>,
}

/// Writes the campaign that separates what is tied, beside the twin, the JSON or the report. Nobody's own file is written over, and
/// an earlier plan goes only where it was made for the same measurements.
pub fn write_next(
    args: &DiagnoseArgs,
    outputs: &Outputs,
    diagnosed: &mut Diagnosed,
) -> Result<NextFile, Failure> {
    let beside = [
        args.out.as_deref(),
        args.json.json.as_deref().filter(|p| *p != "-").map(Path::new),
        args.report.as_deref(),
    ];
    let Some(beside) = beside.into_iter().flatten().next() else { return Ok(NextFile::default()) };
    let path = beside.with_file_name("next.toml");
    let sha256 = diagnosed.diagnosis.data.sha256.clone();
    let Some(next) = &diagnosed.next else {
        return Ok(NextFile { path: None, said: earlier(outputs, &path, &sha256)? });
    };
    if outputs.judge(&path).is_err() {
        let note = format!(
            "{} is not of a diagnosis, or was edited, and was left alone: the next pulls were not written",
            path.display()
        );
        diagnosed.diagnosis.notes.push(note.clone());
        return Ok(NextFile { path: None, said: Some(note) });
    }
    let text = next_toml(next, &args.measured, &args.twin, &sha256);
    let planned = mark_of(&path).is_some_and(|mark| mark.verb == outputs.verb() && mark.whole);
    let said = (path.exists() && !is_for(&path, &sha256)).then(|| match planned {
        true => format!("{} was a plan for other measurements and was replaced", path.display()),
        false => {
            format!("{} was none of a diagnosis, or was edited, and was replaced (--force)", path.display())
        }
    });
    outputs.write(&path, Format::Toml, text.as_bytes())?;
    let own = diagnosed.diagnosis.effects.iter_mut().filter(|e| next.separates(&e.name));
    for separate in own.filter_map(|e| e.separate_by.as_mut()) {
        separate.campaign = Some(path.display().to_string());
    }
    Ok(NextFile { path: Some(path), said })
}

/// Whether a plan was made for these measurements.
fn is_for(path: &Path, sha256: &str) -> bool {
    let line = format!("# {}", made_for(sha256));
    !sha256.is_empty()
        && std::fs::read_to_string(path).is_ok_and(|text| text.lines().any(|other| other == line))
}

/// What becomes of the next pulls of an earlier diagnosis where there are none to make.
fn earlier(outputs: &Outputs, path: &Path, sha256: &str) -> Result<Option<String>, Failure> {
    let Some(mark) = mark_of(path).filter(|mark| mark.verb == outputs.verb()) else { return Ok(None) };
    let why = match (mark.whole, is_for(path, sha256)) {
        (false, _) => "somebody edited it",
        (_, false) => "it was not planned for these measurements as they are",
        _ => {
            outputs.remove_own(path)?;
            let said = format!("removed {}: of these measurements no pulls are left to make", path.display());
            return Ok((!path.exists()).then_some(said));
        }
    };
    Ok(Some(format!("{} of an earlier diagnosis was left there: {why}", path.display())))
}

/// The line of a plan that tells which measurements it was made for.
fn made_for(sha256: &str) -> String {
    format!("Measurements: SHA-256 {sha256}")
}

/// The text of the next pulls; `twin` is the name of the one that was diagnosed.
pub fn next_toml(next: &NextPulls, measured: &Path, twin: &str, sha256: &str) -> String {
    let about = format!(
        "Planned by `gripgen diagnose` of {} with the twin {twin}.\n{}\n{}.\nKeys are described in docs/format.md. `gripgen rig pull` makes these pulls where there is a rig.toml; for any other rig they are a list.",
        measured.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        made_for(sha256),
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
        None if found => steps.push(("Write the corrected twin:".into(), again(args))),
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
        let out = unused(Path::new("runs/next"));
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
            let out_folder = unused(Path::new("runs/corrected"));
            let mut words = vec![program(), "sweep", &sweep, "--set", &set];
            let project =
                Project::load(&Location::parse(&sweep), &[("twin".into(), out.display().to_string())]).ok();
            let ranges = project.as_ref().map(columns_to_vary).unwrap_or_default();
            let others = project.as_ref().map(|project| not_pulled(project, diagnosis)).unwrap_or_default();
            words.extend(ranges.iter().flat_map(|range| ["--set", range]));
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

/// The same diagnosis again, with the twin written.
fn again(args: &DiagnoseArgs) -> String {
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
    let outputs = Outputs::of("diagnose", false).reads(&args.measured).reads_config(&args.twin, &args.set);
    words.extend(["-o".into(), shell::path(&writable(&outputs, "diagnosed"))]);
    shell::command_line(&words)
}

/// A first campaign of the parts of the twin.
fn plan_campaign(args: &DiagnoseArgs) -> String {
    let outputs = Outputs::of("campaign", false).reads_config(&args.twin, &args.set);
    let out = shell::path(&writable(&outputs, "campaign"));
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

/// `STEM.toml`, or the first of `STEM-2.toml` and so on that a verb may write.
fn writable(outputs: &Outputs, stem: &str) -> PathBuf {
    let plain = PathBuf::from(format!("{stem}.toml"));
    let numbered = (2..=MOST).map(|k| PathBuf::from(format!("{stem}-{k}.toml")));
    std::iter::once(plain.clone()).chain(numbered).find(|at| outputs.judge(at).is_ok()).unwrap_or(plain)
}

/// A folder, or the first with a number behind its name that is not there.
fn unused(folder: &Path) -> PathBuf {
    let numbered = (2..=MOST).map(|k| PathBuf::from(format!("{}-{k}", folder.display())));
    std::iter::once(folder.to_path_buf())
        .chain(numbered)
        .find(|at| !at.exists())
        .unwrap_or_else(|| folder.into())
}

#[cfg(test)]
mod tests;
