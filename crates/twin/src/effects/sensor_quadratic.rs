//! A force sensor whose line is bent.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, REFERENCE_FORCE, SensorMemory, SensorPoint, TableFit,
    Visible, parameter, values, wider,
};

/// `sensor_quadratic`: the second term of the sensor's curve. A load cell bends the same way whatever the sign of the
/// force (an even term); one that is made of two springs may bend alike in both directions (an odd one). Only pulls in both
/// directions tell.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_quadratic",
    group: Group::Robot,
    about: "measured force with a quadratic term",
    formula: "F_m = F + quadratic_per_n F^2, with F abs(F) for F^2 where odd = 1",
    source: "non-linearity of load cells, 0.5 to 3 % of the range",
    parameters: &[
        parameter("quadratic_per_n", "1/N", 0.0, (-0.01, 0.01))
            .about("relative change of the gain for a newton"),
        parameter("odd", "1", 0.0, (0.0, 1.0))
            .about("1 where the line bends alike in both directions, 0 where it bends one way"),
    ],
    references: &["odd"],
    sensor: Some(sensor),
    visible: Visible::AtTheLargestForce(0.02),
    plainly: "The force sensor's line is bent: small forces read right, large ones too much or too little.",
    number_means: "quadratic_per_n = 0.0005: at 100 N the reading is 5 % too large.",
    remedy: "Load the sensor with five known masses over its range and store its curve.",
    typical: &[("quadratic_per_n", 0.0005)],
    pulls: Ok(PullFit {
        spans: &["grip_force_n"],
        fit: |span| {
            let odd: &[f64] = if (span.varies)("pull_direction") { &[0.0, 1.0] } else { &[0.0] };
            Fit::over("odd", odd, ("quadratic_per_n", 0.0), &[("quadratic_per_n", 0.001)])
        },
        ..PullFit::PLAIN
    }),
    table: Some(TableFit {
        acts_through: &[REFERENCE_FORCE],
        bounds: |span, own| wider(own, 0.9 / span.largest_n()),
        ..TableFit::PLAIN
    }),
    experiments: &[Experiment::KnownMasses, Experiment::KnownLoads],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, _: &SensorPoint) -> f64 {
    let [quadratic_per_n, odd] = values(parameters);
    true_n * (1.0 + quadratic_per_n * ((1.0 - odd) * true_n + odd * true_n.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn the_second_difference_is_constant_and_small_loads_read_right() {
        let forces: Vec<f64> = (0..9).map(|i| f64::from(i) * 5.0).collect();
        let read = readings(sensor, &[0.001, 0.0], &forces, 0.002);
        assert!((read[8] - 41.6).abs() < 1e-12, "40 + 0.001 x 1600");
        for three in read.windows(3) {
            // 2 q (5 N)^2
            assert!((three[2] - 2.0 * three[1] + three[0] - 0.05).abs() < 1e-12);
        }
    }

    #[test]
    fn an_odd_line_is_the_same_in_both_directions() {
        let read = |odd| readings(sensor, &[0.001, odd], &[-40.0, 40.0], 0.002);
        assert_eq!(read(0.0), [-38.4, 41.6]);
        assert_eq!(read(1.0), [-41.6, 41.6]);
    }
}
