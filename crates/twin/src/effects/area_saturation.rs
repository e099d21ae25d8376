//! A soft pad whose friction force stops growing with the load.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `area_saturation`: once the pad is in full contact, more load brings no more area. The parameter is the
/// inverse of the saturation force `F_s`, so that 0 means none; the friction force tends to `mu F_s`. How suddenly it
/// levels off is not known: a sharpness of 1 is the rational law, 2.5 lies within 3 % of a hyperbolic tangent.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "area_saturation",
    group: Group::Friction,
    about: "friction force that levels off at high grip force",
    formula: "mu' = mu / (1 + (saturation_per_n F_G)^sharpness)^(1 / sharpness)",
    source: "soft fingertips: Fujihira et al.; saturation force 50 to 200 N",
    parameters: &[
        parameter("saturation_per_n", "1/N", 0.0, (0.0, 0.1))
            .about("inverse of the grip force that friction behaves as if it had at most"),
        parameter("sharpness", "1", 1.0, (1.0, 6.0)).about("how suddenly it levels off"),
    ],
    covariates: &["grip_force_n"],
    references: &["sharpness"],
    friction: Some(friction),
    per_part: true,
    plainly: "Friction stops growing at strong grips, for example because the contact cannot get any larger.",
    number_means: "Friction never exceeds what 1 / saturation_per_n would hold at the plain coefficient: 0.005 stands for 200 N, where half of that is held (sharpness 1).",
    remedy: "Keep the law in the twin. Gripping harder brings less and less.",
    typical: &[("saturation_per_n", 0.006)],
    pulls: Ok(PullFit::of(|_| {
        let free = [("saturation_per_n", 0.002)];
        Fit::over("sharpness", &[1.0, 2.5], ("saturation_per_n", 0.004), &free).searching(1)
    })),
    experiments: &[Experiment::WiderGripForces],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [saturation_per_n, sharpness] = values(parameters);
    let share = saturation_per_n * at.grip_force_n;
    if sharpness == 1.0 {
        return mu / (1.0 + share);
    }
    mu * libm::pow(1.0 + libm::pow(share, sharpness), -1.0 / sharpness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_coefficient_halves_at_the_saturation_force_and_the_friction_force_levels_off() {
        let c = Covariates::default();
        let mu = |force_n| friction(&[0.01, 1.0], 0.4, &grip(&c, force_n));
        assert!((mu(100.0) - 0.2).abs() < 1e-15);
        assert!((1e6 * mu(1e6) - 40.0).abs() < 0.01, "mu F_s = 40 N");
    }

    /// F tanh(F_s / F) is the other common law: within 3 % of a sharpness of 2.5, which also tends to mu F_s.
    #[test]
    fn a_sharper_law_is_nearly_a_hyperbolic_tangent() {
        let c = Covariates::default();
        for force_n in [1.0, 20.0, 50.0, 80.0, 120.0, 300.0] {
            let share: f64 = 0.02 * force_n;
            let tanh = 0.4 * share.tanh() / share;
            let own = friction(&[0.02, 2.5], 0.4, &grip(&c, force_n));
            assert!((own / tanh - 1.0).abs() < 0.03, "{force_n} N: {own} {tanh}");
        }
        assert_eq!(friction(&[0.0, 2.5], 0.4, &grip(&c, 40.0)), 0.4);
    }
}
