//! The trace of one pull.

use super::PullFolderError;
use super::cells::number;
use gripgen_twin::{PullTrace, TraceRow};
use std::path::Path;

const COLUMNS: [&str; 4] = ["time_s", "desired_force_n", "measured_force_n", "displacement_mm"];

/// Reads a trace from the content of its file: four columns in any order, times that increase. Rows at its end that command
/// nothing any more are the reading without a load after the pull, and come apart from it.
pub(super) fn read_trace(path: &Path, bytes: &[u8]) -> Result<(PullTrace, Vec<f64>), PullFolderError> {
    let table = |e: csv::Error| PullFolderError::Table { path: path.into(), problem: e.to_string() };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header = reader.headers().map_err(table)?.clone();
    let mut at = [0; 4];
    for (slot, column) in at.iter_mut().zip(COLUMNS) {
        let found = header.iter().position(|h| h.trim_start_matches('\u{feff}') == column);
        *slot = found.ok_or_else(|| PullFolderError::Column {
            path: path.into(),
            column,
            found: header.iter().collect::<Vec<_>>().join(", "),
        })?;
    }
    let mut trace = PullTrace::default();
    let mut row = csv::StringRecord::new();
    while reader.read_record(&mut row).map_err(table)? {
        let line = row.position().map_or(0, csv::Position::line);
        let mut values = [0.0; 4];
        let bad = |i: usize, wanted: &'static str| PullFolderError::Cell {
            path: path.into(),
            line,
            column: COLUMNS[i].into(),
            value: row.get(at[i]).unwrap_or_default().into(),
            wanted: wanted.into(),
        };
        for (i, value) in values.iter_mut().enumerate() {
            *value = number(row.get(at[i]).unwrap_or_default()).map_err(|wanted| bad(i, wanted))?;
        }
        let [time_s, desired_force_n, measured_force_n, displacement_mm] = values;
        if trace.time_s.last().is_some_and(|&last| time_s <= last) {
            return Err(bad(0, "later than the time of the row before"));
        }
        trace.push(TraceRow {
            time_s,
            desired_force_n,
            measured_force_n,
            displacement_m: displacement_mm * 1e-3,
        });
    }
    if trace.is_empty() {
        return Err(PullFolderError::Empty { path: path.into() });
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
