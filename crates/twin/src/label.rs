//! The training label: the pull force at which the jaws slip.

pub mod check;
pub mod forces;
pub mod moments;

use crate::PullTrace;

/// The label of one pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipLabel {
    /// Time of the label.
    pub slip_time_s: f64,
    /// Measured pull force at that time.
    pub max_pull_force_n: f64,
    /// The pull ended before the jaws slipped: the true force is at least `max_pull_force_n`.
    pub censored: bool,
}

/// What ended a pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PullEnd {
    /// The tool moved farther than the displacement stop.
    Displacement,
    /// The jaws slid, and the command is so far above what they hold that the label cannot change any more.
    Decided,
    /// The commanded force reached its limit.
    ForceLimit,
    /// The pull took as long as it may.
    TimeLimit,
}

/// The measured force was never near the commanded one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the measured force was never within {tolerance_n} N of the command (closest {closest_n:.3} N in {rows} rows)"
)]
pub struct LabelError {
    /// Tolerance of the label rule.
    pub tolerance_n: f64,
    /// Smallest difference found.
    pub closest_n: f64,
    /// Rows looked at.
    pub rows: usize,
}

/// Applies the label rule of the pull experiment (Wucherer et al. 2023):
///
/// ```text
/// T_slip = max { t >= 0 : |F(t) - F_des(t)| < tolerance },   F_max = F(T_slip)
/// ```
///
/// The rule is taken literally, on the sampled and noisy trace, so F_max is not always the static limit.
/// A force that meets the staircase again *after* slipping would count as holding: the trace has to end at the
/// displacement stop ([`PullTrace::until_displacement`]). The paper uses a tolerance of 3 N.
///
/// A pull in which the jaws never slid on the part is `censored`: one that ended at its force or time limit, or whose
/// gels were so soft that their shear alone reached the displacement stop. A tool that crept there is lost as one that slid.
///
/// ```
/// use gripgen_twin::{slip_label, PullTrace, TraceRow};
/// let row = |time_s, desired_force_n, measured_force_n| TraceRow {
///     time_s, desired_force_n, measured_force_n, displacement_m: 0.0,
/// };
/// let trace: PullTrace =
///     [row(0.0, 3.0, 2.0), row(0.1, 8.0, 7.0), row(0.2, 13.0, 11.0), row(0.3, 18.0, 4.0)].into_iter().collect();
/// let label = slip_label(&trace, 3.0, true).unwrap();
/// assert_eq!((label.slip_time_s, label.max_pull_force_n), (0.2, 11.0));
/// ```
///
/// # Errors
///
/// A measured force that never comes within `tolerance_n` of the command.
pub fn slip_label(trace: &PullTrace, tolerance_n: f64, slid: bool) -> Result<SlipLabel, LabelError> {
    let mut last = None;
    let mut closest_n = f64::INFINITY;
    for row in trace.rows().filter(|row| row.time_s >= 0.0) {
        let difference = (row.measured_force_n - row.desired_force_n).abs();
        closest_n = closest_n.min(difference);
        if difference < tolerance_n {
            last = Some(row);
        }
    }
    let row = last.ok_or(LabelError { tolerance_n, closest_n, rows: trace.len() })?;
    Ok(SlipLabel { slip_time_s: row.time_s, max_pull_force_n: row.measured_force_n, censored: !slid })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TraceRow;

    fn trace(rows: &[(f64, f64, f64, f64)]) -> PullTrace {
        rows.iter()
            .map(|&(time_s, desired_force_n, measured_force_n, displacement_m)| TraceRow {
                time_s,
                desired_force_n,
                measured_force_n,
                displacement_m,
            })
            .collect()
    }

    #[test]
    fn a_force_that_meets_the_staircase_after_the_stop_does_not_count() {
        let t = trace(&[
            (0.0, 5.0, 5.0, 0.0),
            (0.1, 9.0, 6.5, 1e-3),
            (0.2, 12.0, 6.5, 6e-3),
            (0.3, 13.0, 12.9, 9e-3),
        ]);
        let uncut = slip_label(&t, 3.0, true).unwrap();
        assert_eq!(uncut.max_pull_force_n, 12.9, "the trap");
        let cut = t.until_displacement(5e-3);
        assert_eq!(cut.len(), 3, "the row that crosses the stop is kept");
        assert_eq!(slip_label(&cut, 3.0, true).unwrap().max_pull_force_n, 6.5);
    }

    #[test]
    fn the_tolerance_is_strict_and_the_no_load_reading_is_ignored() {
        let t = trace(&[(-0.1, 0.0, 0.0, 0.0), (0.0, 4.0, 1.0, 0.0), (0.1, 4.0, 1.5, 0.0)]);
        assert_eq!(slip_label(&t, 3.0, true).unwrap().slip_time_s, 0.1);
        let error = slip_label(&t, 2.5, true).unwrap_err();
        assert_eq!(error.closest_n, 2.5);
        assert!(error.to_string().contains("2.5 N"));
    }

    #[test]
    fn a_pull_that_never_slipped_is_censored() {
        let t = trace(&[(0.0, 4.0, 4.0, 0.0)]);
        assert!(slip_label(&t, 3.0, false).unwrap().censored);
        assert!(!slip_label(&t, 3.0, true).unwrap().censored);
    }

    #[test]
    fn the_label_does_not_depend_on_the_time_origin() {
        let rows = [(0.0, 3.0, 2.0, 0.0), (0.1, 8.0, 7.0, 0.0), (0.2, 13.0, 9.0, 0.0)];
        let shifted: Vec<_> = rows.iter().map(|r| (r.0 + 5.0, r.1, r.2, r.3)).collect();
        let (a, b) =
            (slip_label(&trace(&rows), 3.0, true).unwrap(), slip_label(&trace(&shifted), 3.0, true).unwrap());
        assert_eq!(a.max_pull_force_n, b.max_pull_force_n);
        assert_eq!(a.slip_time_s + 5.0, b.slip_time_s);
    }
}
