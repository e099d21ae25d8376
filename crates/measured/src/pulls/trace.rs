//! The trace of one pull.

use crate::table::{TableError, TableReader};
use gripgen_twin::{PullTrace, TraceRow};
use std::path::Path;

const COLUMNS: [&str; 4] = ["time_s", "desired_force_n", "measured_force_n", "displacement_mm"];

/// Reads a trace from the content of its file: four columns in any order, times that increase. Rows at its end that command
/// nothing any more are the reading without a load after the pull, and come apart from it.
pub(super) fn read_trace(path: &Path, bytes: &[u8]) -> Result<(PullTrace, Vec<f64>), TableError> {
    let mut table = TableReader::new(path, bytes)?;
    let mut at = [0; 4];
    for (slot, column) in at.iter_mut().zip(COLUMNS) {
        *slot = table.required(column)?;
    }
    let mut trace = PullTrace::default();
    while let Some(row) = table.row()? {
        let mut values = [0.0; 4];
        for (value, &place) in values.iter_mut().zip(&at) {
            *value = row.number(place, "a number")?;
        }
        let [time_s, desired_force_n, measured_force_n, displacement_mm] = values;
        if trace.time_s.last().is_some_and(|&last| time_s <= last) {
            return Err(row.bad(at[0], "later than the time of the row before"));
        }
        trace.push(TraceRow {
            time_s,
            desired_force_n,
            measured_force_n,
            displacement_m: displacement_mm * 1e-3,
        });
    }
    if trace.is_empty() {
        return Err(TableError::Empty { path: path.into() });
    }
    let after_n = match trace.desired_force_n.iter().rposition(|&force_n| force_n != 0.0) {
        Some(last) if trace.time_s[last] >= 0.0 => {
            let after_n = trace.measured_force_n.split_off(last + 1);
            for column in [&mut trace.time_s, &mut trace.desired_force_n, &mut trace.displacement_m] {
                column.truncate(last + 1);
            }
            after_n
        }
        _ => Vec::new(),
    };
    Ok((trace, after_n))
}
