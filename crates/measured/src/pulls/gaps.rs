//! Cells of a table that are missing: clocks and counts are interpolated in the order of the rows, the others are a mask. A field of a
//! masked cell holds a stand-in from the same campaign, for a simulation; no reader of columns sees it.

use gripgen_twin::MeasuredPull;
use gripgen_twin::columns::{Column, InTable};
use gripgen_twin::values::median;
use std::collections::BTreeMap;

/// The columns that rise from row to row.
const CLOCKS: [&str; 2] = ["time_s", "pull_index"];

/// What a masked cell does.
pub(crate) const SAY_NOTHING: &str = "these pulls say nothing of it";

/// What becomes of a pull that lacks what every pull has.
pub(super) const LEFT_OUT: &str = "these pulls are left out";

/// Cells that are missing in columns that other rows fill, and what becomes of them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MissingCells(BTreeMap<String, (usize, &'static str)>);

impl MissingCells {
    /// Adds cells of a column.
    pub(crate) fn add(&mut self, column: &str, cells: usize, becomes: &'static str) {
        if cells > 0 {
            self.0.entry(column.into()).or_insert((0, becomes)).0 += cells;
        }
    }

    /// Adds those of further pulls.
    pub(crate) fn append(&mut self, more: &Self) {
        more.0.iter().for_each(|(column, (cells, becomes))| self.add(column, *cells, becomes));
    }

    /// Number of missing cells by column.
    pub fn counts(&self) -> BTreeMap<String, usize> {
        self.0.iter().map(|(column, (cells, _))| (column.clone(), *cells)).collect()
    }

    /// A remark for each column.
    pub fn notes(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(column, (cells, becomes))| {
            let are = if *cells == 1 { "cell is" } else { "cells are" };
            format!("{column}: {cells} {are} missing, {becomes}")
        })
    }
}

/// Fills or masks the cells of a column that are missing in some rows. Returns what became of them.
pub(crate) fn fill(column: &'static Column, rows: &[usize], pulls: &mut [MeasuredPull]) -> &'static str {
    if column.in_table == InTable::Required {
        mask(column, rows, pulls);
        return LEFT_OUT;
    }
    if column.in_table == InTable::Setting {
        return "these pulls have what it is where nobody wrote it down";
    }
    if CLOCKS.contains(&column.name) {
        interpolate(column, rows, pulls);
        return "interpolated in the order of the rows";
    }
    if column.holds_words() {
        let known: Vec<usize> = (0..pulls.len()).filter(|row| rows.binary_search(row).is_err()).collect();
        for &row in rows {
            let before = known.partition_point(|&k| k < row);
            let at = before.checked_sub(1).and_then(|k| known.get(k)).or_else(|| known.first());
            let word = at.and_then(|&k| column.word(pulls[k].view())).unwrap_or_default().to_string();
            column.set_word(&mut pulls[row].edit(), &word);
        }
    } else {
        let known = (0..pulls.len()).filter(|row| rows.binary_search(row).is_err());
        if let Some(middle) = median(known.filter_map(|row| column.number(pulls[row].view())).collect()) {
            rows.iter().for_each(|&row| column.set_number(&mut pulls[row].edit(), middle));
        }
    }
    mask(column, rows, pulls);
    SAY_NOTHING
}

fn mask(column: &'static Column, rows: &[usize], pulls: &mut [MeasuredPull]) {
    rows.iter().for_each(|&row| {
        pulls[row].covariates.missing.insert(column.name);
    });
}

/// Puts a straight line between the known neighbours of one session (of one gel, for pulls made on it); where only one side is
/// known, the usual step of a row.
fn interpolate(column: &Column, rows: &[usize], pulls: &mut [MeasuredPull]) {
    let known: Vec<(usize, f64)> = (0..pulls.len())
        .filter(|row| rows.binary_search(row).is_err())
        .filter_map(|row| Some((row, column.number(pulls[row].view())?)))
        .collect();
    let group = |row: usize| match column.name {
        "time_s" => pulls[row].covariates.session.as_str(),
        _ => pulls[row].covariates.gel_id.as_str(),
    };
    let steps = known.windows(2).map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0) as f64);
    let step = median(steps.filter(|step| *step > 0.0).collect()).unwrap_or(1.0);
    let found: Vec<f64> = rows
        .iter()
        .map(|&row| {
            let at = known.partition_point(|&(k, _)| k < row);
            let of_group =
                |side: Option<&(usize, f64)>| side.copied().filter(|&(k, _)| group(k) == group(row));
            let before = of_group(at.checked_sub(1).and_then(|k| known.get(k)));
            let after = of_group(known.get(at));
            let whole = |x: f64| if column.name == "time_s" { x } else { x.round().max(0.0) };
            let ahead = |(k, x): (usize, f64)| x + step * (row as f64 - k as f64);
            whole(match (before, after) {
                (Some((a, from)), Some((b, to))) if to >= from => {
                    from + (to - from) * (row - a) as f64 / (b - a) as f64
                }
                (Some(before), _) => ahead(before),
                (None, Some(after)) => ahead(after),
                (None, None) => {
                    match at.checked_sub(1).and_then(|k| known.get(k)).or_else(|| known.first()) {
                        Some(&near) => ahead(near),
                        None => row as f64,
                    }
                }
            })
        })
        .collect();
    for (&row, x) in rows.iter().zip(found) {
        column.set_number(&mut pulls[row].edit(), x);
    }
}
