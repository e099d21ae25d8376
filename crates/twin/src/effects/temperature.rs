//! A gel whose friction changes as it warms.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `temperature`: friction of elastomers falls with temperature, here by the same share for each kelvin.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "temperature",
    group: Group::Friction,
    about: "friction coefficient that falls with the temperature of the gel",
    formula: "mu' = mu exp(-k_per_k (T - t0_c))",
    source: "Arrhenius law over a small range; 0.5 to 3 % per kelvin",
    parameters: &[
        parameter("k_per_k", "1/K", 0.0, (-0.05, 0.1)).about("relative fall of the coefficient for a kelvin"),
        parameter("t0_c", "degC", 23.0, (-20.0, 80.0)).about("temperature at which the coefficient is mu"),
    ],
    references: &["t0_c"],
    covariates: &["temperature_c"],
    friction: Some(friction),
    per_part: true,
    plainly: "Friction changes with the temperature of the gel.",
    number_means: "k_per_k = 0.01: a gel that is 1 K warmer has a coefficient 1 % lower.",
    remedy: "Record the temperature with every pull, let lights and robot warm up first, and keep the law in the twin.",
    typical: &[("k_per_k", 0.01)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("k_per_k", 0.0)]], &[("k_per_k", 0.005)]))),
    experiments: &[Experiment::LongPause],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [k_per_k, t0_c] = values(parameters);
    mu * libm::exp(-k_per_k * (at.covariates.temperature_c - t0_c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_logarithm_falls_with_a_straight_line() {
        let mu = |temperature_c| {
            let c = Covariates { temperature_c, ..Default::default() };
            friction(&[0.02, 23.0], 0.3, &grip(&c, 40.0))
        };
        assert_eq!(mu(23.0), 0.3);
        // exp(-0.02 x 10)
        assert!((mu(33.0) / mu(23.0) - 0.818_730_753_08).abs() < 1e-11);
        assert!((mu(13.0) * mu(33.0) - 0.09).abs() < 1e-12, "symmetric about the reference in the logarithm");
    }
}
