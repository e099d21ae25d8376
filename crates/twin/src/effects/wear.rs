//! A gel that wears from pull to pull.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `wear`: the coating loses friction at a rate that falls off, until `depth` of it is gone.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "wear",
    group: Group::Friction,
    about: "friction coefficient that falls with the number of pulls",
    formula: "mu' = mu (1 - depth (1 - exp(-pull_index / n0)))",
    source: "saturating wear of the coating, n0 500 to 5000; GelSlim was tested for more than 3000 grasps",
    parameters: &[
        parameter("depth", "1", 0.0, (0.0, 0.9)).about("share of the coefficient that is lost in the end"),
        parameter("n0", "1", 1000.0, (5.0, 1e5)).about("pulls after which 63 % of it are lost"),
    ],
    covariates: &["pull_index"],
    friction: Some(friction),
    plainly: "Friction falls slowly from pull to pull, because the coating wears.",
    number_means: "depth = 0.1: 10 % of the coefficient are lost in the end, two thirds of it after n0 pulls.",
    remedy: "Compare with a new gel; plan pulls in random order so that wear is not taken for something else.",
    typical: &[("depth", 0.2), ("n0", 150.0)],
    pulls: Ok(PullFit::of(|span| {
        let last = span.last_pull_index;
        let free = [("depth", 0.05), ("n0", 0.3 * last)];
        Fit::over("n0", &[0.1 * last, 0.5 * last, 3.0 * last], ("depth", 0.1), &free)
    })),
    experiments: &[Experiment::LongPause],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [depth, n0] = values(parameters);
    mu * (1.0 + depth * libm::expm1(-(at.covariates.pull_index as f64) / n0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn after_n0_pulls_depth_times_one_minus_one_over_e_is_lost() {
        let mu = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            friction(&[0.22, 500.0], 0.2, &grip(&c, 40.0))
        };
        assert_eq!(mu(0), 0.2);
        assert!((1.0 - mu(500) / 0.2 - 0.22 * 0.632_120_558_83).abs() < 1e-11);
        assert!((mu(1_000_000) - 0.2 * 0.78).abs() < 1e-12);
        assert!((0..1000).all(|n| mu(n + 1) < mu(n)));
    }
}
