//! The report of a diagnosis.

pub(crate) mod decisive;
pub(crate) mod doubt;
pub(crate) mod imprints;
pub(crate) mod presses;
pub(crate) mod pulls;
pub(crate) mod sensor;
#[cfg(test)]
mod tests;

use crate::PlotGroup;
use crate::bars::{self, Bar};
use crate::page::{PLOTS, Page, PlotBudget, Table};
use crate::text::{NAME, SENTENCE, clean, number};
use gripgen_identify::{
    Channel, Detectable, Diagnosis, ErrorPair, HeldOutError, MIN_REPORTABLE_WEIGHT, NamedEffect,
    ParameterEstimate, UnknownCovariate, Verdict,
};
use gripgen_twin::effects::find;
use serde_json::{Value, json};

/// Rows of a table.
const ROWS: usize = 40;
/// A value nearer to the neutral one, as a share of what is fitted, is that.
const AT_NEUTRAL: f64 = 1e-5;

/// A candidate in the table of evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct EvidenceRow {
    /// Its name: an effect, "none", or "curve in humidity_pct".
    pub name: String,
    /// Gain in held-out log-likelihood over the model without it.
    pub heldout_gain: f64,
    /// Standard error of that.
    pub standard_error: f64,
    /// Error on held-out data with it.
    pub heldout_error: f64,
    /// Fitted values, for people.
    pub values: String,
    /// What became of it: "named", "tied with wear", "worse", "as good on held-out pulls", "contradicted by the traces".
    pub fate: String,
}

/// An observation that fits badly.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstRow {
    /// Its id.
    pub id: String,
    /// What it is, for people: part, force.
    pub about: String,
    /// Measured.
    pub measured: f64,
    /// Predicted after the effects were added.
    pub predicted: f64,
    /// Difference in standard deviations.
    pub deviations: f64,
}

/// What the page shows in addition to the diagnosis itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportData {
    /// Title of the page.
    pub title: String,
    /// Plots in the order of the page.
    pub groups: Vec<PlotGroup>,
    /// How many of these decide the answer: they stand before everything else.
    pub decides: usize,
    /// What to do next: a sentence, and a command or nothing.
    pub next: Vec<(String, String)>,
    /// The candidates.
    pub evidence: Vec<EvidenceRow>,
    /// The worst observations.
    pub worst: Vec<WorstRow>,
    /// The unit of errors: `N`, or `grey levels^2`.
    pub error_unit: String,
}

/// The report of a diagnosis: one HTML page with its plots inside, which needs neither a network nor a script.
///
/// It stays below 500 kB whatever the size of the data: plots and tables have a largest number of points and rows, and what
/// was left out is said.
pub fn diagnosis_page(d: &Diagnosis, report: &ReportData) -> String {
    let floor = d.noise_floor_n.or(d.noise_floor_mse).or(d.noise_floor_mm3);
    let unit = if report.error_unit.is_empty() { error_unit(d.channel) } else { &report.error_unit };
    let unit = &clean(unit, NAME);
    let (class, word) = match d.verdict {
        Verdict::None => ("good", "nothing beyond the baseline"),
        Verdict::Effect => ("found", "effect"),
        Verdict::Unknown => ("open", "unknown dependence"),
        Verdict::Insufficient => ("open", "the data cannot answer"),
    };
    let mut budget = PlotBudget::of(&report.groups);
    // A group without plots is no section.
    let groups: Vec<PlotGroup> = report.groups.iter().filter(|g| !g.plots.is_empty()).cloned().collect();
    let (decisive, others) = groups.split_at(report.decides.min(groups.len()));

    let mut page = Page::new(&report.title);
    page.verdict(class, &format!("{word}{}", names(d)), d.plain.as_deref().unwrap_or_default());
    page.groups(decisive, &mut budget);
    if !report.next.is_empty() {
        page.section("Next", "");
        for (text, command) in &report.next {
            page.text(text);
            if !command.is_empty() {
                page.command(command);
            }
        }
    }
    page.facts(&facts(d, floor, unit));
    if let Some(bars) = error_bars(d) {
        page.section("Error before and after", &about_errors(d, floor));
        page.drawing(&bars::draw(&bars, floor, unit));
    }
    if !d.effects.is_empty() {
        page.section("What acts", "");
        page.cards(&d.effects.iter().take(ROWS).map(effect).collect::<Vec<_>>());
    }
    if !d.unknown.is_empty() {
        page.section(
            "Unknown dependence",
            "The residual depends on these in a way that no known effect explains.",
        );
        let row = |u: &UnknownCovariate| {
            vec![clean(&u.covariate, NAME), number(100.0 * u.strength), number(u.p_value)]
        };
        let rows = d.unknown.iter().take(ROWS).map(row);
        page.table(&Table::new(&["covariate", "variance explained, %", "p"], rows));
    }
    page.groups(others, &mut budget);
    evidence(&mut page, report, unit);
    limits(&mut page, d);
    if !d.baseline.is_empty() {
        page.section("Baseline", "");
        let row = |(name, e): (&String, &ParameterEstimate)| {
            let (low, high) = interval(e).map_or(("fixed".into(), String::new()), |ends| ends);
            vec![clean(name, NAME), number(e.value), low, high, unit_of(e)]
        };
        let rows = d.baseline.iter().take(ROWS).map(row);
        let head = ["value", "fitted", "90 % from", "to", "unit"];
        page.table(&Table { words: vec![4], ..Table::new(&head, rows) });
    }
    if !report.worst.is_empty() {
        page.section("What fits worst", "");
        let row = |w: &WorstRow| {
            let numbers = [w.measured, w.predicted, w.deviations].map(number);
            [vec![clean(&w.id, NAME), clean(&w.about, NAME)], numbers.to_vec()].concat()
        };
        let head = ["id", "what", "measured", "predicted", "standard deviations"];
        page.table(&Table { words: vec![1], ..Table::new(&head, report.worst.iter().take(ROWS).map(row)) });
    }
    if !d.data.outliers.is_empty() {
        page.text(&format!("Given little weight because they fit nothing: {}.", list(&d.data.outliers)));
    }
    let notes: Vec<String> = d.notes.iter().take(ROWS).cloned().chain(left_out(d, report)).collect();
    if !notes.is_empty() {
        page.section("Notes", "");
        page.list(&notes);
    }
    page.html()
}

/// What was found, by name, with what it is tied with.
fn names(d: &Diagnosis) -> String {
    let effect = |effect: &NamedEffect| {
        let perhaps = if effect.weight < MIN_REPORTABLE_WEIGHT { "perhaps " } else { "" };
        let part = effect.part.as_ref().map(|part| format!(" on {part}")).unwrap_or_default();
        let alternatives: Vec<&str> = effect.indistinguishable_from.iter().map(|r| r.name.as_str()).collect();
        let tied = match alternatives.is_empty() {
            true => String::new(),
            false => format!(" (not told apart from {})", alternatives.join(", ")),
        };
        format!("{perhaps}{}{part}{tied}", effect.name)
    };
    let unknown = d.unknown.iter().map(|u| format!("something that goes with {}", u.covariate));
    let names: Vec<String> = d.effects.iter().map(effect).chain(unknown).collect();
    if names.is_empty() { String::new() } else { format!(": {}", names.join("; ")) }
}

/// The unit of errors of a channel.
fn error_unit(channel: Channel) -> &'static str {
    match channel {
        Channel::Pulls | Channel::Sensor => "N",
        Channel::Presses => "grey levels\u{b2}",
        Channel::Imprints => "mm\u{b3}",
    }
}

fn facts(d: &Diagnosis, floor: Option<f64>, unit: &str) -> Vec<(&'static str, String)> {
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
    let mut facts = vec![("channel", channel.into()), ("data", size.join(", "))];
    if let Some(floor) = floor {
        facts.push(("noise floor (repetitions)", format!("{} {unit}", number(floor))));
    }
    facts.push(("SHA-256 of the data", clean(&d.data.sha256, 13)));
    facts
}

/// What the bars of errors are, with the headline as a share of the measured value.
fn about_errors(d: &Diagnosis, floor: Option<f64>) -> String {
    let mut text =
        "On data that the fit has not seen, through the simulator; the lines are 90 % intervals.".to_string();
    let percent = |e: &HeldOutError| e.mape_pct.filter(|p| p.is_finite());
    let error = d.error.as_ref();
    if let Some((before, after)) = error.and_then(|e| percent(&e.before).zip(percent(&e.after))) {
        let (before, after) = (number(before), number(after));
        text += &format!(" Relative to the measured value: {before} % before, {after} % after.");
    }
    text += " The dashed line is the noise floor: how far repetitions of one pull are from each other.";
    let after = error.and_then(|error| error.after.rmse_n.or(error.after.mse));
    if after.zip(floor).is_some_and(|(after, floor)| after < floor) {
        text += " The error after is below it: nothing is left that repetitions do not scatter by themselves, and both are \
                 estimates from few pulls.";
    }
    text
}

/// The candidates; columns that a channel does not fill are left out.
fn evidence(page: &mut Page, report: &ReportData, unit: &str) {
    if report.evidence.is_empty() {
        return;
    }
    let any = |of: fn(&EvidenceRow) -> f64| report.evidence.iter().any(|e| of(e).is_finite());
    let (has_error, has_spread) = (any(|e| e.heldout_error), any(|e| e.standard_error));
    let cost = match has_error {
        true => "on data that the fit had not seen",
        false => "less what its parameters cost",
    };
    let about = format!(
        "Each candidate was fitted together with the whole baseline. The gain is in log-likelihood over the model without it, \
         {cost}."
    );
    page.section("Evidence", &about);
    let error = format!("error, {unit}");
    let columns = |first: &str, gain: &str, spread: &str, error: &str, last: [&str; 2]| -> Vec<String> {
        let numbers = [(true, gain), (has_spread, spread), (has_error, error)];
        let numbers = numbers.into_iter().filter(|(has, _)| *has).map(|(_, text)| text);
        std::iter::once(first).chain(numbers).chain(last).map(String::from).collect()
    };
    let head = columns("candidate", "gain", "\u{b1}", &error, ["values", "verdict"]);
    let row = |e: &EvidenceRow| {
        let [gain, spread, error] = [e.heldout_gain, e.standard_error, e.heldout_error].map(number);
        let [values, fate] = [&e.values, &e.fate].map(|text| clean(text, 2 * NAME));
        columns(&clean(&e.name, NAME), &gain, &spread, &error, [&values, &fate])
    };
    let shown = &report.evidence[..report.evidence.len().min(ROWS)];
    page.table(&Table {
        words: vec![head.len() - 2, head.len() - 1],
        rows: shown.iter().map(row).collect(),
        strong: (0..shown.len()).filter(|&i| shown[i].fate.starts_with("named")).collect(),
        head,
        bars: vec![],
    });
}

/// What the data can and cannot show.
fn limits(page: &mut Page, d: &Diagnosis) {
    let seen: Vec<Vec<String>> = d
        .would_have_seen
        .iter()
        .filter(|(name, seen)| is_a_size(name, seen))
        .take(ROWS)
        .map(|(name, seen)| {
            let names = [name, &seen.parameter].map(|name| clean(name, NAME));
            [names, [number(seen.value), number(100.0 * seen.power)]].concat()
        })
        .collect();
    if seen.is_empty() && d.not_excited.is_empty() && d.not_recorded.is_empty() {
        return;
    }
    page.section("What these data can and cannot show", "");
    if !d.not_excited.is_empty() {
        let names = list(&d.not_excited);
        page.text(&format!("Never varied, so nothing can be said about it: {names}."));
    }
    if !d.not_recorded.is_empty() {
        page.text(&format!("Not written down: {}.", list(&d.not_recorded)));
    }
    if !seen.is_empty() {
        page.note("Effects that were not found would have been, had they had this size:");
        let head = ["effect", "parameter", "size", "probability, %"];
        page.table(&Table { words: vec![1], ..Table::new(&head, seen) });
    }
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

/// Ends of the 90 % interval; nothing of a value that was not fitted.
fn interval(e: &ParameterEstimate) -> Option<(String, String)> {
    let is_fixed = e.low90 == e.value && e.high90 == e.value;
    (!is_fixed).then(|| (number(e.low90), number(e.high90)))
}

fn unit_of(e: &ParameterEstimate) -> String {
    if e.unit == "1" { String::new() } else { clean(&e.unit, NAME) }
}

/// The card of an effect.
fn effect(effect: &NamedEffect) -> Value {
    let weight = |name: &str, weight: f64| {
        let width = 100.0 * if weight.is_finite() { weight.clamp(0.0, 1.0) } else { 0.0 };
        json!({"name": clean(name, NAME), "weight": number(weight), "width": format!("{width:.0}")})
    };
    let alternatives = effect.indistinguishable_from.iter().take(ROWS).map(|r| weight(&r.name, r.weight));
    let fact = |(name, e): (&String, &ParameterEstimate)| {
        let range = interval(e).map_or("fixed".into(), |(low, high)| format!("{low} to {high}"));
        [format!("{} = {} {}", clean(name, NAME), number(e.value), unit_of(e)), range]
    };
    let part = effect.part.as_ref().map_or(String::new(), |part| format!(" on {}", clean(part, NAME)));
    let tied = match effect.indistinguishable_from.is_empty() {
        true => "",
        false => "These data do not tell it apart from the others below. ",
    };
    let separate = effect.separate_by.as_ref();
    json!({
        "title": clean(&effect.name, NAME) + &part,
        "facts": effect.parameters.iter().take(ROWS).map(fact).collect::<Vec<_>>(),
        "about": format!("{tied}Share of the evidence:"),
        "weights": std::iter::once(weight(&effect.name, effect.weight)).chain(alternatives).collect::<Vec<_>>(),
        "end": (effect.class.len() > 1).then(|| format!("Class: {}", list(&effect.class))),
        "next": separate.map(|s| clean(&s.text, SENTENCE)),
        "file": separate.and_then(|s| s.campaign.as_ref()).map(|file| clean(file, 4 * NAME)),
    })
}

fn list(names: &[String]) -> String {
    let mut shown: Vec<String> = names.iter().take(ROWS).map(|n| clean(n, NAME)).collect();
    if names.len() > ROWS {
        shown.push(format!("and {} more", names.len() - ROWS));
    }
    shown.join(", ")
}

/// What the page does not show, for people.
fn left_out(d: &Diagnosis, report: &ReportData) -> Vec<String> {
    let plots: usize = report.groups.iter().map(|g| g.plots.len()).sum();
    let counts = [
        (plots, PLOTS, "plots"),
        (report.evidence.len(), ROWS, "candidates"),
        (report.worst.len(), ROWS, "observations that fit badly"),
        (d.notes.len(), ROWS, "notes"),
    ];
    let more = counts.iter().filter(|(n, most, _)| n > most);
    more.map(|(n, most, what)| format!("{} more {what} are not shown", n - most)).collect()
}
