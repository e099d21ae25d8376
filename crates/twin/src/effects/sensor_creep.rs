//! A force sensor that creeps under load.

use super::{
    EffectSpec, Experiment, FORCE_RATE, Fit, Group, PullFit, SensorMemory, SensorPoint, TableFit, Visible,
    log_spaced, parameter, values,
};

/// `sensor_creep`: part of the reading follows the force slowly. Starts settled; the memory's state is the slow
/// force.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_creep",
    group: Group::Robot,
    about: "measured force that goes on rising under constant load",
    formula: "F_m = F + fraction F_slow, tau_s dF_slow/dt = F - F_slow",
    source: "one term of viscoelastic creep of the sensor's body",
    parameters: &[
        parameter("fraction", "1", 0.0, (-0.6, 1.5))
            .about("creep in the end over the first reading of a load"),
        parameter("tau_s", "s", 10.0, (0.1, 3600.0)).about("time after which 63 % of it are there"),
    ],
    sensor: Some(sensor),
    remembers: true,
    visible: Visible::From(0.02),
    plainly: "The force sensor goes on rising under a load that stays the same, and forgets it slowly afterwards.",
    number_means: "fraction = 0.05: a load that stays ends up 5 % above its first reading, two thirds of it after tau_s.",
    remedy: "Unload the sensor between pulls for as long as it creeps, and zero it again.",
    typical: &[("fraction", 0.05)],
    pulls: Ok(PullFit {
        fit: |_| {
            let free = [("fraction", 0.03), ("tau_s", 1.0)];
            Fit::over("tau_s", &[1.0, 8.0], ("fraction", 0.05), &free)
        },
        // What comes late is a part of the response; one that goes back is a lag of another kind.
        bounds: |name, _, (low, high)| if name == "fraction" { (0.0, high) } else { (low, high) },
        ..PullFit::PLAIN
    }),
    table: Some(TableFit {
        acts_through: &["time_s", FORCE_RATE],
        grid: Some(|span| {
            let low_s = (1.5 * span.step_s).max(0.1);
            ("tau_s", log_spaced(low_s, span.longest_s.clamp(4.0 * low_s, 3600.0), 14))
        }),
        ..TableFit::PLAIN
    }),
    experiments: &[Experiment::ConstantLoad],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, memory: &mut SensorMemory, at: &SensorPoint) -> f64 {
    let [fraction, tau_s] = values(parameters);
    if !memory.started {
        memory.started = true;
        memory.state = true_n;
    }
    memory.state -= libm::expm1(-at.step_s / tau_s) * (true_n - memory.state);
    if fraction == 0.0 { true_n } else { true_n + fraction * memory.state }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    #[test]
    fn a_held_load_creeps_by_its_fraction_and_the_creep_stays_when_it_is_gone() {
        let mut forces = vec![20.0; 1101];
        forces[0] = 0.0;
        forces.push(0.0);
        let read = readings(sensor, &[0.05, 10.0], &forces, 0.1);
        assert!((read[1] - 20.0).abs() < 0.02, "at once the load itself: {}", read[1]);
        // 20 (1 + 0.05 (1 - 1/e)) after tau
        assert!((read[100] - 20.632_120_558_8).abs() < 1e-9);
        assert!((read[1100] - 21.0).abs() < 1e-3);
        assert!((read[1101] - 0.99).abs() < 1e-3, "1 N exp(-0.01): {}", read[1101]);
    }
}
