//! Shadows that the gel around a contact throws.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `cast_shadow`: a channel's light, which comes from the side towards which its colour model is brightest, does not
/// reach the gel behind a contact. Outside the contact only: inside, the colours were measured with it. A negative
/// strength takes away from shadows that the sensor file draws.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "cast_shadow",
    group: Group::Optics,
    about: "darkening behind a contact, away from each channel's light",
    formula: "I_c' = I_c - strength I_c,rest s(max over d of (z(x + d l_c) - z(x)) / (d tan(elevation_deg)))",
    source: "horizon mapping, Max 1988; lights of GelSight sensors stand low: shadows of -10 to -75 grey levels in Taxim",
    parameters: &[
        parameter("strength", "1", 0.0, (-0.5, 1.0))
            .about("share of a channel's brightness that is missing in a full shadow"),
        parameter("elevation_deg", "deg", 30.0, (5.0, 60.0))
            .about("height of the lights above the gel; lower ones throw longer shadows"),
    ],
    optics: Some(optics),
    plainly: "Contacts throw shadows away from the lights that the twin does not draw.",
    number_means: "strength = 0.1: in a full shadow 10 % of the light's brightness are missing.",
    remedy: "Calibrate the shadows of the sensor with presses at several depths.",
    typical: &[("strength", 0.15)],
    presses: Some(PressFit {
        main: "strength",
        start: |name, _| if name == "strength" { (0.03, 0.05) } else { (20.0, 5.0) },
        ..PressFit::DRAWN
    }),
    experiments: &[Experiment::PressesAtSeveralDepths],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [strength, elevation_deg] = values(parameters);
    if strength != 0.0 {
        state.shadow_strength += strength;
        state.light_elevation_rad = elevation_deg.to_radians();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn without_strength_the_elevation_says_nothing() {
        assert_eq!(optics_after(optics, &[&[0.0, 10.0]]), OpticsState::default());
        let state = optics_after(optics, &[&[0.0, 10.0], &[0.3, 10.0]]);
        assert_eq!((state.shadow_strength, state.light_elevation_rad), (0.3, 10f64.to_radians()));
    }
}
