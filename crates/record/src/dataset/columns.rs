//! The table of a dataset: columns of numbers or of words.

use crate::index::{INDEX_COLUMNS, index_header};
use gripgen_twin::Values;
use gripgen_twin::columns::{Kind, find};

/// Whether a column of an index holds words whatever stands in it.
fn holds_words(name: &str) -> bool {
    ["status", "failure", "label_branch"].contains(&name)
        || find(name).is_some_and(|c| c.indexed && c.holds_words())
}

/// The column that says why a row failed or is suspect; in an index it is `failure`, whatever the status.
const REASON: &str = "status_reason";

/// Columns that count something and are no column of a pull.
const COUNTS: [&str; 5] = ["index", "shard", "in_shard", "group", "repetition"];

/// Columns of equal length, with names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    columns: Vec<(String, Values)>,
    rows: usize,
}

impl Table {
    /// The table of rows of an index.
    pub fn of_index_rows<'a>(
        extra_columns: &[String],
        rows: impl IntoIterator<Item = &'a Vec<String>>,
    ) -> Self {
        let mut table = Self::of_index(extra_columns);
        rows.into_iter().for_each(|row| table.push(row));
        table.finished()
    }

    /// An empty table for the rows of an index.
    pub(super) fn of_index(extra_columns: &[String]) -> Self {
        let columns = index_header(extra_columns).into_iter().map(|name| {
            let column = match holds_words(&name) || !INDEX_COLUMNS.contains(&name.as_str()) {
                true => Values::Words(Vec::new()),
                false => Values::Numbers(Vec::new()),
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
                Values::Numbers(x) => x.push(cell.parse().unwrap_or(f64::NAN)),
                Values::Words(words) => words.push(cell.into()),
            }
        }
        self.rows += 1;
    }

    /// Columns of further keys become numbers if all their cells are.
    pub(super) fn finished(mut self) -> Self {
        for (name, column) in &mut self.columns {
            let Values::Words(words) = column else { continue };
            if holds_words(name) {
                continue;
            }
            if let Some(values) = Values::of_cells(words.iter().map(String::as_str)) {
                *column = values;
            }
        }
        let reasons =
            self.columns.iter().find(|(name, _)| name == "failure").map(|(_, column)| column.clone());
        self.columns.extend(reasons.map(|column| (REASON.to_string(), column)));
        self
    }

    /// A table of columns of equal length.
    pub fn of_columns(columns: Vec<(String, Values)>) -> Self {
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        Self { columns, rows }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Whether a column holds nothing but whole numbers, and stands for whole numbers: it counts something, or is a direction.
    pub fn is_whole(&self, name: &str) -> bool {
        let counts = COUNTS.contains(&name)
            || find(name).is_some_and(|c| matches!(c.kind, Kind::Whole | Kind::Direction));
        counts && self.numbers(name).is_some_and(|x| x.iter().all(|x| x.is_nan() || x.fract() == 0.0))
    }

    /// The columns in their order.
    pub fn columns(&self) -> &[(String, Values)] {
        &self.columns
    }

    /// The numbers of a column; `None` if there is no such column or it holds words.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        match &self.columns.iter().find(|(n, _)| n == name)?.1 {
            Values::Numbers(x) => Some(x),
            Values::Words(_) => None,
        }
    }

    /// The words of a column; `None` if there is no such column or it holds numbers.
    pub fn words(&self, name: &str) -> Option<&[String]> {
        match &self.columns.iter().find(|(n, _)| n == name)?.1 {
            Values::Words(words) => Some(words),
            Values::Numbers(_) => None,
        }
    }
}
