//! A zero of the force sensor that moves during a pull is measured with it, and taken off its label.

use gripgen_twin::label::check::ZERO_SHIFT;
use gripgen_twin::{ExtraColumn, MeasuredPulls, Values};

/// Takes the shift of the sensor's zero off the labels. A column of that name is then no covariate any more: what is known of a
/// pull needs no cause. Returns a remark where it matters.
pub(super) fn without_shift(measured: &mut MeasuredPulls) -> Option<String> {
    let numbers =
        |column: &ExtraColumn| column.name == ZERO_SHIFT && matches!(column.values, Values::Numbers(_));
    let at = measured.extra.iter().position(numbers)?;
    let Values::Numbers(shifts_n) = measured.extra.remove(at).values else { return None };
    let mut most_n = 0.0_f64;
    for (pull, shift_n) in measured.pulls.iter_mut().zip(shifts_n) {
        pull.covariates.extra.remove(ZERO_SHIFT);
        if shift_n.is_finite() {
            pull.zero_shift_n = shift_n;
            pull.max_pull_force_n -= shift_n;
            most_n = most_n.max(shift_n.abs());
        }
    }
    (most_n >= WORTH_A_WORD_N).then(|| {
        format!(
            "the zero of the force sensor moved by up to {most_n:.2} N before a slip ({ZERO_SHIFT}): labels are taken less that"
        )
    })
}

/// Less than this is the noise of readings without a load.
const WORTH_A_WORD_N: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::traces::tests::pull;

    fn measured(extra: Vec<ExtraColumn>) -> MeasuredPulls {
        MeasuredPulls {
            pulls: (0..3).map(pull).collect(),
            recorded: vec![],
            extra,
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            sha256: String::new(),
        }
    }

    #[test]
    fn labels_are_taken_without_what_the_zero_moved() {
        let column = |name: &str, values| ExtraColumn { name: name.into(), values: Values::Numbers(values) };
        let lab = column("humidity_pct", vec![40.0, 41.0, 42.0]);
        let mut moved = measured(vec![lab.clone(), column(ZERO_SHIFT, vec![0.5, f64::NAN, -0.25])]);
        let note = without_shift(&mut moved).unwrap();
        assert!(note.contains("up to 0.50 N"), "{note}");
        assert_eq!(moved.extra, [lab]);
        assert_eq!(moved.pulls.iter().map(|p| p.max_pull_force_n).collect::<Vec<_>>(), [2.5, 3.0, 3.25]);
        assert_eq!(moved.pulls.iter().map(|p| p.zero_shift_n).collect::<Vec<_>>(), [0.5, 0.0, -0.25]);
        let mut still = measured(vec![column(ZERO_SHIFT, vec![0.01, -0.02, 0.0])]);
        assert_eq!(without_shift(&mut still), None);
        assert_eq!(without_shift(&mut measured(vec![])), None);
        // Words under that name are somebody's own column.
        let words = ExtraColumn { name: ZERO_SHIFT.into(), values: Values::Words(vec!["small".into(); 3]) };
        let mut spoken = measured(vec![words.clone()]);
        assert_eq!((without_shift(&mut spoken), spoken.extra), (None, vec![words]));
    }
}
