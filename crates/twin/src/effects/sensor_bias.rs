//! A force sensor with a wrong zero.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, SensorMemory, SensorPoint, Visible, parameter, values,
};

/// `sensor_bias`: a constant in every reading, without load too: a wrong zero, or a payload that the robot does
/// not know. It keeps its sign when the pull is reversed, so it raises the reading one way and lowers it the other.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_bias",
    group: Group::Robot,
    about: "constant added to the measured force",
    formula: "F_m = F + bias_n",
    source: "UR5e data sheet: accuracy 4 N; a payload of 0.1 kg that is not set is 1 N",
    parameters: &[parameter("bias_n", "N", 0.0, (-30.0, 30.0))
        .about("reading without load, along the sensor's axis (up)")],
    sensor: Some(sensor),
    upright_only: true,
    visible: Visible::From(0.05),
    plainly: "The force sensor reads the same number of newtons too much or too little at every force.",
    number_means: "bias_n = 1: with nothing on it the sensor reads 1 N.",
    remedy: "Zero the sensor without load before every pull, and set the payload of the gripper.",
    typical: &[("bias_n", 1.0)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("bias_n", 0.0)]], &[("bias_n", 0.2)]))),
    experiments: &[Experiment::NoLoadReading, Experiment::PullsUpAndDown],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, _: &SensorPoint) -> f64 {
    let [bias_n] = values(parameters);
    // -0 + 0 is not -0.
    if bias_n == 0.0 { true_n } else { true_n + bias_n }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::SensorChain;
    use crate::effects::testing::{readings, twin};

    #[test]
    fn the_bias_stands_at_zero_load_and_at_every_load() {
        assert_eq!(readings(sensor, &[1.5], &[0.0, 10.0, 40.0], 0.002), [1.5, 11.5, 41.5]);
    }

    #[test]
    fn reversing_the_pull_reverses_the_bias() {
        let twin = twin("[[effects]]\nname = \"sensor_bias\"\nbias_n = 1.5").unwrap();
        let mut up = SensorChain::new(&twin, "rod", SensorPoint::default()).along(1.0);
        let mut down = SensorChain::new(&twin, "rod", SensorPoint::default()).along(-1.0);
        assert_eq!((up.read(10.0, 0.0, 0.002), down.read(10.0, 0.0, 0.002)), (11.5, 8.5));
    }
}
