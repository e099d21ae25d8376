//! Static friction that grows while the contact rests.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `dwell_ageing`: the real contact area creeps up with the logarithm of the time under load.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "dwell_ageing",
    group: Group::Friction,
    about: "friction coefficient with the logarithm of the dwell before the pull",
    formula: "mu' = mu (1 + beta ln(1 + t_dwell / t0_s))",
    source: "static ageing: 0.01 to 0.05 per e-fold of solids, up to 0.1 of polymers; Farain and Bonn",
    parameters: &[
        parameter("beta", "1", 0.0, (0.0, 0.2))
            .about("relative growth of the coefficient for e times the dwell"),
        parameter("t0_s", "s", 1.0, (0.001, 1000.0)).about("dwell from which on it grows with the logarithm"),
    ],
    references: &["t0_s"],
    covariates: &["dwell_s"],
    friction: Some(friction),
    per_part: true,
    plainly: "The longer the jaws rest on the part before the pull, the more they hold.",
    number_means: "beta = 0.02: ten times the dwell has a coefficient about 4.6 % higher.",
    remedy: "Wait equally long before every pull, or keep the law in the twin.",
    typical: &[("beta", 0.03)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("beta", 0.01)]], &[("beta", 0.01)]))),
    experiments: &[Experiment::DwellTimes],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [beta, t0_s] = values(parameters);
    mu * (1.0 + beta * libm::log1p(at.covariates.dwell_s / t0_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn a_decade_of_dwell_adds_the_same_once_it_is_long() {
        let mu = |dwell_s| {
            let c = Covariates { dwell_s, ..Default::default() };
            friction(&[0.03, 0.1], 0.2, &grip(&c, 40.0))
        };
        assert_eq!(mu(0.0), 0.2, "no dwell, no ageing");
        // 0.2 x 0.03 x ln 10 per decade
        assert!((mu(1000.0) - mu(100.0) - 0.013_815_51).abs() < 1e-5);
        // 0.2 x (1 + 0.03 ln 2) at the cut-off
        assert!((mu(0.1) - 0.204_158_883_08).abs() < 1e-11);
    }
}
