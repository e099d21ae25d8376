//! The columns of a press table that say in which circumstances each press was made.

use crate::press_table::{press_table, read_press_columns};
use crate::table::TableError;
use gripgen_twin::Values;
use std::path::Path;

/// Columns that are marks of the contact, not circumstances.
const MARKS: [&str; 10] = [
    "image",
    "x_px",
    "y_px",
    "radius_px",
    "depth_mm",
    "pull_index",
    "mesh",
    "shape",
    "rotation_deg",
    "edge_radius_mm",
];

/// A circumstance of the presses, by row.
#[derive(Debug, Clone, PartialEq)]
pub struct PressColumn {
    /// Name of the column.
    pub name: String,
    /// Its values.
    pub values: Values,
}

/// The columns of a table in addition to images and marks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressColumns {
    /// Name of the image of each row.
    pub names: Vec<String>,
    /// Seconds since the first press.
    pub time_s: Option<Vec<f64>>,
    /// All other columns.
    pub covariates: Vec<PressColumn>,
}

impl PressColumns {
    /// Takes the rows of some images out.
    pub fn leave_out(&mut self, names: &[String]) {
        let keep: Vec<bool> = self.names.iter().map(|n| !names.contains(n)).collect();
        retain(&mut self.names, &keep);
        if let Some(times) = &mut self.time_s {
            retain(times, &keep);
        }
        for covariate in &mut self.covariates {
            covariate.values = covariate.values.kept(|row| keep.get(row).copied().unwrap_or(true));
        }
    }
}

fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut at = 0;
    list.retain(|_| {
        at += 1;
        keep.get(at - 1).copied().unwrap_or(true)
    });
}

/// Reads them from the table of a folder; a `dataPack.npz` has none. A clock with gaps is a covariate only.
///
/// # Errors
/// What is wrong with the table.
pub fn load_press_columns(path: &Path) -> Result<PressColumns, TableError> {
    if press_table(path).is_none() {
        return Ok(PressColumns::default());
    }
    let table = read_press_columns(path)?;
    let mut columns = PressColumns { names: table.names, ..Default::default() };
    for (name, values) in table.columns.into_iter().filter(|(name, _)| !MARKS.contains(&name.as_str())) {
        match values {
            Values::Numbers(times) if name == "time_s" && times.iter().all(|t| t.is_finite()) => {
                let first = times.iter().fold(f64::INFINITY, |m, t| m.min(*t));
                columns.time_s = Some(times.iter().map(|t| t - first).collect());
            }
            values => columns.covariates.push(PressColumn { name, values }),
        }
    }
    Ok(columns)
}
