//! A force sensor at the end of its range.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, REFERENCE_FORCE, SensorMemory, SensorPoint, TableFit,
    parameter, values,
};

/// No force here comes near it.
const NO_LIMIT_N: f64 = 1e6;

/// `sensor_saturation`: readings are clipped on both sides of the range.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_saturation",
    group: Group::Robot,
    about: "measured force that stops at the end of the sensor's range",
    formula: "F_m = clamp(F, -limit_n, limit_n)",
    source: "UR5e data sheet: range 50 N",
    parameters: &[parameter("limit_n", "N", NO_LIMIT_N, (1.0, NO_LIMIT_N)).about("largest reading")],
    sensor: Some(sensor),
    plainly: "The force sensor stops at the end of its range: whatever is larger reads the same.",
    number_means: "limit_n = 50: no force reads more than 50 N.",
    remedy: "Keep pulls below the limit, or use a sensor with a larger range; labels at the limit are lower bounds.",
    typical: &[("limit_n", 20.0)],
    pulls: Ok(PullFit {
        fit: |span| {
            let max_n = span.largest_reading_n;
            Fit::new(
                &[&[("limit_n", 0.7 * max_n)], &[("limit_n", 0.95 * max_n)]],
                &[("limit_n", 0.03 * max_n)],
            )
        },
        flat_at_neutral: true,
        ..PullFit::PLAIN
    }),
    table: Some(TableFit {
        acts_through: &[REFERENCE_FORCE],
        grid: Some(|span| {
            let limit_n = |k: u32| span.largest_n() * (0.4 + 0.599 * f64::from(k) / 23.0);
            ("limit_n", (0..24).map(limit_n).collect())
        }),
        bounds: |span, (low, _)| (low.min(0.2 * span.largest_n()), span.largest_n()),
    }),
    experiments: &[Experiment::KnownMasses, Experiment::KnownLoads],
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
