//! What a diagnosis writes and says.

use crate::args::DiagnoseArgs;
use crate::failure::Failure;
use crate::mark::Format;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::posterior;
use gripgen::identify::{Diagnosis, HeldOutError, NamedEffect, ParameterEstimate, PosteriorFile, Verdict};
use gripgen::record::campaign_toml;
use gripgen::{Diagnosed, Location, NextPulls, diagnosis_page, edited_twin_toml};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Twin, report, JSON, and a summary for people.
pub fn write(
    args: &DiagnoseArgs,
    outputs: &Outputs,
    mut sink: JsonSink,
    mut diagnosed: Diagnosed,
) -> Result<u8, Failure> {
    if diagnosed.report.title.is_empty() {
        diagnosed.report.title = args.measured.display().to_string();
    }
    let next = write_next(args, outputs, &mut diagnosed)?;
    let draws = args.out.as_deref().and_then(posterior::beside);
    if let (Some(draws), Some(posterior)) = (draws.as_deref().and_then(Path::file_name), &diagnosed.posterior)
    {
        let file = draws.to_string_lossy().into_owned();
        diagnosed.diagnosis.posterior = Some(PosteriorFile { file, draws: posterior.draws.len() });
    }
    if let Some(report) = &args.report {
        outputs.write(report, Format::Html, diagnosis_page(&diagnosed).as_bytes())?;
    }
    if sink.wanted() {
        let value = serde_json::to_value(&diagnosed.diagnosis).map_err(Failure::new)?;
        sink.document(&value)?;
    }
    if let Some(out) = &args.out {
        let text = edited_twin_toml(&Location::parse(&args.twin), &args.set, &diagnosed.edits, out);
        posterior::write(outputs, out, &text.map_err(Failure::new)?, diagnosed.posterior.as_ref())?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&summary(&diagnosed.diagnosis))?;
    }
    if !args.talk.quiet {
        let draws = draws.filter(|_| diagnosed.posterior.is_some());
        for (path, what) in [
            (&args.out, "the twin"),
            (&draws, "its posterior"),
            (&args.report, "the report"),
            (&next, "the next pulls"),
        ] {
            if let Some(path) = path {
                eprintln!("{what}: {}", path.display());
            }
        }
    }
    Ok(0)
}

/// The campaign that separates what is tied, beside the twin, the JSON or the report. Nobody's own file is written over.
fn write_next(
    args: &DiagnoseArgs,
    outputs: &Outputs,
    diagnosed: &mut Diagnosed,
) -> Result<Option<PathBuf>, Failure> {
    let beside = [
        args.out.as_deref(),
        args.json.json.as_deref().filter(|p| *p != "-").map(Path::new),
        args.report.as_deref(),
    ];
    let Some(beside) = beside.into_iter().flatten().next() else { return Ok(None) };
    let path = beside.with_file_name("next.toml");
    let Some(next) = &diagnosed.next else {
        // Those of an earlier diagnosis hold no longer.
        return outputs.remove_own(&path).map(|()| None);
    };
    if outputs.judge(&path).is_err() {
        let note = format!(
            "{} is not of a diagnosis, or was edited, and was left alone: the next pulls were not written",
            path.display()
        );
        diagnosed.diagnosis.notes.push(note);
        return Ok(None);
    }
    outputs.write(&path, Format::Toml, next_toml(next, &args.measured).as_bytes())?;
    let own = diagnosed.diagnosis.effects.iter_mut().filter(|e| next.separates(&e.name));
    for separate in own.filter_map(|e| e.separate_by.as_mut()) {
        separate.campaign = Some(path.display().to_string());
    }
    Ok(Some(path))
}

/// The text of the next pulls.
pub fn next_toml(next: &NextPulls, measured: &Path) -> String {
    let about = format!(
        "Planned by `gripgen diagnose` of {}.\n{}.\nKeys are described in docs/format.md. Run it with `gripgen rig pull`.",
        measured.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        next.text(),
    );
    campaign_toml(&next.campaign, &about)
}

/// Parameters of an effect that are shown; a background has dozens.
const SHOWN: usize = 8;

/// The parameters of an effect by name, the largest ones where there are many.
fn largest(effect: &NamedEffect) -> Vec<(&String, &ParameterEstimate)> {
    let mut all: Vec<_> = effect.parameters.iter().collect();
    if all.len() > SHOWN {
        all.sort_by(|a, b| b.1.value.abs().total_cmp(&a.1.value.abs()));
        all.truncate(SHOWN);
    }
    all
}

/// A few lines for people.
fn summary(diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    let word = match diagnosis.verdict {
        Verdict::None => "nothing beyond the baseline was found",
        Verdict::Effect => "the twin lacks an effect",
        Verdict::Unknown => "there is structure that no effect of the library explains",
        Verdict::Insufficient => "the data cannot answer",
    };
    let _ = writeln!(text, "verdict: {word}");
    if let Some(plain) = &diagnosis.plain {
        let _ = writeln!(text, "  {plain}");
    }
    for effect in &diagnosis.effects {
        let _ = writeln!(text, "  {} (weight {:.2})", effect.name, effect.weight);
        for (name, p) in largest(effect) {
            let unit = if p.unit == "1" { "" } else { &p.unit };
            let end = if p.at_bound { ", at its bound" } else { "" };
            let _ =
                writeln!(text, "    {name} = {:.4} {unit} ({:.4} to {:.4}){end}", p.value, p.low90, p.high90);
        }
        let more = effect.parameters.len().saturating_sub(SHOWN);
        if more > 0 {
            let _ = writeln!(text, "    and {more} smaller ones (--json has them)");
        }
        for rival in &effect.indistinguishable_from {
            let _ = writeln!(text, "    not told apart from {} (weight {:.2})", rival.name, rival.weight);
        }
        if let Some(separate) = &effect.separate_by {
            let _ = writeln!(text, "    to tell them apart: {}", separate.text);
        }
    }
    for hint in &diagnosis.hints {
        let _ = writeln!(text, "  looked like {}: {}", hint.name, hint.reason);
    }
    for unknown in &diagnosis.unknown {
        let _ = writeln!(
            text,
            "  depends on {} in an unknown way (explains {:.0} % of the residual, p {:.3})",
            unknown.covariate,
            100.0 * unknown.strength,
            unknown.p_value
        );
    }
    if let Some(error) = &diagnosis.error {
        let _ = writeln!(
            text,
            "error on held-out {}: {} before, {} after{}",
            error.heldout,
            one(&error.before),
            one(&error.after),
            floor(diagnosis)
        );
    }
    if !diagnosis.data.outliers.is_empty() {
        let _ = writeln!(text, "outliers: {}", diagnosis.data.outliers.join(", "));
    }
    for note in &diagnosis.notes {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

fn floor(diagnosis: &Diagnosis) -> String {
    let (n, mm3) = (diagnosis.noise_floor_n, diagnosis.noise_floor_mm3);
    let text = n.map(|f| format!(", floor {f:.3} N")).or(mm3.map(|f| format!(", floor {f:.3} mm^3")));
    text.unwrap_or_default()
}

fn one(error: &HeldOutError) -> String {
    match (error.rmse_n.or(error.rmse_mm3), error.mse) {
        (Some(rmse), _) if error.rmse_mm3.is_some() => {
            format!("{rmse:.3} mm^3 ({:.3} to {:.3})", error.low90, error.high90)
        }
        (Some(rmse), _) => format!("{rmse:.3} N ({:.3} to {:.3})", error.low90, error.high90),
        (None, Some(mse)) => format!("{mse:.2} grey levels^2 ({:.2} to {:.2})", error.low90, error.high90),
        (None, None) => "not measured".into(),
    }
}
