//! A force sensor whose gain wanders with the clock.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, SensorMemory, SensorPoint, TableFit, Visible, parameter,
    values, wider,
};

/// `sensor_gain_drift`: a gain that leaves 1 linearly from the start of the campaign on.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_gain_drift",
    group: Group::Robot,
    about: "factor on the measured force that changes with time",
    formula: "F_m = F (1 + rate_per_h t)",
    source: "first order of a drifting gain; warm-up of the sensor's electronics",
    parameters: &[parameter("rate_per_h", "1/h", 0.0, (-1.0, 1.0)).about("change of the gain in an hour")],
    covariates: &["time_s"],
    sensor: Some(sensor),
    reads_clock: true,
    visible: Visible::OverTheCampaign(0.02),
    plainly: "The scale of the force sensor changes with time.",
    number_means: "rate_per_h = 0.01: after an hour every force reads 1 % more than at the start.",
    remedy: "Let sensor and electronics warm up; check a known mass at the start and at the end of the day.",
    typical: &[("rate_per_h", 0.02)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("rate_per_h", 0.0)]], &[("rate_per_h", 0.02)]))),
    table: Some(TableFit {
        acts_through: &["time_s"],
        bounds: |span, own| wider(own, 0.9 / span.hours()),
        ..TableFit::PLAIN
    }),
    experiments: &[Experiment::LongPause, Experiment::ZeroAndLoadOverTime],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, at: &SensorPoint) -> f64 {
    let [rate_per_h] = values(parameters);
    true_n * (1.0 + rate_per_h * (at.clock_s / 3600.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn the_gain_moves_by_the_rate_every_hour_and_the_zero_stays() {
        assert_eq!(readings(sensor, &[-0.25], &[8.0, 8.0, 8.0, 0.0], 3600.0), [8.0, 6.0, 4.0, 0.0]);
    }
}
