//! The table of a dataset: columns of numbers or of words.

use crate::index::{INDEX_COLUMNS, index_header, status_name};
use crate::pulls::JudgedPulls;
use gripgen_twin::columns::{find, recorded_covariates};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{MeasuredPull, PULLS_SINCE_REST};

/// Whether a column of an index holds words whatever stands in it.
fn holds_words(name: &str) -> bool {
    ["status", "failure"].contains(&name) || find(name).is_some_and(|c| c.indexed && c.holds_words())
}

/// The column that says why a row failed or is suspect; in an index it is `failure`, whatever the status.
const REASON: &str = "status_reason";

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers; NaN where there is none.
    Number(Vec<f64>),
    /// Words; empty where there is none.
    Text(Vec<String>),
}

/// Columns of equal length, with names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    columns: Vec<(String, Column)>,
    rows: usize,
}

impl Table {
    /// An empty table for the rows of an index.
    pub(super) fn of_index(extra_columns: &[String]) -> Self {
        let columns = index_header(extra_columns).into_iter().map(|name| {
            let column = match holds_words(&name) || !INDEX_COLUMNS.contains(&name.as_str()) {
                true => Column::Text(Vec::new()),
                false => Column::Number(Vec::new()),
            };
            (name, column)
        });
        Self { columns: columns.collect(), rows: 0 }
    }

    /// Takes in a row of an index; cells that are missing are empty.
    pub(super) fn push(&mut self, row: &[String]) {
        let mut cells = row.iter();
        for (_, column) in &mut self.columns {
            let cell = cells.next().map_or("", String::as_str);
            match column {
                Column::Number(x) => x.push(cell.parse().unwrap_or(f64::NAN)),
                Column::Text(words) => words.push(cell.into()),
            }
        }
        self.rows += 1;
    }

    /// Columns of further keys become numbers if all their cells are.
    pub(super) fn finished(mut self) -> Self {
        for (name, column) in &mut self.columns {
            let Column::Text(words) = column else { continue };
            if holds_words(name) || words.iter().all(String::is_empty) {
                continue;
            }
            let numbers: Option<Vec<f64>> =
                words.iter().map(|w| if w.is_empty() { Some(f64::NAN) } else { w.parse().ok() }).collect();
            if let Some(numbers) = numbers {
                *column = Column::Number(numbers);
            }
        }
        let reasons =
            self.columns.iter().find(|(name, _)| name == "failure").map(|(_, column)| column.clone());
        self.columns.extend(reasons.map(|column| (REASON.to_string(), column)));
        self
    }

    /// The table of measured pulls: what was recorded of the known columns, and every further column.
    pub(super) fn of_pulls(judged: &JudgedPulls) -> Self {
        let JudgedPulls { pulls: measured, standing } = judged;
        let pulls = &measured.pulls;
        let words = |of: &dyn Fn(&MeasuredPull) -> String| Column::Text(pulls.iter().map(of).collect());
        let numbers = |of: &dyn Fn(&MeasuredPull) -> f64| Column::Number(pulls.iter().map(of).collect());
        let mut columns = vec![
            ("pull_id".to_string(), words(&|p| p.id.clone())),
            (
                "status".to_string(),
                Column::Text(standing.iter().map(|s| status_name(s.status).into()).collect()),
            ),
        ];
        for column in recorded_covariates(&measured.recorded) {
            let values = match column.holds_words() {
                true => words(&|p| column.word(p.view()).unwrap_or_default().into()),
                false => numbers(&|p| column.number(p.view()).unwrap_or(f64::NAN)),
            };
            columns.push((column.name.into(), values));
        }
        if pulls.iter().any(|p| p.start_n.is_some()) {
            columns.push(("force_start_n".into(), numbers(&|p| p.start_n.unwrap_or(p.increment_n))));
        }
        for extra in measured.extra.iter().filter(|e| e.name != PULLS_SINCE_REST) {
            let cell = |p: &MeasuredPull| p.covariates.extra.get(&extra.name).cloned();
            let is_text = pulls.iter().any(|p| matches!(cell(p), Some(Drawn::Text(_))));
            let column = match is_text {
                true => words(&|p| cell(p).map_or(String::new(), |v| v.to_string())),
                false => numbers(&|p| match cell(p) {
                    Some(Drawn::Number(x)) => x,
                    _ => f64::NAN,
                }),
            };
            columns.push((extra.name.clone(), column));
        }
        columns.push(("max_pull_force_n".into(), numbers(&|p| p.max_pull_force_n)));
        columns.push((REASON.into(), Column::Text(standing.iter().map(|s| s.reason.clone()).collect())));
        Self { columns, rows: pulls.len() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The columns in their order.
    pub fn columns(&self) -> &[(String, Column)] {
        &self.columns
    }

    /// The numbers of a column; `None` if there is no such column or it holds words.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        match &self.columns.iter().find(|(n, _)| n == name)?.1 {
            Column::Number(x) => Some(x),
            Column::Text(_) => None,
        }
    }

    /// The words of a column; `None` if there is no such column or it holds numbers.
    pub fn words(&self, name: &str) -> Option<&[String]> {
        match &self.columns.iter().find(|(n, _)| n == name)?.1 {
            Column::Text(words) => Some(words),
            Column::Number(_) => None,
        }
    }
}
