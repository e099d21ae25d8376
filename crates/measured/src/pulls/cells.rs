//! What each column of a pull table means.

use crate::table::{TableError, TableReader, TextCells, number};
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_twin::MeasuredPull;
use gripgen_twin::columns::{COLUMNS, Column as PullColumn, InTable};
use std::borrow::Cow;

/// Length of a step where nobody wrote it down: the mean of Wucherer et al. 2023.
pub(super) const DEFAULT_STEP_S: f64 = 0.104;

const ID: &str = "pull_id";
pub(super) const LABEL: &str = "max_pull_force_n";

/// A column of the table.
pub(super) struct Column {
    pub(super) name: String,
    pub(super) cells: Cells,
    /// Cells that are not empty.
    pub(super) filled: usize,
}

/// Where a column's cells go.
pub(super) enum Cells {
    /// Into the pull.
    Known(&'static PullColumn),
    /// The name of the pull.
    Id,
    /// Its label.
    Label,
    /// A covariate of unknown meaning.
    Extra(TextCells),
    /// How the pull ended.
    Status(Vec<Status>),
    /// Why.
    Reason(Vec<String>),
    /// Nowhere: a column without a name.
    Unnamed,
}

impl Column {
    /// Takes the next cell; otherwise what it must be.
    pub(super) fn take(&mut self, cell: &str, pull: &mut MeasuredPull) -> Result<(), Cow<'static, str>> {
        self.filled += usize::from(!cell.is_empty());
        match &mut self.cells {
            Cells::Known(column) if cell.is_empty() && column.in_table != InTable::Required => Ok(()),
            Cells::Known(column) => column.read_cell(cell, &mut pull.edit()),
            Cells::Id => {
                file_name(cell)?;
                pull.id = cell.into();
                Ok(())
            }
            // A sensor that is off may read less than nothing. A pull that failed has none, which its status decides.
            Cells::Label if cell.is_empty() => {
                pull.max_pull_force_n = f64::NAN;
                Ok(())
            }
            Cells::Label => {
                pull.max_pull_force_n = number(cell).ok_or("a number")?;
                Ok(())
            }
            Cells::Extra(cells) => {
                cells.push(cell);
                Ok(())
            }
            Cells::Status(found) => {
                found.push(status(cell)?);
                Ok(())
            }
            Cells::Reason(reasons) => {
                reasons.push(cell.into());
                Ok(())
            }
            Cells::Unnamed => Ok(()),
        }
    }

    /// Its name, if it is a covariate of known meaning that somebody wrote down.
    pub(super) fn recorded(&self) -> Option<String> {
        let known = matches!(self.cells, Cells::Known(column) if column.is_covariate());
        (self.filled > 0 && known).then(|| self.name.clone())
    }
}

/// The columns that every table has.
fn required() -> impl Iterator<Item = &'static str> {
    let of_pulls = COLUMNS.iter().filter(|c| c.in_table == InTable::Required).map(|c| c.name);
    [ID].into_iter().chain(of_pulls).chain([LABEL])
}

/// The columns of a header; those that are required have to be there.
pub(super) fn columns(table: &TableReader<'_>) -> Result<Vec<Column>, TableError> {
    required().try_for_each(|name| table.required(name).map(|_| ()))?;
    table.check_single()?;
    let column = |name: &String| Column { name: name.clone(), cells: cells(name), filled: 0 };
    Ok(table.names().iter().map(column).collect())
}

fn cells(name: &str) -> Cells {
    let of_pulls = COLUMNS.iter().find(|c| c.name == name && c.in_table != InTable::Absent);
    match (name, of_pulls) {
        (_, Some(column)) => Cells::Known(column),
        ("", _) => Cells::Unnamed,
        (ID, _) => Cells::Id,
        (LABEL, _) => Cells::Label,
        ("status", _) => Cells::Status(Vec::new()),
        ("status_reason", _) => Cells::Reason(Vec::new()),
        _ => Cells::Extra(TextCells::default()),
    }
}

/// The status of a name, `slipped` where nobody wrote one down.
fn status(cell: &str) -> Result<Status, &'static str> {
    match cell {
        "" | "slipped" => Ok(Status::Slipped),
        "censored" => Ok(Status::Censored),
        "no_contact" => Ok(Status::NoContact),
        "failed" => Ok(Status::Failed),
        "suspect" => Ok(Status::Suspect),
        _ => Err("slipped, censored, no_contact, failed or suspect"),
    }
}

/// A pull's name is also that of its trace's file.
fn file_name(cell: &str) -> Result<(), &'static str> {
    let path = cell.contains(['/', '\\', '\0', ':']) || cell == "." || cell == "..";
    match cell {
        "" => Err("a name"),
        _ if path => Err("a name without `/`, `\\` and `:`"),
        _ => Ok(()),
    }
}
