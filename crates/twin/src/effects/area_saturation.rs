//! A soft pad whose friction force stops growing with the load.

use super::hooks::values;
use super::{EffectSpec, GripPoint, ParameterSpec};

/// `area_saturation`: once the pad is in full contact, more load brings no more area. The parameter is the
/// inverse of the saturation force `F_s`, so that 0 means none; the friction force tends to `mu F_s`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "area_saturation",
    about: "friction force that levels off at high grip force",
    formula: "mu' = mu / (1 + saturation_per_n F_G)",
    source: "soft fingertips: Fujihira et al.; saturation force 50 to 200 N",
    parameters: &[ParameterSpec {
        name: "saturation_per_n",
        unit: "1/N",
        neutral: 0.0,
        bounds: (0.0, 0.1),
        about: "inverse of the grip force at which the coefficient has halved",
    }],
    covariates: &["grip_force_n"],
    friction: Some(friction),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [saturation_per_n] = values(parameters);
    mu / (1.0 + saturation_per_n * at.grip_force_n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_coefficient_halves_at_the_saturation_force_and_the_friction_force_levels_off() {
        let c = Covariates::default();
        let mu = |force_n| friction(&[0.01], 0.4, &grip(&c, force_n));
        assert!((mu(100.0) - 0.2).abs() < 1e-15);
        assert!((1e6 * mu(1e6) - 40.0).abs() < 0.01, "mu F_s = 40 N");
    }
}
