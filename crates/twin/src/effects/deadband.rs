//! A force loop that lets small errors be.

use super::{EffectSpec, Fit, Group, PullFit, parameter, values};

/// `deadband`: closer than the band to what it measures, the loop takes the measured force as its command and
/// so sees no error.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "deadband",
    group: Group::Robot,
    about: "force loop that ignores errors inside a band",
    formula: "F_cmd = F_measured where abs(F_des - F_measured) < width_n, else F_des",
    source: "dead band of force controllers, 0.5 to 3 N",
    parameters: &[
        parameter("width_n", "N", 0.0, (0.0, 5.0)).about("largest error that is ignored, on each side")
    ],
    command: Some(command),
    plainly: "The robot's force loop does nothing about small errors of the force.",
    number_means: "width_n = 1: an error of up to 1 N stays as it is.",
    remedy: "Pull in larger steps than the band, or narrow it in the controller.",
    typical: &[("width_n", 1.5)],
    pulls: Ok(PullFit {
        fit: |_| Fit::new(&[&[("width_n", 1.0)], &[("width_n", 2.0)]], &[("width_n", 0.2)]),
        flat_at_neutral: true,
        ..PullFit::PLAIN
    }),
    ..EffectSpec::BARE
};

fn command(parameters: &[f64], desired_n: f64, measured_n: f64) -> f64 {
    let [width_n] = values(parameters);
    if (desired_n - measured_n).abs() < width_n { measured_n } else { desired_n }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_inside_the_band_vanish_and_others_stay() {
        let error = |desired_n, measured_n| command(&[1.0], desired_n, measured_n) - measured_n;
        assert_eq!([error(10.0, 9.5), error(10.0, 10.5), error(10.0, 10.0)], [0.0; 3]);
        assert_eq!([error(10.0, 9.0), error(10.0, 8.0), error(10.0, 11.5)], [1.0, 2.0, -1.5]);
    }

    /// A first-order loop under a rising command stays back by about the band.
    #[test]
    fn a_rising_force_stays_back_by_the_band() {
        let mut force_n = 0.0;
        for i in 0..20_000 {
            let desired_n = f64::from(i) * 1e-3;
            force_n += 0.1 * (command(&[1.0], desired_n, force_n) - force_n);
        }
        assert!((19.999 - force_n - 1.0).abs() < 0.11, "{force_n}");
    }
}
