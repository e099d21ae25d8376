//! Readings without a load.

use super::signal::{Signal, mean};
use super::{Finding, FindingKind, LabelBudget, LabelEvidence, SIGMAS, zero_cap_n};

/// Column of how far the sensor's zero has moved along the pull when the jaws slip, N, from readings without a load before and
/// after. It is no covariate: whoever reads measured pulls takes it off the label.
pub const ZERO_SHIFT: &str = "zero_shift_n";

/// Fewest readings that make a zero.
const READINGS: usize = 3;

/// The zero before the pull, and whether it is still the same after it.
pub(super) fn without_load(
    signal: &Signal<'_>,
    evidence: &LabelEvidence<'_>,
    findings: &mut Vec<Finding>,
    budget: &mut LabelBudget,
) {
    let cap = zero_cap_n(evidence.label_n);
    let chance_n = |n: usize| SIGMAS * signal.noise_n / (n as f64).sqrt();
    let (before, after) = (signal.before_n, evidence.no_load_after_n);
    let zero_n = mean(before);
    if before.len() >= READINGS {
        let allowed = cap.max(chance_n(before.len()));
        findings.push(Finding {
            kind: FindingKind::Zero,
            found: zero_n,
            wanted: 0.0,
            allowed,
            time_s: Some(signal.time_s[0]),
        });
        budget.zero_n = zero_n.abs();
    }
    if after.len() >= READINGS {
        let found = mean(after);
        // Without a reading before there is nothing to compare with but zero.
        let chance_n =
            libm::hypot(chance_n(after.len()), if before.is_empty() { 0.0 } else { chance_n(before.len()) });
        findings.push(Finding {
            kind: FindingKind::ZeroShift,
            found,
            wanted: zero_n,
            allowed: cap.max(chance_n),
            time_s: None,
        });
        budget.zero_n = budget.zero_n.max((found - zero_n).abs()).max(found.abs());
    }
}
