//! A constant part of the friction force: adhesion, or a force offset that looks like it.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `load_offset`: Wucherer et al. 2023 correct the simulated friction with `mu_corr = mu (a + b / F_G)`, that
/// is, with a friction force `mu a F_G + mu b`. Negative where `b < -a F_G`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "load_offset",
    group: Group::Friction,
    about: "friction force with a constant part",
    formula: "mu' = mu (a + b_n / F_G)",
    source: "Wucherer et al. 2023, correction of the friction coefficient and its table of fits",
    parameters: &[
        parameter("a", "1", 1.0, (0.2, 5.0)).about("factor on the friction coefficient at high grip force"),
        parameter("b_n", "N", 0.0, (-50.0, 50.0))
            .about("constant friction force per jaw, in units of the coefficient"),
    ],
    covariates: &["grip_force_n"],
    friction: Some(friction),
    per_part: true,
    sizes: 2,
    plainly: "Part of the friction force does not grow with the grip force, so light grips hold more (or less) than the coefficient says.",
    number_means: "a is the factor on the coefficient at strong grips; b_n is the constant force per jaw over mu, so with a = 1 friction is doubled at F_G = b_n.",
    remedy: "Keep the law in the twin. A gripper that presses less than it says looks the same: check the grip force with a load cell first.",
    typical: &[("b_n", 3.0)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("b_n", 0.0)]], &[("b_n", 1.0)]))),
    experiments: &[Experiment::GripForceWithALoadCell],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [a, b_n] = values(parameters);
    mu * (a + b_n / at.positive_force_n())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    /// The paper's table: mu, a, b [N] and the ratios that follow from it at 5, 20 and 80 N.
    #[test]
    fn ratios_of_the_papers_table() {
        for (mu, a, b, ratios) in [
            (0.14, 1.20, -4.34, [0.332, 0.983, 1.146]),
            (0.168, 1.05, -3.20, [0.41, 0.89, 1.01]),
            (0.15, 1.36, -12.15, [-1.07, 0.7525, 1.208]),
            (0.14, 1.10, 10.15, [3.13, 1.6075, 1.2269]),
        ] {
            for (force, ratio) in [5.0, 20.0, 80.0].into_iter().zip(ratios) {
                let corrected = friction(&[a, b], mu, &grip(&Covariates::default(), force));
                assert!((corrected / mu - ratio).abs() < 1e-3, "b = {b} at {force} N");
            }
        }
    }
}
