//! The trace of one pull.

use super::zero::{CommandNeverRises, Plan, find_zero};
use crate::table::{TableError, TableReader};
use gripgen_twin::values::median;
use gripgen_twin::{PullTrace, TraceRow};
use std::path::Path;

const COLUMNS: [&str; 4] = ["time_s", "desired_force_n", "measured_force_n", "displacement_mm"];

/// Longest time without a reading that is not said, and its share of the usual time between them: a pull of a few seconds has
/// lost a tenth of itself then.
const GAP_S: f64 = 0.2;
const GAP_OF_USUAL: f64 = 20.0;

/// A trace, and what was done to it.
#[derive(Debug, Default)]
pub(super) struct ReadTrace {
    /// The trace, from the first step of its command on; `None` where it has none.
    pub(super) trace: Option<PullTrace>,
    /// Readings without a load after the pull.
    pub(super) after_n: Vec<f64>,
    /// By how much its times were moved.
    pub(super) moved_s: f64,
    /// Rows without one of the four values, and rows with the time of the row before.
    pub(super) without: usize,
    pub(super) again: usize,
    /// Time and length of the longest stretch of the pull without a reading, where it is long.
    pub(super) gap_s: Option<(f64, f64)>,
    /// Why there is no trace.
    pub(super) refused: Option<CommandNeverRises>,
}

/// Reads a trace from the content of its file: four columns in any order, times that increase. Time 0 is the first step of the
/// command, which is looked for where the times say something else. Rows at its end that command nothing any more are the reading
/// without a load after the pull, and come apart from it.
pub(super) fn read_trace(path: &Path, bytes: &[u8], plan: Plan) -> Result<ReadTrace, TableError> {
    let mut table = TableReader::new(path, bytes)?;
    table.spell(&COLUMNS);
    let mut at = [0; 4];
    for (slot, column) in at.iter_mut().zip(COLUMNS) {
        *slot = table.required(column)?;
    }
    let (mut trace, mut found) = (PullTrace::default(), ReadTrace::default());
    while let Some(row) = table.row()? {
        if at.iter().any(|&place| row.cell(place).is_empty()) {
            found.without += 1;
            continue;
        }
        let mut values = [0.0; 4];
        for (value, &place) in values.iter_mut().zip(&at) {
            *value = row.number(place, "a number")?;
        }
        let [time_s, desired_force_n, measured_force_n, displacement_mm] = values;
        match trace.time_s.last() {
            Some(&last) if time_s == last => found.again += 1,
            Some(&last) if time_s < last => {
                return Err(row.bad(at[0], format!("later than {last}, the time of the row before")));
            }
            _ => trace.push(TraceRow {
                time_s,
                desired_force_n,
                measured_force_n,
                displacement_m: displacement_mm * 1e-3,
            }),
        }
    }
    if trace.is_empty() {
        return Err(TableError::Empty { path: path.into() });
    }
    if found.again > trace.len() {
        let problem = format!(
            "`time_s` has {} different times in {} rows: a clock that counts more finely is needed",
            trace.len(),
            trace.len() + found.again
        );
        return Err(TableError::Rows { path: path.into(), problem });
    }
    match find_zero(&trace, plan) {
        Ok(zero_s) if zero_s != 0.0 => {
            // Times since 1970 have less than a microsecond left.
            trace.time_s.iter_mut().for_each(|t| *t = ((*t - zero_s) * 1e6).round() * 1e-6);
            found.moved_s = zero_s;
        }
        Ok(_) => {}
        Err(never) => {
            found.refused = Some(never);
            return Ok(found);
        }
    }
    if let Some(last) = trace.desired_force_n.iter().rposition(|&force_n| force_n != 0.0)
        && trace.time_s[last] >= 0.0
    {
        found.after_n = trace.measured_force_n.split_off(last + 1);
        for column in [&mut trace.time_s, &mut trace.desired_force_n, &mut trace.displacement_m] {
            column.truncate(last + 1);
        }
    }
    found.gap_s = longest_gap(&trace);
    found.trace = Some(trace);
    Ok(found)
}

/// Where the longest stretch of the pull without a reading begins, and how long it is, if that is far beyond the usual.
fn longest_gap(trace: &PullTrace) -> Option<(f64, f64)> {
    let pulled = &trace.time_s[trace.time_s.partition_point(|&t| t < 0.0)..];
    let longest = pulled.windows(2).map(|w| (w[0], w[1] - w[0])).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let usual = median(pulled.windows(2).map(|w| w[1] - w[0]).collect())?;
    (longest.1 > GAP_S.max(GAP_OF_USUAL * usual)).then_some(longest)
}
