//! The page: what its template is given.

use super::ViewOptions;
use super::expected::ExpectedLabels;
use super::rows::Rows;
use crate::histogram::Histogram;
use crate::page::{Page, Table};
use crate::text::{NAME, clean};
use crate::{Plot, Series};
use gripgen_record::Dataset;
use gripgen_twin::rounded;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Distributions of the page.
const HISTOGRAMS: usize = 16;
/// Rows among which a selection is counted.
const COUNTED: usize = 10_000;
/// Points of a series.
const POINTS: usize = 600;
/// Reasons in the table.
const REASONS: usize = 12;
/// Series of a plot; with more, what is expected is not drawn.
const LINES: usize = 12;

pub(super) fn page(
    dataset: &Dataset,
    rows: &Rows<'_>,
    expected: &ExpectedLabels,
    cards: &[Value],
    options: &ViewOptions,
) -> String {
    let n = rows.len();
    let counted: Vec<usize> = spread(n, COUNTED).collect();
    let label = rows.table.columns().iter().find(|(name, _)| name == "max_pull_force_n");
    let columns = label.map(|(name, values)| (name.as_str(), values)).into_iter().chain(rows.varied());
    let mut histograms = Vec::new();
    let mut bins = Vec::new();
    for (name, values) in columns.take(HISTOGRAMS) {
        let histogram = Histogram::of(values);
        let title = if name == "max_pull_force_n" { "label: max_pull_force_n" } else { name };
        histograms.push(json!({"title": clean(title, NAME), "svg": histogram.svg(name)}));
        let bin = |row: &usize| histogram.bin_of[*row].map_or(-1, i32::from);
        bins.push(counted.iter().map(bin).collect::<Vec<_>>());
    }
    let words = |of: &dyn Fn(usize) -> String| {
        let mut all: Vec<String> = (0..n).map(of).filter(|word| !word.is_empty()).collect();
        all.sort();
        all.dedup();
        all
    };
    let (part, grip) = (words(&|row| rows.part(row).into()), words(&|row| rows.grip(row)));
    let status = words(&|row| rows.status(row).into());
    let short = |all: &[String]| all.iter().map(|word| clean(word, 80)).collect::<Vec<_>>();
    let place = |all: &[String], word: &str| all.iter().position(|w| w == word).map_or(-1, |i| i as i32);
    // What the script selects among: places in the lists above, forces, bins.
    let data = json!({
        "part": counted.iter().map(|&row| place(&part, rows.part(row))).collect::<Vec<_>>(),
        "grip": counted.iter().map(|&row| place(&grip, &rows.grip(row))).collect::<Vec<_>>(),
        "status": counted.iter().map(|&row| place(&status, rows.status(row))).collect::<Vec<_>>(),
        "force": counted.iter().map(|&row| short_number(rows.force_n(row))).collect::<Vec<_>>(),
        "bins": bins, "rows": n,
        "parts": short(&part), "grips": short(&grip), "statuses": short(&status),
    });
    let left_out = rows.varied().len() + 1 - histograms.len().min(rows.varied().len() + 1);
    let mut page = Page::new(&options.title);
    page.text(&sentence(rows, cards.len()));
    page.facts(&facts(dataset));
    let reasons = reasons(rows);
    if !reasons.is_empty() {
        page.section("What failed or is suspect", "");
        let head = ["pulls", "status", "first", "reason of the first"];
        page.table(&Table { words: vec![1, 2, 3], ..Table::new(&head, reasons) });
    }
    let plots = plots(rows, expected);
    if !plots.is_empty() {
        let about = "Expected is a straight line through the labels of each grip of a part over grip force, which single pulls \
                     move little.";
        page.section("Labels", about);
        page.figures(&[], &plots, POINTS);
    }
    page.html_with(
        "view.html",
        json!({
            "histograms": histograms, "left_out": left_out,
            "counted": (counted.len() < n).then_some(counted.len()),
            "parts": short(&part), "grips": short(&grip), "statuses": short(&status),
            "cards": cards, "pulls": n,
            // Nothing in it ends the script that it stands in.
            "data": data.to_string().replace('<', "\\u003c"),
        }),
    )
}

fn spread(n: usize, most: usize) -> impl Iterator<Item = usize> {
    let taken = n.min(most);
    (0..taken).map(move |i| i * n / taken)
}

/// A number of few digits; null where there is none.
fn short_number(x: f64) -> Value {
    if x.is_finite() { json!((1e3 * x).round() / 1e3) } else { Value::Null }
}

fn sentence(rows: &Rows<'_>, shown: usize) -> String {
    let n = rows.len();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    (0..n).for_each(|row| *counts.entry(rows.status(row)).or_default() += 1);
    let counts: Vec<String> =
        counts.iter().map(|(status, n)| format!("{n} {}", status.replace('_', " "))).collect();
    let labels = || (0..n).map(|row| rows.label_n(row)).filter(|x| x.is_finite());
    let (low, high) = labels().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let pulls = if n == 1 { "1 pull".to_string() } else { format!("{n} pulls") };
    let mut text = format!("{pulls}: {}.", counts.join(", "));
    if low <= high {
        text += &format!(" Labels from {} to {} N.", rounded(low, &[]), rounded(high, &[]));
    }
    text += &if shown < n {
        format!(
            " Shown with images and curves are {shown}: the strangest, those that did not slip, and the others evenly."
        )
    } else {
        " All are shown.".into()
    };
    text
}

fn facts(dataset: &Dataset) -> Vec<(&'static str, String)> {
    let mut facts = vec![("data", dataset.path().display().to_string())];
    if let Some(run) = dataset.run() {
        let info = run.info();
        facts.push(("run", format!("{}, {} samples planned", info.name, info.samples)));
        facts.push(("made by", format!("gripgen {}, source: {}", info.gripgen_version, info.source)));
        facts.push(("SHA-256 of its configuration", info.config_sha256.clone()));
    }
    if let Some((width, height)) = dataset.image_size_px() {
        facts.push((
            "images",
            format!("{width} x {height} px; shown here as JPEG of quality 90, at most 320 px wide"),
        ));
    }
    facts
}

/// Why pulls failed or are suspect, most frequent first; numbers of a reason do not tell reasons apart.
fn reasons(rows: &Rows<'_>) -> Vec<Vec<String>> {
    let mut found: BTreeMap<(String, String), (usize, String, String)> = BTreeMap::new();
    for row in (0..rows.len()).filter(|&row| !rows.reason(row).is_empty()) {
        let kind: String = rows.reason(row).chars().filter(|c| !c.is_ascii_digit()).collect();
        let entry = found
            .entry((rows.status(row).into(), kind))
            .or_insert_with(|| (0, rows.reason(row).into(), rows.id(row)));
        entry.0 += 1;
    }
    let mut all: Vec<_> = found.into_iter().collect();
    all.sort_by(|a, b| b.1.0.cmp(&a.1.0).then(a.0.cmp(&b.0)));
    let row = |((status, _), (n, reason, id)): ((String, String), (usize, String, String))| {
        vec![n.to_string(), clean(&status, NAME), clean(&id, NAME), reason]
    };
    all.into_iter().take(REASONS).map(row).collect()
}

/// Labels over grip force with what is expected of each part, and how far pulls are from it in their order.
fn plots(rows: &Rows<'_>, expected: &ExpectedLabels) -> Vec<Plot> {
    let mut parts: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for row in (0..rows.len()).filter(|&row| rows.label_n(row).is_finite()) {
        parts.entry(rows.part(row)).or_default().push(row);
    }
    let (mut over_force, mut in_order) = (Vec::new(), Vec::new());
    let lines = parts.len() + expected.lines.len() <= LINES;
    for (part, of_part) in &parts {
        let points: Vec<(f64, f64)> = of_part
            .iter()
            .map(|&row| (rows.force_n(row), rows.label_n(row)))
            .filter(|(force, _)| force.is_finite())
            .collect();
        let ends = points.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), p| (l.min(p.0), h.max(p.0)));
        over_force.push(Series::points(*part, points));
        let of_grips = expected.lines.iter().filter(|((of, _), _)| lines && of == part && ends.0 < ends.1);
        for ((_, grip), line) in of_grips {
            let grip = if grip.is_empty() { String::new() } else { format!(" {grip}") };
            let points = [ends.0, ends.1].map(|force| (force, line.at(force)));
            over_force.push(Series::line(format!("{part}{grip}, expected"), points));
        }
        let far = of_part.iter().filter_map(|&row| Some((row as f64, expected.of_row(row)?.deviations)));
        in_order.push(Series::points(*part, far));
    }
    let mut plots =
        vec![Plot::new("labels over grip force", "grip force of a jaw, N", "label, N", over_force)];
    if in_order.iter().any(|s| !s.points.is_empty()) {
        let title = "how far from what is expected";
        plots.push(Plot::new(title, "pull", "standard deviations", in_order));
    }
    plots.retain(|plot| plot.series.iter().any(|s| s.points.len() > 1));
    plots
}
