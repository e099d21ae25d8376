//! A force loop that settles at a multiple of its command.

use super::{EffectSpec, Experiment, Fit, Group, PullFit, Visible, parameter, values};

/// `controller_gain`: the loop follows a share of the desired force.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "controller_gain",
    group: Group::Robot,
    about: "factor on the force that the force loop goes for",
    formula: "F_cmd = gain F_des",
    source: "UR5e set to 10 N gave 8.95 to 13.26 N over its workspace (Trochimczuk et al. 2026)",
    parameters: &[parameter("gain", "1", 1.0, (0.5, 1.5)).about("settled over desired force")],
    command: Some(command),
    visible: Visible::From(0.02),
    plainly: "The robot goes for a force that is the same share above or below the one it was told.",
    number_means: "gain = 0.95: where 100 N were asked for the robot pulls with 95 N.",
    remedy: "Compare the commanded with the measured force of a part that holds; check the payload and the force mode's damping.",
    typical: &[("gain", 0.95)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("gain", 1.0)]], &[("gain", 0.05)]))),
    experiments: &[Experiment::KnownMasses],
    ..EffectSpec::BARE
};

fn command(parameters: &[f64], desired_n: f64, _: f64) -> f64 {
    let [gain] = values(parameters);
    gain * desired_n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_between_desired_and_commanded_force_grows_with_the_force() {
        assert_eq!([10.0, 20.0, 40.0].map(|f| f - command(&[0.75], f, 3.0)), [2.5, 5.0, 10.0]);
    }
}
