//! A force sensor at the end of its range.

use super::hooks::{SensorMemory, SensorPoint, values};
use super::{EffectSpec, ParameterSpec};

/// No force here comes near it.
const NO_LIMIT_N: f64 = 1e6;

/// `sensor_saturation`: readings are clipped on both sides of the range.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_saturation",
    about: "measured force that stops at the end of the sensor's range",
    formula: "F_m = clamp(F, -limit_n, limit_n)",
    source: "UR5e data sheet: range 50 N",
    parameters: &[ParameterSpec {
        name: "limit_n",
        unit: "N",
        neutral: NO_LIMIT_N,
        bounds: (1.0, NO_LIMIT_N),
        about: "largest reading",
    }],
    sensor: Some(sensor),
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, _: &SensorPoint) -> f64 {
    let [limit_n] = values(parameters);
    true_n.clamp(-limit_n, limit_n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn readings_stop_at_the_limit_and_are_exact_inside() {
        let forces = [0.0, 49.999, 50.0, 50.001, 80.0, -80.0];
        let read = readings(sensor, &[50.0], &forces, 0.002);
        assert_eq!(read, [0.0, 49.999, 50.0, 50.0, 50.0, -50.0]);
    }
}
