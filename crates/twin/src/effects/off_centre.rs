//! A grip beside the pull line: part of the friction holds the moment.

use super::{EffectSpec, Fit, GripPoint, Group, PullFit, parameter, values};

/// `off_centre`: a law of the offset alone, whatever the grip angle, for what the mechanics of the twin leave out. What a
/// grip that turns loses follows from the contact itself, with `robot.twist`. The two differ (an offset along the pull has
/// no lever there), and both act where both stand in a twin.
///
/// On the elliptic limit surface `(F / F0)^2 + (M / M0)^2 = 1` a force with the lever `x` slips at
/// `F0 / sqrt(1 + (x / m)^2)`, `m = M0 / F0`. The parameter is the inverse of `m`, so that 0 means no fall.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "off_centre",
    group: Group::Jaws,
    about: "friction that falls with the lever between grip and pull line",
    formula: "mu' = mu / sqrt(1 + (inverse_lever_per_mm grip_offset)^2)",
    source: "elliptic limit surface; m = 0.6 to 0.67 times the contact radius. Xydas and Kao 1999",
    parameters: &[parameter("inverse_lever_per_mm", "1/mm", 0.0, (0.0, 2.0))
        .about("inverse of the lever at which the friction has fallen to 71 %")],
    covariates: &["grip_offset_mm"],
    friction: Some(friction),
    plainly: "Grips beside the middle of the part hold less, because the pull also turns the part in the jaws.",
    number_means: "1 / inverse_lever_per_mm is the offset in mm at which 71 % of the friction are left.",
    remedy: "Grip in the middle, or compute the contact: a compliant twist needs no such law.",
    typical: &[("inverse_lever_per_mm", 0.08)],
    pulls: Ok(PullFit::of(|_| {
        Fit::new(
            &[&[("inverse_lever_per_mm", 0.04)], &[("inverse_lever_per_mm", 0.12)]],
            &[("inverse_lever_per_mm", 0.02)],
        )
    })),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [inverse_lever_per_mm] = values(parameters);
    let share = 1e3 * inverse_lever_per_mm * at.covariates.grip_offset_m;
    mu / (1.0 + share * share).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_limit_surface_is_met_at_every_lever_on_both_sides() {
        for offset_mm in [-12.0, -3.0, 0.0, 0.5, 4.0, 20.0] {
            let c = Covariates { grip_offset_m: offset_mm * 1e-3, ..Default::default() };
            // F0 = 1 and M0 = 4 mm.
            let force = friction(&[0.25], 1.0, &grip(&c, 40.0));
            let moment = force * offset_mm;
            assert!((force.powi(2) + (moment / 4.0).powi(2) - 1.0).abs() < 1e-12, "{offset_mm} mm");
        }
    }
}
