//! A new gel that takes a few cycles to settle.

use super::hooks::values;
use super::{EffectSpec, GripPoint, ParameterSpec};

/// `conditioning`: silicone softens in its first cycles (Mullins effect), so that the contact grows and friction
/// rises to its settled value. It rises only: a fall with the same shape would be `wear` under another name.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "conditioning",
    about: "friction coefficient that is low in the first pulls of a gel",
    formula: "mu' = mu (1 - depth exp(-pull_index / n0))",
    source: "Mullins softening, 5 to 30 % in the first cycle, over in 3 to 10",
    parameters: &[
        ParameterSpec {
            name: "depth",
            unit: "1",
            neutral: 0.0,
            bounds: (0.0, 0.6),
            about: "share of the settled coefficient that the first pull lacks",
        },
        ParameterSpec {
            name: "n0",
            unit: "1",
            neutral: 5.0,
            bounds: (0.5, 100.0),
            about: "pulls after which 63 % of that are there",
        },
    ],
    covariates: &["pull_index"],
    friction: Some(friction),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [depth, n0] = values(parameters);
    mu * (1.0 - depth * libm::exp(-(at.covariates.pull_index as f64) / n0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_first_pull_lacks_depth_and_each_pull_the_same_share_of_what_is_left() {
        let lacks = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            1.0 - friction(&[0.2, 4.0], 0.3, &grip(&c, 40.0)) / 0.3
        };
        assert!((lacks(0) - 0.2).abs() < 1e-12);
        assert!((lacks(4) - 0.2 * 0.367_879_441_17).abs() < 1e-12);
        for n in 0..10 {
            assert!((lacks(n + 1) / lacks(n) - 0.778_800_783_07).abs() < 1e-9, "exp(-1/4)");
        }
    }
}
