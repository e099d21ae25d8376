//! A force sensor whose zero wanders with the clock.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, SensorMemory, SensorPoint, TableFit, Visible, parameter,
    values, wider,
};

/// `sensor_drift`: a bias that grows linearly from 0 at the start of the campaign.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_drift",
    group: Group::Robot,
    about: "constant added to the measured force that grows with time",
    formula: "F_m = F + rate_n_per_h t",
    source: "0.1 to 3 N/h; 26 N from temperature alone in small sensors without compensation (arXiv 2502.17528)",
    parameters: &[parameter("rate_n_per_h", "N/h", 0.0, (-30.0, 30.0))
        .about("change of the reading without load in an hour, along the sensor's axis (up)")],
    covariates: &["time_s"],
    sensor: Some(sensor),
    reads_clock: true,
    upright_only: true,
    visible: Visible::OverTheCampaign(0.05),
    plainly: "The zero of the force sensor moves with time.",
    number_means: "rate_n_per_h = 1: after an hour the sensor reads 1 N more than at the start.",
    remedy: "Zero the sensor before every pull; let it warm up.",
    typical: &[("rate_n_per_h", 0.5)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("rate_n_per_h", 0.0)]], &[("rate_n_per_h", 0.2)]))),
    table: Some(TableFit {
        acts_through: &["time_s"],
        bounds: |span, own| wider(own, (span.highest_n - span.lowest_n) / span.hours()),
        ..TableFit::PLAIN
    }), // A drift that is not straight looks like a straight one from another start.
    leaves: &["sensor_bias"],
    experiments: &[
        Experiment::NoLoadReading,
        Experiment::PullsUpAndDown,
        Experiment::LongPause,
        Experiment::ZeroAndLoadOverTime,
    ],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, at: &SensorPoint) -> f64 {
    let [rate_n_per_h] = values(parameters);
    // -0 + 0 is not -0.
    if rate_n_per_h == 0.0 { true_n } else { true_n + rate_n_per_h * (at.clock_s / 3600.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn the_zero_moves_by_the_rate_every_hour_whatever_the_load() {
        assert_eq!(readings(sensor, &[0.5], &[0.0, 0.0, 10.0, 30.0], 3600.0), [0.0, 0.5, 11.0, 31.5]);
    }
}
