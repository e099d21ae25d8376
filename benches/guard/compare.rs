//! What is past its tolerance.

use super::baseline::{Entry, Unit};
use std::collections::BTreeMap;

/// Times may grow by a quarter: smallest samples of the same code on a shared machine stay within a fifth.
const TIME: f64 = 1.25;
/// A number that was taken only once or a few times may be that of a bad moment.
const ONE_TIME: f64 = 1.5;
const FEW: usize = 5;
/// Peaks of memory depend a little on how threads meet.
const MEMORY: f64 = 1.15;
/// Instructions differ by allocations and hash seeds only.
const INSTRUCTIONS: f64 = 1.02;

/// A benchmark beside its baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the benchmark.
    pub name: String,
    /// What its numbers are.
    pub unit: Unit,
    /// Smallest sample of the baseline, if it has any.
    pub baseline: Option<f64>,
    /// Smallest sample of this run, if it was measured.
    pub now: Option<f64>,
    /// Largest ratio that passes.
    pub tolerance: f64,
}

impl Row {
    /// Now over the baseline.
    pub fn ratio(&self) -> Option<f64> {
        Some(self.now? / self.baseline?)
    }

    /// Whether it is past its tolerance. A ratio that is no number is.
    pub fn fails(&self) -> bool {
        self.ratio().is_some_and(|ratio| ratio.is_nan() || ratio > self.tolerance)
    }
}

/// How much larger than the baseline a number may be.
pub fn tolerance(unit: Unit, samples: usize) -> f64 {
    match unit {
        Unit::Instructions => INSTRUCTIONS,
        Unit::Megabytes => MEMORY,
        Unit::Seconds | Unit::Nanoseconds if samples < FEW => ONE_TIME,
        Unit::Seconds | Unit::Nanoseconds => TIME,
    }
}

/// All that was measured, and what the baseline has and `expected` was to be measured.
pub fn compare(
    baseline: &BTreeMap<String, Entry>,
    now: &BTreeMap<String, Entry>,
    expected: impl Fn(&str, &Entry) -> bool,
) -> Vec<Row> {
    let measured = now.iter().map(|(name, entry)| {
        // Another unit is another benchmark.
        let before = baseline.get(name).filter(|b| b.unit == entry.unit);
        let samples = before.map_or(0, |b| b.samples.len()).min(entry.samples.len());
        Row {
            name: name.clone(),
            unit: entry.unit,
            baseline: before.map(Entry::least),
            now: Some(entry.least()),
            tolerance: tolerance(entry.unit, samples),
        }
    });
    let vanished = baseline.iter().filter(|(name, b)| !now.contains_key(*name) && expected(name, b));
    let vanished = vanished.map(|(name, b)| Row {
        name: name.clone(),
        unit: b.unit,
        baseline: Some(b.least()),
        now: None,
        tolerance: tolerance(b.unit, b.samples.len()),
    });
    measured.chain(vanished).collect()
}

/// The table, and whether nothing is past its tolerance.
pub fn report(rows: &[Row], target: &str) -> (String, bool) {
    let width = rows.iter().map(|r| r.name.len()).max().unwrap_or(0).max(9);
    let number = |x: Option<f64>, unit| x.map_or_else(|| "-".into(), |x| in_unit(x, unit));
    let mut text = format!("{:width$} {:>14} {:>14} {:>7}\n", "benchmark", "baseline", "now", "ratio");
    for row in rows {
        let ratio = row.ratio().map_or_else(|| "-".into(), |r| format!("{r:.3}"));
        let remark = match (row.baseline, row.now) {
            (None, _) => "  new: not in the baseline",
            (_, None) => "  vanished: only in the baseline",
            _ if row.fails() => "  SLOWER",
            _ => "",
        };
        let remark = if row.fails() && row.unit == Unit::Megabytes { "  LARGER" } else { remark };
        text += &format!(
            "{:width$} {:>14} {:>14} {ratio:>7}{remark}\n",
            row.name,
            number(row.baseline, row.unit),
            number(row.now, row.unit)
        );
    }
    text += &format!(
        "smallest samples; a ratio may be {TIME} for times ({ONE_TIME} with fewer than {FEW} samples), {MEMORY} for memory, \
         {INSTRUCTIONS} for instructions\n"
    );
    let failed: Vec<String> = rows
        .iter()
        .filter(|r| r.fails())
        .map(|r| format!("{} ({:.2} x, at most {})", r.name, r.ratio().unwrap_or(f64::NAN), r.tolerance))
        .collect();
    for (which, of) in [("new", Row::is_new as fn(&Row) -> bool), ("vanished", Row::is_vanished)] {
        let names: Vec<&str> = rows.iter().filter(|r| of(r)).map(|r| r.name.as_str()).collect();
        if !names.is_empty() {
            text += &format!(
                "{which}: {}; `cargo xtask bench record` puts the baseline right\n",
                names.join(", ")
            );
        }
    }
    if failed.is_empty() {
        return (text + &format!("{target}: nothing past its tolerance\n"), true);
    }
    (text + &format!("{target}: past its tolerance: {}\n", failed.join(", ")), false)
}

impl Row {
    /// Whether the baseline does not know it.
    pub fn is_new(&self) -> bool {
        self.baseline.is_none()
    }

    /// Whether only the baseline knows it.
    pub fn is_vanished(&self) -> bool {
        self.now.is_none()
    }
}

/// What a machine without a baseline is told.
pub fn no_baseline(id: &str) -> String {
    format!("no baseline of this machine ({id}), nothing is compared; `cargo xtask bench record` makes one\n")
}

fn in_unit(x: f64, unit: Unit) -> String {
    let (x, symbol) = match unit {
        Unit::Nanoseconds if x >= 1e6 => (x * 1e-6, "ms"),
        Unit::Nanoseconds if x >= 1e3 => (x * 1e-3, "us"),
        Unit::Instructions if x >= 1e6 => (x * 1e-6, "M instr"),
        Unit::Instructions => (x, "instr"),
        unit => (x, unit.symbol()),
    };
    format!("{x:.3} {symbol}")
}
