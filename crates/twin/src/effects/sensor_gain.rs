//! A force sensor with a wrong gain.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, SensorMemory, SensorPoint, Visible, parameter, values,
};

/// `sensor_gain`: every reading times a factor.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_gain",
    group: Group::Robot,
    about: "factor on the measured force",
    formula: "F_m = gain F",
    source: "0.95 to 1.05 is normal; Wucherer et al. 2023 found 0.709 in their simulation",
    parameters: &[parameter("gain", "1", 1.0, (0.3, 3.0)).about("measured over true force")],
    sensor: Some(sensor),
    visible: Visible::From(0.02),
    plainly: "The force sensor reads the same share too much or too little at every force.",
    number_means: "gain = 0.95: a true force of 100 N reads 95 N.",
    remedy: "Hang a known mass on the flange and set the sensor's scale.",
    typical: &[("gain", 0.95)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("gain", 1.0)]], &[("gain", 0.05)]))),
    experiments: &[Experiment::KnownMasses],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, _: &SensorPoint) -> f64 {
    let [gain] = values(parameters);
    gain * true_n
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn readings_are_proportional() {
        assert_eq!(readings(sensor, &[0.75], &[0.0, 8.0, -4.0], 0.002), [0.0, 6.0, -3.0]);
    }
}
