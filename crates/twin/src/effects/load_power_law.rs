//! A coefficient that falls, or rises, as a power of the load.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `load_power_law`: adhesive friction of constant shear stress is proportional to the contact area, which
/// grows with less than the load; `n = -1/3` for a Hertzian sphere.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "load_power_law",
    group: Group::Friction,
    about: "friction coefficient as a power of the grip force",
    formula: "mu' = mu (F_G / f_ref_n)^n",
    source: "Hertz contact with constant shear stress; Xydas and Kao 1999; Lyashenko and Popov 2024",
    parameters: &[
        parameter("n", "1", 0.0, (-0.9, 0.5)).about("exponent"),
        parameter("f_ref_n", "N", 40.0, (1.0, 500.0)).about("grip force at which the coefficient is mu"),
    ],
    references: &["f_ref_n"],
    covariates: &["grip_force_n"],
    friction: Some(friction),
    per_part: true,
    plainly: "The friction coefficient changes smoothly with the grip force, usually falling: a strong grip holds less than in proportion.",
    number_means: "n = -0.1: twice the grip force has a coefficient 7 % lower.",
    remedy: "Keep the law in the twin, and stay within the grip forces it was fitted on.",
    typical: &[("n", -0.15)],
    pulls: Ok(PullFit::of(|_| Fit::new(&[&[("n", 0.0)]], &[("n", 0.05)]))),
    experiments: &[Experiment::OtherPullRates, Experiment::WiderGripForces],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [n, f_ref_n] = values(parameters);
    mu * libm::pow(at.positive_force_n() / f_ref_n, n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    /// A sphere: eight times the load has four times the area, so half the coefficient.
    #[test]
    fn a_hertzian_sphere_halves_the_coefficient_at_eight_times_the_load() {
        let c = Covariates::default();
        let mu = |force_n| friction(&[-1.0 / 3.0, 40.0], 0.3, &grip(&c, force_n));
        assert!((mu(40.0) - 0.3).abs() < 1e-15);
        assert!((mu(80.0) / mu(10.0) - 0.5).abs() < 1e-12);
        // The friction force still rises with the load.
        assert!(80.0 * mu(80.0) > 5.0 * mu(5.0));
    }
}
