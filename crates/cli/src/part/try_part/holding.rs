//! How much a grip is expected to hold, by grip force.

use crate::part::init::MU;
use gripgen::SampleError;
use gripgen_report::{FrictionRange, Holding};
use gripgen_twin::Outcome;

/// Forces of a jaw that are tried.
const FORCES_N: [f64; 8] = [5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0];

/// Relative half width of a 90 % interval over repetitions: they scatter by 3 to 7 %, 1.645 deviations of 5 %.
const REPEATS: f64 = 0.082;

/// Friction of a part of which nothing is known: no shape tells it. The value is that of a new twin; four steel parts had 0.14 to
/// 0.17 (Wucherer et al. 2023, table of fits). Oil and dust take 10 to 60 % of it, and vendors quote dry silicone rubber from
/// 0.25 to 0.75. A range and no interval: what a part has depends on whose part it is.
pub(super) fn friction_of_any_part() -> FrictionRange {
    FrictionRange { low: 0.06, value: MU, high: 0.75, is_measured: false }
}

/// Friction of a part that was measured: its repetitions scatter.
pub(super) fn friction_measured(mu: f64) -> FrictionRange {
    FrictionRange { low: mu * (1.0 - REPEATS), value: mu, high: mu * (1.0 + REPEATS), is_measured: true }
}

/// The pull at slip for each grip force; `pulls` makes one for each of three friction coefficients.
pub(super) fn holding(
    mu: FrictionRange,
    most_n: f64,
    asked_n: Option<f64>,
    pulls: &dyn Fn(f64, [f64; 3]) -> Result<[Outcome; 3], SampleError>,
) -> Vec<Holding> {
    let mut forces_n: Vec<f64> = FORCES_N.iter().copied().filter(|&n| n <= most_n).chain(asked_n).collect();
    forces_n.sort_by(f64::total_cmp);
    forces_n.dedup();
    let at = |grip_force_n: f64| {
        let labels = pulls(grip_force_n, [mu.low, mu.value, mu.high]).map_err(|e| e.to_string());
        let max_pull_force_n =
            labels.and_then(|[low, value, high]| Ok([label(low)?, label(value)?, label(high)?]));
        Holding { grip_force_n, max_pull_force_n }
    };
    forces_n.into_iter().map(at).collect()
}

fn label(outcome: Outcome) -> Result<f64, String> {
    match outcome {
        Outcome::Pulled(pulled) => Ok(pulled.label.max_pull_force_n),
        Outcome::Failed { reason } => Err(reason),
        Outcome::NoContact { .. } => Err("the jaws meet without touching the part".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each force that the gripper has stands once and in order, with the reason where nothing holds.
    #[test]
    fn forces_are_those_of_the_gripper_and_the_one_asked_for() {
        let refused = |force_n: f64, _| {
            Err(SampleError::NoForce { jaw: gripgen_twin::Jaw::Left, force_n, commanded_n: 1.0 })
        };
        let found = holding(friction_of_any_part(), 40.0, Some(17.0), &refused);
        let forces: Vec<f64> = found.iter().map(|h| h.grip_force_n).collect();
        assert_eq!(forces, [5.0, 10.0, 15.0, 17.0, 20.0, 30.0, 40.0]);
        assert!(
            found
                .iter()
                .all(|h| h.max_pull_force_n.as_ref().is_err_and(|why| why.contains("nothing is gripped")))
        );
        assert_eq!(holding(friction_of_any_part(), 40.0, Some(20.0), &refused).len(), 6);
    }
}
