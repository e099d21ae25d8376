//! What a diagnosis writes and says.

use super::next::{next_steps, write_next};
use super::notes::deciding;
use crate::args::DiagnoseArgs;
use crate::failure::Failure;
use crate::output::{JsonSink, print};
use crate::outputs::{Outputs, draws_of};
use crate::{Diagnosed, edited_twin_toml};
use gripgen::Location;
use gripgen::twin::rounded;
use gripgen_identify::{Diagnosis, HeldOutError, NamedEffect, ParameterEstimate, PosteriorFile, Verdict};
use gripgen_report::diagnosis_page;
use std::fmt::Write;
use std::path::Path;

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
    let draws = args.out.as_deref().and_then(draws_of);
    if let (Some(draws), Some(posterior)) = (draws.as_deref().and_then(Path::file_name), &diagnosed.posterior)
    {
        let file = draws.to_string_lossy().into_owned();
        diagnosed.diagnosis.posterior = Some(PosteriorFile { file, draws: posterior.draws.len() });
    }
    if let Some(out) = &args.out {
        let sets = [&args.set[..], &diagnosed.sets].concat();
        let text = edited_twin_toml(&Location::parse(&args.twin), &sets, &diagnosed.edits, out);
        outputs.write_twin(out, &text.map_err(Failure::new)?, diagnosed.posterior.as_ref())?;
    }
    // The twin is there: what its sweep has to vary depends on it.
    diagnosed.report.next = next_steps(args, &diagnosed, next.as_deref());
    if let Some(report) = &args.report {
        outputs.write(report, diagnosis_page(&diagnosed.diagnosis, &diagnosed.report).as_bytes())?;
    }
    if sink.wanted() {
        let value = serde_json::to_value(&diagnosed.diagnosis).map_err(Failure::new)?;
        sink.document(&value)?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        // All notes come with `-v`.
        let notes = if args.talk.verbose { vec![] } else { deciding(&diagnosed.diagnosis) };
        let mut text = in_short(&diagnosed.diagnosis, &notes, &diagnosed.report.next);
        if args.talk.verbose {
            text += &format!("\n{}", summary(&diagnosed.diagnosis));
        }
        print(&text)?;
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

/// The answer in five lines and the notes that decide, for somebody who reads nothing else; `-v` says the rest.
fn in_short(diagnosis: &Diagnosis, notes: &[String], next: &[(String, String)]) -> String {
    let mut text = String::new();
    let word = match diagnosis.verdict {
        Verdict::None => "nothing beyond the baseline was found",
        Verdict::Effect => "the twin lacks an effect",
        Verdict::Unknown => "there is structure that no effect of the library explains",
        Verdict::Insufficient => "the data cannot answer",
    };
    let plain = diagnosis.plain.as_deref().unwrap_or(word);
    let _ = writeln!(text, "{plain}");
    let names: Vec<String> = diagnosis.effects.iter().map(with_values).collect();
    let unknown = diagnosis.unknown.iter().map(|u| match u.covariate.contains('*') {
        true => format!("what {} do", u.in_words()),
        false => format!("a curve in {}", u.covariate),
    });
    let names: Vec<String> = names.into_iter().chain(unknown).collect();
    let names = if names.is_empty() { String::new() } else { format!(": {}", names.join("; ")) };
    let _ = writeln!(text, "verdict: {word}{names}");
    if let Some(error) = &diagnosis.error {
        let floor = diagnosis.noise_floor_n.filter(|floor| floor.is_finite());
        let after = error.after.rmse_n;
        let floor = floor.map_or(String::new(), |floor| {
            let below = after.is_some_and(|after| after < floor);
            let nothing = if below { ", so nothing is left to explain" } else { "" };
            format!("; repetitions scatter by {} N{nothing}", rounded(floor, &[]))
        });
        let (before, after) = (short(&error.before), short(&error.after));
        let _ = writeln!(text, "error on held-out {}: {before} -> {after}{floor}", error.heldout);
    }
    let tied = diagnosis.effects.iter().filter(|e| !e.indistinguishable_from.is_empty());
    let tied: Vec<String> = tied
        .map(|e| {
            let rivals: Vec<&str> = e.indistinguishable_from.iter().map(|r| r.name.as_str()).collect();
            let how = e.separate_by.as_ref().map_or(String::new(), |s| format!(" ({})", s.text));
            format!("{} is not told apart from {}{how}", e.name, rivals.join(", "))
        })
        .collect();
    if !tied.is_empty() {
        let _ = writeln!(text, "tied: {}", tied.join("; "));
    }
    for note in notes {
        let _ = writeln!(text, "note: {note}");
    }
    if let Some((words, command)) = next.first() {
        let words = if command.is_empty() { in_a_line(words) } else { command.clone() };
        let _ = writeln!(text, "next: {words}");
    }
    text
}

/// A sentence behind a colon.
fn in_a_line(sentence: &str) -> String {
    let mut letters = sentence.chars();
    let first = letters.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
    first + letters.as_str().trim_end_matches('.')
}

/// An effect with its largest values; references that nobody fitted are left out.
fn with_values(effect: &NamedEffect) -> String {
    let fitted = largest(effect).into_iter().filter(|(_, p)| p.low90 != p.value || p.high90 != p.value);
    let values: Vec<String> = fitted
        .take(3)
        .map(|(name, p)| {
            let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
            let [value, low, high] = [p.value, p.low90, p.high90].map(|x| rounded(x, &[]));
            format!("{name} {value}{unit} ({low} to {high})")
        })
        .collect();
    let part = effect.part.as_ref().map_or(String::new(), |part| format!(" on {part}"));
    let values = if values.is_empty() { String::new() } else { format!(", {}", values.join(", ")) };
    format!("{}{part}{values}", effect.name)
}

fn short(error: &HeldOutError) -> String {
    match (error.rmse_n, error.mse) {
        (Some(rmse), _) => format!("{} N", rounded(rmse, &[])),
        (None, Some(mse)) => format!("{} grey levels^2", rounded(mse, &[])),
        (None, None) => "not measured".into(),
    }
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

/// All of it, for people.
fn summary(diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    for effect in &diagnosis.effects {
        let _ = writeln!(text, "  {} (weight {:.2})", effect.name, effect.weight);
        for (name, p) in largest(effect) {
            let unit = if p.unit == "1" { "" } else { &p.unit };
            let end = if p.at_bound { ", at its bound" } else { "" };
            let range = match p.low90 == p.value && p.high90 == p.value {
                true => "fixed".to_string(),
                false => format!("{:.4} to {:.4}", p.low90, p.high90),
            };
            let _ = writeln!(text, "    {name} = {:.4} {unit} ({range}){end}", p.value);
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
