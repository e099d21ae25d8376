//! A coefficient that depends on how fast the force rises.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// Slowest pull the logarithm is taken at.
const SLOWEST_N_PER_S: f64 = 1e-3;

/// `rate_dependence`: thermally activated bonds hold more when they have less time to break, in proportion to
/// the logarithm of the rate.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "rate_dependence",
    group: Group::Friction,
    about: "friction coefficient with the logarithm of the pull rate",
    formula: "mu' = mu (1 + k ln(r / r0_n_per_s)), r = force increment / step time",
    source: "Juvekar and Singh, gel on glass; break-away ratio with force rate: Song et al. 2013",
    parameters: &[
        parameter("k", "1", 0.0, (-0.1, 0.3))
            .about("relative change of the coefficient for e times the rate"),
        parameter("r0_n_per_s", "N/s", 10.0, (0.01, 1000.0))
            .about("pull rate at which the coefficient is mu; a step of 1 N every 0.104 s is 9.6 N/s"),
    ],
    references: &["r0_n_per_s"],
    covariates: &["force_increment_n", "step_time_s"],
    friction: Some(friction),
    per_part: true,
    plainly: "Friction depends on how fast the pull rises.",
    number_means: "k = 0.02: ten times the rate has a coefficient 4.6 % higher.",
    remedy: "Pull at the rate of the application, or keep the law in the twin.",
    typical: &[("k", 0.04)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("k", 0.0)]], &[("k", 0.02)]))),
    experiments: &[Experiment::OtherPullRates],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [k, r0_n_per_s] = values(parameters);
    mu * (1.0 + k * libm::log(at.pull_rate_n_per_s.max(SLOWEST_N_PER_S) / r0_n_per_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn every_tenfold_of_the_rate_adds_the_same() {
        let c = Covariates::default();
        let mu = |pull_rate_n_per_s| {
            friction(&[0.05, 10.0], 0.2, &GripPoint { pull_rate_n_per_s, ..grip(&c, 40.0) })
        };
        assert_eq!(mu(10.0), 0.2);
        // 0.2 x 0.05 x ln 10
        assert!((mu(100.0) - mu(10.0) - 0.023_025_850_93).abs() < 1e-12);
        assert!((mu(10.0) - mu(1.0) - 0.023_025_850_93).abs() < 1e-12);
        assert!(mu(0.0).is_finite());
    }
}
