//! Friction that depends on the direction of the pull on the part.

use super::{EffectSpec, Fit, GripPoint, Group, PullFit, parameter, values};

/// `anisotropy`: a ground, turned or toothed surface has a lay; friction across it differs from friction along
/// it, and is the same after half a turn.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "anisotropy",
    group: Group::Friction,
    about: "friction coefficient with the angle of the grip, the same every half turn",
    formula: "mu' = mu (1 + amplitude cos(2 (grip_angle - axis_deg)))",
    source: "two-fold term of the angle; amplitude 0.05 to 0.3. Ma and Rodriguez 2018 on anisotropy in data",
    parameters: &[
        parameter("amplitude", "1", 0.0, (0.0, 0.6))
            .about("half of the relative difference between the two main directions"),
        parameter("axis_deg", "deg", 0.0, (-90.0, 90.0)).about("grip angle of the highest friction"),
    ],
    covariates: &["grip_angle_deg"],
    friction: Some(friction),
    upright_only: true,
    per_part: true,
    plainly: "The surface holds more along one direction than across it.",
    number_means: "amplitude = 0.1: 10 % more than the mean along axis_deg, 10 % less at a right angle to it.",
    remedy: "Look for a lay of machining on the part or a weave of the gel's coating; keep the law in the twin.",
    typical: &[("amplitude", 0.15)],
    pulls: Ok(PullFit::of(|_| {
        let free = [("amplitude", 0.05), ("axis_deg", 10.0)];
        Fit::over("axis_deg", &[-67.5, -22.5, 22.5, 67.5], ("amplitude", 0.08), &free)
    })),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [amplitude, axis_deg] = values(parameters);
    mu * (1.0 + amplitude * libm::cos(2.0 * (at.covariates.grip_angle_rad - axis_deg.to_radians())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn friction_is_highest_along_the_axis_and_lowest_across_it() {
        let mu = |angle_deg: f64| {
            let c = Covariates { grip_angle_rad: angle_deg.to_radians(), ..Default::default() };
            friction(&[0.2, 30.0], 0.5, &grip(&c, 40.0))
        };
        for (angle_deg, expected) in [(30.0, 0.6), (120.0, 0.4), (75.0, 0.5), (0.0, 0.55), (210.0, 0.6)] {
            assert!((mu(angle_deg) - expected).abs() < 1e-12, "{angle_deg} deg: {}", mu(angle_deg));
        }
    }
}
