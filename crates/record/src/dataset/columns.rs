//! The table of a dataset: columns of numbers or of words.

use crate::index::{INDEX_COLUMNS, index_header, status_name};
use crate::pulls::JudgedPulls;
use gripgen_twin::draw::Drawn;
use gripgen_twin::{KNOWN_COLUMNS, MeasuredPull, PULLS_SINCE_REST};

/// Columns of an index that hold words whatever stands in them.
const WORDS: [&str; 5] = ["status", "part", "gel_id", "session", "failure"];

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
            let column = match WORDS.contains(&name.as_str()) || !INDEX_COLUMNS.contains(&name.as_str()) {
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
            if WORDS.contains(&name.as_str()) || words.iter().all(String::is_empty) {
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
        let is_there =
            |c: &str| ["part", "grip_force_n"].contains(&c) || measured.recorded.iter().any(|r| r == c);
        for &name in KNOWN_COLUMNS.iter().filter(|c| is_there(c)) {
            let column = match name {
                "part" => words(&|p| p.part.clone()),
                "gel_id" => words(&|p| p.covariates.gel_id.clone()),
                "session" => words(&|p| p.covariates.session.clone()),
                "grip_force_n" => numbers(&|p| p.grip_force_n),
                "force_increment_n" => numbers(&|p| p.increment_n),
                "step_time_s" => numbers(&|p| p.step_s),
                "dwell_s" => numbers(&|p| p.covariates.dwell_s),
                "pull_index" => numbers(&|p| p.covariates.pull_index as f64),
                "time_s" => numbers(&|p| p.covariates.time_s),
                "temperature_c" => numbers(&|p| p.covariates.temperature_c),
                "grip_offset_mm" => numbers(&|p| p.covariates.grip_offset_m * 1e3),
                "grip_angle_deg" => numbers(&|p| p.covariates.grip_angle_rad.to_degrees()),
                _ => numbers(&|p| p.covariates.pull_direction),
            };
            columns.push((name.into(), column));
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
