//! What each column of a pull table means.

use super::clock::Clock;
use crate::table::{Row, TableError, TableReader, TextCells};
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_twin::MeasuredPull;
use gripgen_twin::columns::{COLUMNS, Column as PullColumn, InTable};

/// Length of a step where nobody wrote it down: the mean of Wucherer et al. 2023.
pub(super) const DEFAULT_STEP_S: f64 = 0.104;

/// Height and length of the steps of a table that says neither: the rate of Wucherer et al. 2023 (1 N every 0.104 s) in tenths. Whoever
/// pulled in coarse steps has written them down; labels of other machines are the largest force of a steady rise.
pub(super) const STEADY_RISE: (f64, f64) = (0.1, 0.0104);

const ID: &str = "pull_id";
pub(super) const LABEL: &str = "max_pull_force_n";
const STATUS: &str = "status";
const REASON: &str = "status_reason";

/// A column of the table.
pub(super) struct Column {
    pub(super) name: String,
    pub(super) cells: Cells,
    /// Cells that are not empty.
    pub(super) filled: usize,
    /// Rows whose cell is empty.
    pub(super) missing: Vec<usize>,
    /// Clock times of a column of seconds, with their rows and lines.
    pub(super) clocks: Vec<(usize, u64, Clock)>,
}

/// The column that clock times may stand in.
pub(super) const CLOCK: &str = "time_s";

/// Columns of a table that are none of a pull.
const OF_THE_TABLE: [&str; 4] = [ID, LABEL, STATUS, REASON];

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
    /// Takes the cell of row `at` of the table.
    pub(super) fn take(
        &mut self,
        row: &Row<'_>,
        (place, at): (usize, usize),
        pull: &mut MeasuredPull,
    ) -> Result<(), TableError> {
        let cell = row.cell(place);
        match cell.is_empty() {
            true => self.missing.push(at),
            false => self.filled += 1,
        }
        match &mut self.cells {
            Cells::Id => {
                file_name(cell).map_err(|wanted| row.bad(place, wanted))?;
                pull.id = cell.into();
            }
            // What is missing is seen to when the whole column is known.
            Cells::Known(_) if cell.is_empty() => {}
            Cells::Label if cell.is_empty() => pull.max_pull_force_n = f64::NAN,
            Cells::Known(column) if column.holds_words() => column.set_word(&mut pull.edit(), cell),
            Cells::Known(column) => {
                let number = row.plain(place)?;
                let clock = if column.name == CLOCK { Clock::of(&number) } else { None };
                match (column.read_cell(&number, &mut pull.edit()), clock) {
                    (Err(_), Some(clock)) => self.clocks.push((at, row.line, clock)),
                    (read, _) => read.map_err(|wanted| row.bad(place, wanted))?,
                }
            }
            // A sensor that is off may read less than nothing.
            Cells::Label => pull.max_pull_force_n = row.number(place, "a number")?,
            Cells::Extra(cells) => cells.push(&row.plain(place)?),
            Cells::Status(found) => found.push(status(cell).map_err(|wanted| row.bad(place, wanted))?),
            Cells::Reason(reasons) => reasons.push(cell.into()),
            Cells::Unnamed => {}
        }
        Ok(())
    }

    /// Whether no pull can be used without it.
    pub(super) fn is_required(&self) -> bool {
        matches!(self.cells, Cells::Label)
            || matches!(self.cells, Cells::Known(column) if column.in_table == InTable::Required)
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
pub(super) fn columns(table: &mut TableReader<'_>) -> Result<Vec<Column>, TableError> {
    let of_pulls = COLUMNS.iter().filter(|c| c.in_table != InTable::Absent).map(|c| c.name);
    table.spell(&of_pulls.chain(OF_THE_TABLE).collect::<Vec<_>>());
    required().try_for_each(|name| table.required(name).map(|_| ()))?;
    table.check_single()?;
    let column = |name: &String| Column {
        name: name.clone(),
        cells: cells(name),
        filled: 0,
        missing: Vec::new(),
        clocks: Vec::new(),
    };
    Ok(table.names().iter().map(column).collect())
}

fn cells(name: &str) -> Cells {
    let of_pulls = COLUMNS.iter().find(|c| c.name == name && c.in_table != InTable::Absent);
    match (name, of_pulls) {
        (_, Some(column)) => Cells::Known(column),
        ("", _) => Cells::Unnamed,
        (ID, _) => Cells::Id,
        (LABEL, _) => Cells::Label,
        (STATUS, _) => Cells::Status(Vec::new()),
        (REASON, _) => Cells::Reason(Vec::new()),
        _ => Cells::Extra(TextCells::default()),
    }
}

/// The status of a name, `slipped` where nobody wrote one down.
fn status(cell: &str) -> Result<Status, &'static str> {
    match cell.to_lowercase().as_str() {
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
