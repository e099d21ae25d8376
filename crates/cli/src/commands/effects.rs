//! `gripgen effects`: the catalogue.

use crate::args::EffectsArgs;
use crate::failure::Failure;
use crate::load::{load_library, load_twin};
use crate::output::JsonSink;
use crate::outputs::Outputs;
use crate::{EffectCurve, effect_curve};
use gripgen::BASELINE_TWIN;
use gripgen::twin::config::suggestion;
use gripgen::twin::effects::{EffectSpec, Group, LIBRARY, ParameterSpec, PressNeeds, Seen, find};
use serde_json::{Value, json};
use std::fmt::Write;

/// Width of the bars of a curve on a screen, in characters.
const BAR: f64 = 32.0;
/// Rows of a curve on a screen.
const ROWS: usize = 13;
/// Width of a line of text.
const LINE: usize = 96;

/// Runs the verb.
pub fn run(args: &EffectsArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force);
    outputs.allow_all(args.plot.as_deref())?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let Some(id) = &args.id else {
        return sink.finish(false, || LIBRARY.iter().map(|spec| document(spec)).collect(), list);
    };
    let spec = find(id).ok_or_else(|| unknown(id))?;
    let twin = load_twin(BASELINE_TWIN, &[])?;
    let library = load_library(&twin, BASELINE_TWIN)?;
    let curve = effect_curve(spec, &twin, &library, 1).map_err(Failure::new)?;
    if let Some(path) = &args.plot {
        let title = format!("{} ({})", spec.id, typical(spec));
        outputs.write(path, curve.plot(&title).to_svg().as_bytes())?;
    }
    let mut whole = document(spec);
    whole["f_max"] = json!({ "covariate": curve.covariate, "x": curve.x, "ratio": curve.ratio });
    sink.finish(false, || whole, || page(spec) + &curve_text(spec, &curve))
}

fn unknown(id: &str) -> Failure {
    let hint = suggestion(id, LIBRARY.iter().map(|s| s.id))
        .map_or("`gripgen effects` lists them".into(), |name| format!("did you mean `{name}`?"));
    Failure::usage(format!("there is no effect `{id}`")).hint(hint)
}

/// Channels in which a diagnosis can find it.
fn found_in(spec: &EffectSpec) -> Vec<&'static str> {
    let channels = [
        (spec.pulls.is_ok(), "pulls"),
        (spec.table.is_some(), "sensor tables"),
        (spec.presses.is_some(), "presses"),
    ];
    channels.into_iter().filter(|(finds, _)| *finds).map(|(_, name)| name).collect()
}

/// The same with what has to vary, or why nothing finds it.
fn found_text(spec: &EffectSpec) -> String {
    let channels = found_in(spec).join(", ");
    let varies = |spans| [spec.covariates, spans].concat().join(" or ");
    match spec.pulls {
        Err(why) if channels.is_empty() => format!("nothing: {why}"),
        Err(_) => match varies(&[]) {
            names if names.is_empty() => channels,
            names => format!("{channels}, where {names} varies"),
        },
        Ok(fit) => {
            let shown = match fit.seen {
                Seen::InLabels => "",
                Seen::InDisplacements => ", and displacements of traces show it",
            };
            match varies(fit.spans) {
                names if names.is_empty() => format!("{channels}{shown}"),
                names => format!("{channels}, of pulls where {names} varies{shown}"),
            }
        }
    }
}

fn list() -> String {
    let mut text = String::new();
    for group in Group::ALL {
        let _ = writeln!(text, "{}", group.title());
        for spec in LIBRARY.iter().filter(|s| s.group == group) {
            let _ = writeln!(text, "  {:<22} {}", spec.id, spec.about);
        }
        text.push('\n');
    }
    let _ = writeln!(text, "{} effects; `gripgen effects ID` explains one.", LIBRARY.len());
    text
}

/// A parameter's value in its unit.
fn with_unit(p: &ParameterSpec, value: f64) -> String {
    if p.unit == "1" { format!("{} = {value}", p.name) } else { format!("{} = {value} {}", p.name, p.unit) }
}

fn typical(spec: &EffectSpec) -> String {
    let named = |(name, value): &(&str, f64)| Some(with_unit(&spec.parameters[spec.position(name)?], *value));
    spec.typical.iter().filter_map(named).collect::<Vec<_>>().join(", ")
}

/// A heading with a text beside it, broken into lines.
fn paragraph(text: &mut String, heading: &str, body: &str) {
    let mut line = format!("  {heading:<12}");
    let mut fresh = true;
    for word in body.split_whitespace() {
        if !fresh && line.len() + 1 + word.len() > LINE {
            let _ = writeln!(text, "{}", line.trim_end());
            line = " ".repeat(14);
            fresh = true;
        }
        if !fresh {
            line.push(' ');
        }
        line.push_str(word);
        fresh = false;
    }
    let _ = writeln!(text, "{}", line.trim_end());
}

fn page(spec: &EffectSpec) -> String {
    let mut text = format!("{}: {}\n\n", spec.id, spec.about);
    paragraph(&mut text, "", spec.plainly);
    text.push('\n');
    paragraph(&mut text, "formula", spec.formula);
    paragraph(&mut text, "source", spec.source);
    paragraph(&mut text, "acts on", &spec.acts_on().join(", "));
    for (k, p) in spec.parameters.iter().enumerate() {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        let set = if spec.references.contains(&p.name) { ", set and not fitted" } else { "" };
        let (low, high) = p.bounds;
        let body = format!(
            "{}: {}; {low} to {high}{unit}, {} where it is left out{set}",
            p.name, p.about, p.neutral
        );
        paragraph(&mut text, if k == 0 { "parameters" } else { "" }, &body);
    }
    paragraph(&mut text, "its number", spec.number_means);
    paragraph(&mut text, "found in", &found_text(spec));
    for (k, experiment) in spec.experiments.iter().enumerate() {
        paragraph(&mut text, if k == 0 { "shown by" } else { "" }, experiment.text());
    }
    paragraph(&mut text, "what to do", spec.remedy);
    text
}

fn curve_text(spec: &EffectSpec, curve: &EffectCurve) -> String {
    let mut text = format!("\n  label over that without it, for {}\n", typical(spec));
    if curve.ratio.iter().all(|r| (r - 1.0).abs() < 1e-9) {
        text += "  1 everywhere: it does not change the label\n";
        return text;
    }
    let largest = curve.ratio.iter().copied().filter(|r| r.is_finite()).fold(1.0, f64::max);
    let _ = writeln!(text, "  {:>20}   ratio", curve.covariate);
    for (x, ratio) in curve.x.iter().zip(&curve.ratio).step_by(curve.x.len().div_ceil(ROWS)) {
        let bar = "#".repeat((BAR * ratio / largest).clamp(0.0, BAR).round() as usize);
        let _ = writeln!(text, "  {:>20} {ratio:>7.3} {bar}", (x * 1e3).round() / 1e3);
    }
    text
}

/// Everything that is known of an effect.
fn document(spec: &EffectSpec) -> Value {
    let parameter = |p: &ParameterSpec| {
        json!({
            "name": p.name, "unit": p.unit, "neutral": p.neutral, "low": p.bounds.0, "high": p.bounds.1,
            "about": p.about, "fitted": !spec.references.contains(&p.name),
        })
    };
    let typical: serde_json::Map<String, Value> =
        spec.typical.iter().map(|(name, value)| (name.to_string(), json!(value))).collect();
    json!({
        "id": spec.id,
        "group": spec.group.title(),
        "about": spec.about,
        "formula": spec.formula,
        "source": spec.source,
        "plainly": spec.plainly,
        "number_means": spec.number_means,
        "remedy": spec.remedy,
        "parameters": spec.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "typical": typical,
        "acts_on": spec.acts_on(),
        "covariates": spec.covariates,
        "found_in": found_in(spec),
        "not_in_pulls": spec.pulls.err(),
        "shown_by": spec.experiments.iter().map(|e| e.text()).collect::<Vec<_>>(),
        "traits": {
            "of_pressure": spec.of_pressure,
            "reads_clock": spec.reads_clock,
            "remembers": spec.remembers,
            "acts_on_signals": spec.acts_on_signals(),
            "upright_only": spec.upright_only,
            "per_part": spec.per_part,
            "seen_in_images": spec.optics.is_some() || spec.imprint_volume.is_some() || spec.normal_force.is_some() || spec.tilt_rad.is_some(),
            "drawn": spec.presses.is_some_and(|fit| fit.drawn),
            "needs_marks": spec.presses.is_some_and(|fit| fit.needs == PressNeeds::Marks),
        },
    })
}
