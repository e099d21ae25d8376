//! What each column of a pull table means.

use super::PullFolderError;
use crate::proto::gripgen_v1::Status;
use gripgen_twin::{KNOWN_COLUMNS, MeasuredPull};
use std::path::Path;

/// Length of a step where nobody wrote it down: the mean of Wucherer et al. 2023.
pub(super) const DEFAULT_STEP_S: f64 = 0.104;

const REQUIRED: [&str; 4] = ["pull_id", "part", "grip_force_n", "max_pull_force_n"];

/// A column of the table.
pub(super) struct Column {
    pub(super) name: String,
    pub(super) cells: Cells,
    /// Cells that are not empty.
    pub(super) filled: usize,
}

/// Where a column's cells go.
pub(super) enum Cells {
    /// Into the pull; the setter says what a cell must be.
    Known { set: Setter, required: bool },
    /// A covariate of unknown meaning.
    Extra(Vec<Box<str>>),
    /// How the pull ended.
    Status(Vec<Status>),
    /// Why.
    Reason(Vec<String>),
    /// Nowhere: a column without a name.
    Unnamed,
}

type Setter = fn(&str, &mut MeasuredPull) -> Result<(), &'static str>;

impl Column {
    /// Takes the next cell; otherwise what it must be.
    pub(super) fn take(&mut self, cell: &str, pull: &mut MeasuredPull) -> Result<(), &'static str> {
        self.filled += usize::from(!cell.is_empty());
        match &mut self.cells {
            Cells::Known { required: false, .. } if cell.is_empty() => Ok(()),
            Cells::Known { set, .. } => set(cell, pull),
            Cells::Extra(cells) => {
                cells.push(cell.into());
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
        (self.filled > 0 && KNOWN_COLUMNS.contains(&self.name.as_str())).then(|| self.name.clone())
    }
}

/// The columns of a header; those that are required have to be there.
pub(super) fn columns(path: &Path, header: &csv::StringRecord) -> Result<Vec<Column>, PullFolderError> {
    let names: Vec<&str> = header.iter().map(|name| name.trim_start_matches('\u{feff}').trim()).collect();
    for column in REQUIRED {
        if !names.contains(&column) {
            let found = names.join(", ");
            return Err(PullFolderError::Column { path: path.into(), column, found });
        }
    }
    for (i, &name) in names.iter().enumerate() {
        if !name.is_empty() && names[..i].contains(&name) {
            return Err(PullFolderError::TwoColumns { path: path.into(), column: name.into() });
        }
    }
    let column = |&name: &&str| {
        let cells = match setter(name) {
            Some(set) => Cells::Known { set, required: REQUIRED.contains(&name) },
            None if name.is_empty() => Cells::Unnamed,
            None if name == "status" => Cells::Status(Vec::new()),
            None if name == "status_reason" => Cells::Reason(Vec::new()),
            None => Cells::Extra(Vec::new()),
        };
        Column { name: name.into(), cells, filled: 0 }
    };
    Ok(names.iter().map(column).collect())
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

/// A number, NaN where there is none; `None` if it is a word.
pub(super) fn loose_number(cell: &str) -> Option<f64> {
    match cell.parse::<f64>() {
        _ if cell.is_empty() => Some(f64::NAN),
        Ok(x) if x.is_finite() => Some(x),
        Ok(_) => Some(f64::NAN),
        Err(_) => None,
    }
}

fn setter(name: &str) -> Option<Setter> {
    let setter: Setter = match name {
        "pull_id" => |cell, pull| text(cell, &mut pull.id).and_then(|()| file_name(cell)),
        "part" => |cell, pull| text(cell, &mut pull.part),
        "gel_id" => |cell, pull| text(cell, &mut pull.covariates.gel_id),
        "session" => |cell, pull| text(cell, &mut pull.covariates.session),
        "grip_force_n" => |cell, pull| above_zero(cell, &mut pull.grip_force_n),
        // A sensor that is off may read less than nothing. A pull that failed has none, which its status decides.
        "max_pull_force_n" => |cell, pull| match cell {
            "" => {
                pull.max_pull_force_n = f64::NAN;
                Ok(())
            }
            _ => number(cell, &mut pull.max_pull_force_n),
        },
        "force_increment_n" => |cell, pull| above_zero(cell, &mut pull.increment_n),
        "force_start_n" => |cell, pull| {
            let mut start_n = 0.0;
            not_negative(cell, &mut start_n)?;
            pull.start_n = Some(start_n);
            Ok(())
        },
        "step_time_s" => |cell, pull| above_zero(cell, &mut pull.step_s),
        "dwell_s" => |cell, pull| not_negative(cell, &mut pull.covariates.dwell_s),
        "time_s" => |cell, pull| number(cell, &mut pull.covariates.time_s),
        "temperature_c" => |cell, pull| number(cell, &mut pull.covariates.temperature_c),
        "grip_offset_mm" => |cell, pull| {
            number(cell, &mut pull.covariates.grip_offset_m)?;
            pull.covariates.grip_offset_m *= 1e-3;
            Ok(())
        },
        "grip_angle_deg" => |cell, pull| {
            number(cell, &mut pull.covariates.grip_angle_rad)?;
            pull.covariates.grip_angle_rad = pull.covariates.grip_angle_rad.to_radians();
            Ok(())
        },
        "pull_index" => |cell, pull| {
            let mut index = 0.0;
            number(cell, &mut index)?;
            if !(0.0..=1e15).contains(&index) || index.fract() != 0.0 {
                return Err("a whole number of at least 0");
            }
            pull.covariates.pull_index = index as u64;
            Ok(())
        },
        "pull_direction" => |cell, pull| {
            let mut direction = 0.0;
            number(cell, &mut direction)?;
            if direction.abs() != 1.0 {
                return Err("1 (up) or -1 (down)");
            }
            pull.covariates.pull_direction = direction;
            Ok(())
        },
        _ => return None,
    };
    Some(setter)
}

fn text(cell: &str, target: &mut String) -> Result<(), &'static str> {
    if cell.is_empty() {
        return Err("a name");
    }
    target.clear();
    target.push_str(cell);
    Ok(())
}

/// A pull's name is also that of its trace's file.
fn file_name(cell: &str) -> Result<(), &'static str> {
    let path = cell.contains(['/', '\\', '\0', ':']) || cell == "." || cell == "..";
    if path { Err("a name without `/`, `\\` and `:`") } else { Ok(()) }
}

pub(super) fn number(cell: &str, target: &mut f64) -> Result<(), &'static str> {
    match cell.parse::<f64>() {
        Ok(x) if x.is_finite() => {
            *target = x;
            Ok(())
        }
        _ => Err("a number"),
    }
}

fn above_zero(cell: &str, target: &mut f64) -> Result<(), &'static str> {
    match number(cell, target) {
        Ok(()) if *target > 0.0 => Ok(()),
        _ => Err("a number above 0"),
    }
}

fn not_negative(cell: &str, target: &mut f64) -> Result<(), &'static str> {
    match number(cell, target) {
        Ok(()) if *target >= 0.0 => Ok(()),
        _ => Err("a number of at least 0"),
    }
}
