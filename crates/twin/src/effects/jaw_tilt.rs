//! Jaws that are not parallel: the grip is a wedge.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};
use crate::Jaw;

/// Largest coefficient of a wedge that locks.
const LOCKED_MU: f64 = 100.0;

/// `jaw_tilt`: on a tilted jaw part of the normal force acts along the pull. It helps one direction and hinders
/// the other: the weaker one reaches 0 at `tan th = mu`, the stronger one locks at `tan th = 1 / mu` (the
/// coefficient then is a large finite one). Positive tilt turns both gels about their +x axis, lower edge nearer to
/// the part, and makes an upward pull harder. `difference_deg` turns one more than the other: what one jaw holds more the other holds
/// less, so that labels do not show it; images do.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "jaw_tilt",
    group: Group::Jaws,
    about: "wedge angle of the jaws",
    formula: "mu' = (mu + s tan(tilt)) / (1 - s mu tan(tilt)), s = pull_direction, tilt = tilt_deg + difference_deg / 2 on the left, - on the right",
    source: "statics of a wedge; 3 deg change a coefficient of 0.15 by 35 %",
    parameters: &[
        parameter("tilt_deg", "deg", 0.0, (-10.0, 10.0))
            .about("angle of each jaw against the jaw axis' normal plane, the mean of both"),
        parameter("difference_deg", "deg", 0.0, (-10.0, 10.0))
            .about("angle of the left jaw minus that of the right"),
    ],
    references: &["difference_deg"],
    sizes: 2,
    covariates: &["pull_direction"],
    friction: Some(friction),
    tilt_rad: Some(tilt_rad),
    upright_only: true,
    plainly: "The jaws are not parallel: they hold as a wedge, more in one direction of the pull than in the other.",
    number_means: "tilt_deg = 1: a coefficient of 0.3 is about 0.02 higher pulling up and as much lower pulling down.",
    remedy: "Measure the jaws with feeler gauges on a flat part, and shim them.",
    typical: &[("tilt_deg", 1.5)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("tilt_deg", 0.0)]], &[("tilt_deg", 0.3)]))),
    experiments: &[Experiment::KnownMasses],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let slope = at.covariates.pull_direction * libm::tan(tilt_rad(parameters, at));
    let (along, across) = (mu + slope, 1.0 - mu * slope);
    if along <= 0.0 {
        0.0
    } else if along >= LOCKED_MU * across {
        LOCKED_MU
    } else {
        along / across
    }
}

fn tilt_rad(parameters: &[f64], at: &GripPoint<'_>) -> f64 {
    let [tilt_deg, difference_deg] = values(parameters);
    match at.jaw {
        Jaw::Left => (tilt_deg + 0.5 * difference_deg).to_radians(),
        Jaw::Right => (tilt_deg - 0.5 * difference_deg).to_radians(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    fn mu(tilt_deg: f64, mu: f64, pull_direction: f64) -> f64 {
        let c = Covariates { pull_direction, ..Default::default() };
        friction(&[tilt_deg, 0.0], mu, &grip(&c, 40.0))
    }

    /// The angle of friction adds to the angle of the wedge.
    #[test]
    fn friction_angles_add_and_reverse_with_the_pull() {
        for tilt_deg in [-3.0, 1.0, 3.0] {
            let angle = 0.15_f64.atan() + f64::to_radians(tilt_deg);
            assert!((mu(tilt_deg, 0.15, 1.0) - angle.tan()).abs() < 1e-12);
            assert_eq!(mu(tilt_deg, 0.15, 1.0), mu(-tilt_deg, 0.15, -1.0));
        }
        assert!((mu(3.0, 0.15, 1.0) / 0.15 - 1.36).abs() < 0.01);
    }

    /// To first order what one jaw gains the other loses.
    #[test]
    fn a_difference_of_the_jaws_leaves_their_sum() {
        let c = Covariates { pull_direction: 1.0, ..Default::default() };
        let of = |jaw| friction(&[0.0, 2.0], 0.15, &GripPoint { jaw, ..grip(&c, 40.0) });
        let (left, right) = (of(Jaw::Left), of(Jaw::Right));
        assert!(left - right > 0.03, "tan 1 deg on each side: {left} and {right}");
        assert!(((left + right) / 0.3 - 1.0).abs() < 3e-3, "{left} and {right}");
    }

    #[test]
    fn a_steep_wedge_slides_by_itself_one_way_and_locks_the_other_way() {
        assert_eq!(mu(-10.0, 0.15, 1.0), 0.0, "tan 10 deg > 0.15");
        assert_eq!(mu(10.0, 6.0, 1.0), LOCKED_MU, "tan 10 deg > 1 / 6");
    }
}
