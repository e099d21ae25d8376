//! A force sensor that is filtered.

use super::{
    EffectSpec, Experiment, FORCE_RATE, Fit, Group, PullFit, SensorMemory, SensorPoint, TableFit, Visible,
    log_spaced, parameter, values,
};

/// `sensor_lowpass`: first order, exact for a force that is constant over the step. Starts settled; the memory's
/// state is the reading before.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_lowpass",
    group: Group::Robot,
    about: "measured force behind a low-pass filter",
    formula: "tau_s dF_m/dt = F - F_m",
    source: "first-order filter; tau 5 to 50 ms",
    parameters: &[parameter("tau_s", "s", 0.0, (0.0, 2.0)).about("time constant")],
    sensor: Some(sensor),
    remembers: true,
    visible: Visible::From(0.02),
    plainly: "The force sensor follows late: fast changes are smoothed away.",
    number_means: "tau_s = 0.05: two thirds of a sudden change are seen after 50 ms.",
    remedy: "Give the sensor's filter a higher cut-off frequency, or pull more slowly.",
    typical: &[("tau_s", 0.1)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("tau_s", 0.03)], &[("tau_s", 0.15)]], &[("tau_s", 0.02)]))),
    table: Some(TableFit {
        acts_through: &[FORCE_RATE],
        grid: Some(|span| {
            let low_s = (0.3 * span.step_s).min(0.5);
            ("tau_s", log_spaced(low_s, (0.1 * span.longest_s).clamp(2.0 * low_s, 2.0), 14))
        }),
        ..TableFit::PLAIN
    }),
    experiments: &[Experiment::OtherPullRates, Experiment::LoadingAtTwoSpeeds],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, memory: &mut SensorMemory, at: &SensorPoint) -> f64 {
    let [tau_s] = values(parameters);
    if !memory.started || tau_s == 0.0 {
        memory.started = true;
        memory.state = true_n;
        return true_n;
    }
    memory.state -= libm::expm1(-at.step_s / tau_s) * (true_n - memory.state);
    memory.state
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn a_step_is_63_percent_there_after_tau() {
        let mut forces = vec![10.0; 101];
        forces[0] = 0.0;
        let read = readings(sensor, &[0.02], &forces, 0.002);
        assert_eq!(read[0], 0.0);
        assert!((read[10] - 6.321_205_588_3).abs() < 1e-9);
        assert!((read[100] - 10.0).abs() < 1e-3);
    }

    /// Behind a ramp the reading stays back by rate times tau, less half a step for the hold.
    #[test]
    fn a_ramp_is_late_by_tau() {
        let forces: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.01).collect();
        let read = readings(sensor, &[0.05], &forces, 0.001);
        let late_s = (forces[999] - read[999]) / 10.0;
        assert!((late_s - (0.05 - 0.0005)).abs() < 1e-5, "{late_s} s");
    }
}
