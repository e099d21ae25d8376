//! The page: what its template is given.

use super::bars::{self, Bar, number};
use super::plot::{self, shorten};
use super::sentence::{error_unit, sentence};
use super::{Diagnosed, Plot, PlotGroup};
use crate::assets;
use gripgen_identify::{
    Channel, Detectable, Diagnosis, ErrorPair, HeldOutError, NamedEffect, ParameterEstimate, Verdict,
};
use gripgen_twin::effects::find;
use serde_json::{Value, json};

/// Points of all plots together; one takes about 12 bytes.
const ALL_POINTS: usize = 16_000;
/// Points of a series.
const SERIES_POINTS: usize = 800;
/// Plots of the page, and series of a plot.
const PLOTS: usize = 60;
const SERIES: usize = 12;
/// Rows of a table.
pub(super) const ROWS: usize = 40;
/// A value nearer to the neutral one, as a share of what is fitted, is that.
const AT_NEUTRAL: f64 = 1e-5;
/// Letters of a name and of a sentence.
pub(super) const NAME: usize = 60;
pub(super) const SENTENCE: usize = 600;
/// Letters of a command.
const COMMAND: usize = 8000;

/// The report of a diagnosis: one HTML page with its plots inside, which needs neither a network nor a script.
///
/// It stays below 500 kB whatever the size of the data: plots show at most so many points, tables so many rows, and what
/// was left out is said.
pub fn diagnosis_page(diagnosed: &Diagnosed) -> String {
    let (d, report) = (&diagnosed.diagnosis, &diagnosed.report);
    let floor = d.noise_floor_n.or(d.noise_floor_mse).or(d.noise_floor_mm3);
    let unit = if report.error_unit.is_empty() { error_unit(d.channel) } else { &report.error_unit };
    let said = if report.sentence.is_empty() { sentence(d) } else { report.sentence.clone() };
    let all = groups(&report.groups);
    // A group without plots is no section.
    let decides = report.decides.min(all.len());
    let page = json!({
        "title": clean(&report.title, NAME),
        "plain": d.plain.as_ref().map(|plain| clean(plain, SENTENCE)),
        "sentence": clean(&said, SENTENCE),
        "verdict": verdict(d.verdict),
        "facts": facts(d, floor, unit),
        "bars": error_bars(d).map(|b| bars::draw(&b, floor, unit)),
        "percent": percent(d),
        "effects": d.effects.iter().take(ROWS).map(effect).collect::<Vec<_>>(),
        "unknown": d.unknown.iter().take(ROWS).map(|u| json!({
            "name": clean(&u.covariate, NAME), "strength": number(100.0 * u.strength), "p": number(u.p_value),
        })).collect::<Vec<_>>(),
        "decisive": all[..decides],
        "groups": all[decides..],
        "next": report.next.iter().map(|(text, command)| json!({
            // A command that is cut off cannot be copied.
            "text": clean(text, SENTENCE), "command": clean(command, COMMAND),
        })).collect::<Vec<_>>(),
        "below_floor": below_floor(d, floor),
        "evidence": report.evidence.iter().take(ROWS).map(|e| json!({
            "name": clean(&e.name, NAME), "gain": number(e.heldout_gain), "error": number(e.standard_error),
            "heldout": number(e.heldout_error), "values": clean(&e.values, 2 * NAME), "fate": clean(&e.fate, 2 * NAME),
            "named": e.fate.starts_with("named"),
        })).collect::<Vec<_>>(),
        // Columns that a channel does not fill are left out.
        "evidence_error": report.evidence.iter().any(|e| e.heldout_error.is_finite()),
        "evidence_spread": report.evidence.iter().any(|e| e.standard_error.is_finite()),
        "unit": clean(unit, NAME),
        "seen": d.would_have_seen.iter().filter(|(name, s)| is_a_size(name, s)).take(ROWS).map(|(name, s)| json!({
            "name": clean(name, NAME), "parameter": clean(&s.parameter, NAME), "value": number(s.value),
            "power": number(100.0 * s.power),
        })).collect::<Vec<_>>(),
        "not_excited": names(&d.not_excited),
        "not_recorded": names(&d.not_recorded),
        "outliers": names(&d.data.outliers),
        "worst": report.worst.iter().take(ROWS).map(|w| json!({
            "id": clean(&w.id, NAME), "about": clean(&w.about, NAME), "measured": number(w.measured),
            "predicted": number(w.predicted), "deviations": number(w.deviations),
        })).collect::<Vec<_>>(),
        "baseline": d.baseline.iter().take(ROWS).map(|(key, e)| parameter(key, e)).collect::<Vec<_>>(),
        "notes": d.notes.iter().take(ROWS).map(|n| clean(n, SENTENCE)).collect::<Vec<_>>(),
        "left_out": left_out(diagnosed),
    });
    rendered(&page)
}

/// The page as HTML; sections that it lacks are left out.
pub(super) fn rendered(page: &Value) -> String {
    rendered_with("diagnosis.html", page)
}

/// The same with a template of `assets/templates/`; all pages share one style sheet.
pub(crate) fn rendered_with(name: &str, page: &Value) -> String {
    let mut environment = minijinja::Environment::new();
    for file in ["page.css", name] {
        environment
            .add_template_owned(file.to_string(), assets::text(&format!("templates/{file}")).to_string())
            .expect("a template of ours parses");
    }
    let template = environment.get_template(name).expect("it was just added");
    template.render(page).expect("the template asks for nothing that the page lacks")
}

/// A text of the data without control characters, not longer than `most`. The template escapes it.
pub(crate) fn clean(text: &str, most: usize) -> String {
    let plain: String =
        text.chars().filter(|c| !c.is_control() && !('\u{fffe}'..='\u{ffff}').contains(c)).collect();
    shorten(&plain, most)
}

fn verdict(verdict: Verdict) -> Value {
    let (class, word) = match verdict {
        Verdict::None => ("good", "nothing beyond the baseline"),
        Verdict::Effect => ("found", "effect"),
        Verdict::Unknown => ("open", "unknown dependence"),
        Verdict::Insufficient => ("open", "the data cannot answer"),
    };
    json!({"class": class, "word": word})
}

fn facts(d: &Diagnosis, floor: Option<f64>, unit: &str) -> Vec<Value> {
    let channel = match d.channel {
        Channel::Pulls => "pulls",
        Channel::Sensor => "force-sensor table",
        Channel::Presses => "tactile presses",
        Channel::Imprints => "imprints of grasps",
    };
    let counts = [
        (d.data.pulls, "pulls"),
        (d.data.traces, "with a trace"),
        (d.data.rows, "rows"),
        (d.data.presses, "presses"),
        (d.data.imprints, "imprints"),
        (d.data.grasps, "grasps"),
    ];
    let size: Vec<String> = counts.iter().filter_map(|(n, what)| n.map(|n| format!("{n} {what}"))).collect();
    let mut facts =
        vec![json!({"name": "channel", "value": channel}), json!({"name": "data", "value": size.join(", ")})];
    if let Some(floor) = floor {
        let value = format!("{} {}", number(floor), clean(unit, NAME));
        facts.push(json!({"name": "noise floor (repetitions)", "value": value}));
    }
    facts.push(json!({"name": "SHA-256 of the data", "value": clean(&d.data.sha256, 13)}));
    facts
}

fn error_bars(d: &Diagnosis) -> Option<Vec<Bar>> {
    let error = d.error.as_ref()?;
    let headline = ErrorPair { before: error.before, after: error.after };
    let heldout = clean(&error.heldout, 24);
    let pairs =
        [(heldout.as_str(), Some(headline)), ("levels", error.by.levels), ("sessions", error.by.sessions)];
    let mut bars = Vec::new();
    for (name, pair) in pairs.into_iter().filter_map(|(name, pair)| Some((name, pair?))) {
        for (after, error) in [(false, pair.before), (true, pair.after)] {
            let Some(value) = error.rmse_n.or(error.mse).or(error.rmse_mm3).filter(|v| v.is_finite()) else {
                continue;
            };
            let name = format!("held-out {name}, {}", if after { "after" } else { "before" });
            bars.push(Bar { name, after, value, interval: (error.low90, error.high90) });
        }
    }
    (!bars.is_empty()).then_some(bars)
}

/// Whether a size that would have been seen says anything. At its neutral value an effect does nothing: a limit of a sensor of
/// 999999 N, of up to a million, is none.
fn is_a_size(effect: &str, seen: &Detectable) -> bool {
    let spec = find(effect);
    let parameter = spec.and_then(|spec| spec.parameters.iter().find(|p| p.name == seen.parameter));
    parameter.is_none_or(|p| {
        p.neutral == 0.0 || (seen.value - p.neutral).abs() > AT_NEUTRAL * (p.bounds.1 - p.bounds.0)
    })
}

/// Whether the error after is below the noise floor, which then wants a word.
fn below_floor(d: &Diagnosis, floor: Option<f64>) -> bool {
    let after = d.error.as_ref().and_then(|error| error.after.rmse_n.or(error.after.mse));
    after.zip(floor).is_some_and(|(after, floor)| after < floor)
}

/// The headline as a share of the measured value.
fn percent(d: &Diagnosis) -> Option<String> {
    let error = d.error.as_ref()?;
    let of = |e: &HeldOutError| e.mape_pct.filter(|p| p.is_finite());
    let (before, after) = (of(&error.before)?, of(&error.after)?);
    Some(format!("{} % before, {} % after", number(before), number(after)))
}

fn parameter(name: &str, e: &ParameterEstimate) -> Value {
    let unit = if e.unit == "1" { String::new() } else { clean(&e.unit, NAME) };
    json!({
        "name": clean(name, NAME), "value": number(e.value), "low": number(e.low90), "high": number(e.high90),
        "unit": unit, "fixed": e.low90 == e.value && e.high90 == e.value,
    })
}

fn effect(effect: &NamedEffect) -> Value {
    let weight = |name: &str, weight: f64| {
        let width = 100.0 * if weight.is_finite() { weight.clamp(0.0, 1.0) } else { 0.0 };
        json!({"name": clean(name, NAME), "weight": number(weight), "width": format!("{width:.0}")})
    };
    let rivals = effect.indistinguishable_from.iter().take(ROWS).map(|r| weight(&r.name, r.weight));
    let parameters = effect.parameters.iter().take(ROWS).map(|(name, e)| parameter(name, e));
    json!({
        "name": clean(&effect.name, NAME),
        "part": effect.part.as_ref().map(|p| clean(p, NAME)),
        "class": names(&effect.class),
        "tied": !effect.indistinguishable_from.is_empty(),
        "weights": std::iter::once(weight(&effect.name, effect.weight)).chain(rivals).collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "separate": effect.separate_by.as_ref().map(|s| clean(&s.text, SENTENCE)),
        "campaign": effect.separate_by.as_ref().and_then(|s| s.campaign.as_ref()).map(|c| clean(c, 4 * NAME)),
    })
}

fn names(names: &[String]) -> Vec<String> {
    let mut shown: Vec<String> = names.iter().take(ROWS).map(|n| clean(n, NAME)).collect();
    if names.len() > ROWS {
        shown.push(format!("and {} more", names.len() - ROWS));
    }
    shown
}

pub(super) fn groups(groups: &[PlotGroup]) -> Vec<Value> {
    let drawn = |g: &PlotGroup| g.plots.iter().map(|p| p.series.len().min(SERIES)).sum::<usize>();
    let series: usize = groups.iter().map(drawn).sum();
    let most = (ALL_POINTS / series.max(1)).clamp(8, SERIES_POINTS);
    let mut room = PLOTS;
    groups
        .iter()
        .filter(|g| !g.plots.is_empty())
        .map(|group| {
            let plots: Vec<Value> = group.plots.iter().take(room).map(|p| figure(p, most)).collect();
            room -= plots.len();
            json!({"title": clean(&group.title, NAME), "about": clean(&group.about, SENTENCE), "plots": plots})
        })
        .filter(|group| group["plots"].as_array().is_some_and(|p| !p.is_empty()))
        .collect()
}

pub(crate) fn figure(plot: &Plot, most: usize) -> Value {
    let mut plot = plot.clone();
    plot.series.truncate(SERIES);
    let legend = plot
        .series
        .iter()
        .enumerate()
        .map(|(i, s)| json!({"name": clean(&s.name, 30), "class": plot::class(&plot.series, i)}));
    let legend: Vec<Value> = if plot.series.len() > 1 { legend.collect() } else { Vec::new() };
    json!({"title": clean(&plot.title, NAME), "svg": plot::draw(&plot, most), "legend": legend})
}

/// What the page does not show, for people.
fn left_out(diagnosed: &Diagnosed) -> Vec<String> {
    let report = &diagnosed.report;
    let plots: usize = report.groups.iter().map(|g| g.plots.len()).sum();
    let counts = [
        (plots, PLOTS, "plots"),
        (report.evidence.len(), ROWS, "candidates"),
        (report.worst.len(), ROWS, "observations that fit badly"),
        (diagnosed.diagnosis.notes.len(), ROWS, "notes"),
    ];
    let more = counts.iter().filter(|(n, most, _)| n > most);
    more.map(|(n, most, what)| format!("{} more {what} are not shown", n - most)).collect()
}
