//! A gripper that does not bring its command to the jaws.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `grip_force_loss`: drive friction takes a constant force. A gain of the drive is no parameter: friction
/// coefficient and imprint constant absorb it.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "grip_force_loss",
    group: Group::Jaws,
    about: "normal force below the commanded grip force",
    formula: "F_N = max(0, F_G - loss_n)",
    source: "friction and resolution of parallel grippers, 1 to 5 N",
    parameters: &[parameter("loss_n", "N", 0.0, (-10.0, 20.0)).about("force per jaw that the drive takes")],
    covariates: &["grip_force_n"],
    normal_force: Some(normal_force),
    plainly: "The jaws press less than the gripper was told to.",
    number_means: "loss_n = 2: of 20 N per jaw that were commanded 18 N arrive.",
    remedy: "Measure the grip force with a load cell between the jaws; grease or tare the drive.",
    typical: &[("loss_n", 2.0)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("loss_n", 0.0)]], &[("loss_n", 0.5)]))),
    experiments: &[Experiment::GripForceWithALoadCell],
    ..EffectSpec::BARE
};

fn normal_force(parameters: &[f64], force_n: f64, _: &GripPoint<'_>) -> f64 {
    let [loss_n] = values(parameters);
    (force_n - loss_n).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_same_force_is_lost_at_every_command_and_no_more_than_there_is() {
        let c = Covariates::default();
        let held = |force_n| normal_force(&[2.0], force_n, &grip(&c, force_n));
        assert_eq!([held(1.0), held(2.0), held(5.0), held(80.0)], [0.0, 0.0, 3.0, 78.0]);
    }
}
