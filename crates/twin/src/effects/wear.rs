//! A gel that wears from pull to pull.

use super::hooks::values;
use super::{EffectSpec, GripPoint, ParameterSpec};

/// `wear`: the coating loses friction at a rate that falls off, until `depth` of it is gone.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "wear",
    about: "friction coefficient that falls with the number of pulls",
    formula: "mu' = mu (1 - depth (1 - exp(-pull_index / n0)))",
    source: "saturating wear of the coating, n0 500 to 5000; GelSlim was tested for more than 3000 grasps",
    parameters: &[
        ParameterSpec {
            name: "depth",
            unit: "1",
            neutral: 0.0,
            bounds: (0.0, 0.9),
            about: "share of the coefficient that is lost in the end",
        },
        ParameterSpec {
            name: "n0",
            unit: "1",
            neutral: 1000.0,
            bounds: (5.0, 1e5),
            about: "pulls after which 63 % of it are lost",
        },
    ],
    covariates: &["pull_index"],
    friction: Some(friction),
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
