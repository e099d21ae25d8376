//! A force sensor that reads less on the way up than on the way down.

use super::{
    EffectSpec, Experiment, FORCE_RATE, Fit, Group, PullFit, SensorMemory, SensorPoint, TableFit, Visible,
    log_spaced, parameter, values,
};

/// `sensor_hysteresis`: a Bouc-Wen loop (exponent 1, beta = gamma), integrated exactly over each step. Its state
/// tends to +1 while the force rises and to -1 while it falls, over `force_scale_n`, whatever the speed. A sensor
/// starts without history.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "sensor_hysteresis",
    group: Group::Robot,
    about: "measured force that lags behind the direction of change",
    formula: "F_m = F - amplitude_n z, dz = (sign(dF) - z) abs(dF) / force_scale_n",
    source: "Bouc-Wen model; 0.5 to 3 % of the range",
    parameters: &[
        parameter("amplitude_n", "N", 0.0, (0.0, 10.0)).about("half of the difference between the branches"),
        parameter("force_scale_n", "N", 10.0, (0.1, 100.0))
            .about("change of force after which 63 % of a branch are reached"),
    ],
    sensor: Some(sensor),
    remembers: true,
    visible: Visible::From(0.05),
    plainly: "The force sensor reads less while the force rises than while it falls.",
    number_means: "amplitude_n = 0.5: rising and falling readings of one force differ by 1 N.",
    remedy: "Approach every force from the same side, or load the sensor fully once before it is used.",
    typical: &[("amplitude_n", 0.5)],
    pulls: Ok(PullFit::of(|_| {
        let free = [("amplitude_n", 0.3), ("force_scale_n", 3.0)];
        Fit::over("force_scale_n", &[3.0, 15.0], ("amplitude_n", 0.3), &free)
    })),
    table: Some(TableFit {
        acts_through: &[FORCE_RATE],
        grid: Some(|span| {
            let range_n = span.highest_n - span.lowest_n;
            let low_n = (0.01 * range_n).max(0.1);
            ("force_scale_n", log_spaced(low_n, range_n.clamp(2.0 * low_n, 100.0), 8))
        }),
        ..TableFit::PLAIN
    }),
    experiments: &[Experiment::LoadingAtTwoSpeeds],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, memory: &mut SensorMemory, _: &SensorPoint) -> f64 {
    let [amplitude_n, force_scale_n] = values(parameters);
    let change_n = if memory.started { true_n - memory.previous_n } else { 0.0 };
    if change_n != 0.0 {
        let branch = change_n.signum();
        memory.state = branch + (memory.state - branch) * libm::exp(-change_n.abs() / force_scale_n);
    }
    memory.started = true;
    memory.previous_n = true_n;
    if amplitude_n == 0.0 { true_n } else { true_n - amplitude_n * memory.state }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::readings;

    /// 0 to `top_n` and back, twice, in `steps` steps a branch.
    fn cycles(top_n: f64, steps: usize) -> Vec<f64> {
        let up = (0..steps).map(|i| i as f64 / steps as f64 * top_n);
        let cycle: Vec<f64> = up.clone().chain(up.map(|f| top_n - f)).collect();
        [&cycle[..], &cycle[..], &[0.0]].concat()
    }

    /// Area of the second loop: true force over reading.
    fn area(parameters: &[f64], top_n: f64) -> f64 {
        let forces = cycles(top_n, 2000);
        let read = readings(sensor, parameters, &forces, 0.002);
        (4000..8000).map(|i| (read[i] + read[i + 1]) / 2.0 * (forces[i] - forces[i + 1])).sum()
    }

    #[test]
    fn the_loop_grows_with_amplitude_and_range() {
        assert!((area(&[0.0, 2.0], 40.0)).abs() < 1e-9);
        assert!(area(&[0.5, 2.0], 40.0) > 1.0);
        assert!((area(&[1.0, 2.0], 40.0) / area(&[0.5, 2.0], 40.0) - 2.0).abs() < 1e-9);
        assert!(area(&[0.5, 2.0], 60.0) > area(&[0.5, 2.0], 40.0));
        // Two branches 2 x 0.5 N apart over 40 N, less the turns.
        let turns = 2.0 * 0.5 * 2.0 * 2.0;
        assert!((area(&[0.5, 2.0], 40.0) - (40.0 - turns)).abs() < 0.1);
    }

    /// The reading depends on where the force turned, not on how finely it was sampled.
    #[test]
    fn sampling_does_not_matter() {
        let ends = |steps| {
            let read = readings(sensor, &[0.5, 5.0], &cycles(30.0, steps), 0.002);
            [read[steps], read[2 * steps], read[4 * steps]]
        };
        for (fine, coarse) in ends(1000).into_iter().zip(ends(3)) {
            assert!((fine - coarse).abs() < 1e-9, "{fine} against {coarse}");
        }
        // The first rise is exponential: 30 - 0.5 (1 - exp(-6)).
        assert!((ends(1)[0] - 29.501_239_376).abs() < 1e-8);
    }
}
