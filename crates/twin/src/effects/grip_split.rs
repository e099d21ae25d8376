//! Jaws that do not press alike.

use super::{EffectSpec, GripPoint, Group, parameter, values};
use crate::Jaw;

/// `grip_split`: one jaw presses harder than the other and the fixture takes the difference. The sum is that of the command.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "grip_split",
    group: Group::Jaws,
    about: "normal forces that differ between the jaws",
    formula: "F_left = F_G (1 + split), F_right = F_G (1 - split)",
    source: "equilibrium of a fixed part: the fixture takes 2 split F_G; 10 % is our estimate for coupled jaws",
    parameters: &[
        parameter("split", "1", 0.0, (-0.8, 0.8)).about("half of the relative difference, left minus right")
    ],
    covariates: &["grip_force_n"],
    normal_force: Some(normal_force),
    plainly: "One jaw presses harder than the other, and the fixture of the part takes the difference.",
    number_means: "split = 0.1: at 20 N per jaw the left jaw presses with 22 N, the right one with 18 N.",
    remedy: "Centre the part between the jaws, or mount it so that it can move along them.",
    typical: &[("split", 0.1)],
    pulls: Err("the jaws hold the sum of both forces, which it leaves as it is"),
    ..EffectSpec::BARE
};

fn normal_force(parameters: &[f64], force_n: f64, at: &GripPoint<'_>) -> f64 {
    let [split] = values(parameters);
    match at.jaw {
        Jaw::Left => force_n * (1.0 + split),
        Jaw::Right => force_n * (1.0 - split),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::grip;
    use crate::{Covariates, PerJaw};

    #[test]
    fn the_jaws_differ_and_keep_their_sum() {
        let c = Covariates::default();
        let of = PerJaw::from_fn(|jaw| normal_force(&[0.15], 20.0, &GripPoint { jaw, ..grip(&c, 20.0) }));
        assert!((of.left - 23.0).abs() < 1e-12 && (of.left + of.right - 40.0).abs() < 1e-12);
        assert_eq!(normal_force(&[0.0], 20.0, &grip(&c, 20.0)), 20.0);
    }
}
