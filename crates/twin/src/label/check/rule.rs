//! The label rule, applied to the trace again.

use super::signal::{ROUNDING_N, Signal};
use super::{Finding, FindingKind, LabelEvidence};

/// Standard deviations of the noise by which a label may differ from the rows around it.
const SIGMAS: f64 = 4.0;
/// The share of it for a label above the last row, where the command goes on, and beyond all rows that it may lie between.
const SHARE_ABOVE: f64 = 0.875;
const BEYOND: f64 = 0.5;

/// What the rule gives, against the label.
///
/// A trace that holds every reading gives the label to the last digit. Of one that was thinned, the label may be a reading
/// between the last row that the rule accepts and the next, or one that noise carried across the tolerance.
pub(super) fn label_rule(signal: &Signal<'_>, evidence: &LabelEvidence<'_>) -> Finding {
    let (label_n, tolerance_n) = (evidence.label_n, evidence.tolerance_n);
    let finding =
        |found, allowed, time_s| Finding { kind: FindingKind::Rule, found, wanted: label_n, allowed, time_s };
    let Some(last) = signal.last else { return finding(f64::NEG_INFINITY, 0.0, None) };
    let (found, at_s) = (signal.measured_n[last], Some(signal.time_s[last]));
    if (found - label_n).abs() <= ROUNDING_N {
        return finding(found, ROUNDING_N, at_s);
    }
    let off_n = |i: usize| (signal.measured_n[i] - signal.desired_n[i]).abs();
    let noise_n = if evidence.every_reading { 0.0 } else { SIGMAS * signal.noise_n };
    let surely = (0..=last).rev().find(|&i| off_n(i) < tolerance_n - ROUNDING_N).unwrap_or(0);
    let (mut low_n, mut high_n) = (found, found);
    for i in (surely..signal.len()).filter(|&i| off_n(i) < tolerance_n + ROUNDING_N + noise_n) {
        low_n = low_n.min(signal.measured_n[i]);
        high_n = high_n.max(signal.measured_n[i]);
    }
    if let (false, Some(&next_n)) = (evidence.every_reading, signal.measured_n.get(last + 1)) {
        // Between two rows the force passes the edge of the tolerance.
        let desired_n = [signal.desired_n[last], signal.desired_n[last + 1]];
        let low_edge_n = desired_n[0].min(desired_n[1]) - tolerance_n;
        let high_edge_n = desired_n[0].max(desired_n[1]) + tolerance_n;
        let next_n = next_n.max(low_edge_n).min(high_edge_n);
        low_n = low_n.min(next_n);
        high_n = high_n.max(next_n);
    }
    // In the time between two rows the command goes on.
    let rise_n = match evidence.every_reading {
        true => 0.0,
        false => signal.spacing_s * signal.desired_n[last] / signal.time_s[last].max(signal.spacing_s),
    };
    // The rows between them have their noise in them already.
    let beyond_n = BEYOND * noise_n;
    let allowed = match label_n < found {
        true => (found - low_n + beyond_n).max(noise_n),
        false => (high_n - found + beyond_n).max(SHARE_ABOVE * noise_n) + rise_n,
    };
    finding(found, allowed + ROUNDING_N, at_s)
}
