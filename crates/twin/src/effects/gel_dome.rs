//! A gel that is more or less domed than its sensor file says.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `gel_dome`: a paraboloid is added to the gel's shape at rest. The imprint has the same volume on another surface: a
/// domed gel is touched nearer to its apex, in the middle of the image, and deeper there.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "gel_dome",
    group: Group::Optics,
    about: "sag of the gel at the corners of the image",
    formula: "z_rest' = z_rest - sag_mm r^2 / r_corner^2, towards the part",
    source: "GelSight gels are domed: 1.4 mm in Taxim's gel map (Si and Yuan 2022); paraboloid for the cap is ours",
    parameters: &[
        parameter("sag_mm", "mm", 0.0, (-2.0, 3.0)).about("how much deeper the corners lie below the apex")
    ],
    optics: Some(optics),
    plainly: "The gel is domed: it lies deeper at the corners than in the middle.",
    number_means: "sag_mm = 0.5: the corners lie 0.5 mm deeper than the sensor file says.",
    remedy: "Measure the gel at rest, or calibrate with presses near all corners.",
    typical: &[("sag_mm", 0.5)],
    presses: Some(PressFit { main: "sag_mm", start: |_, _| (0.0, 0.3), ..PressFit::DRAWN }),
    experiments: &[Experiment::PressesNearTheCorners],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [sag_mm] = values(parameters);
    state.dome_sag_m += sag_mm * 1e-3;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn sags_add() {
        let state = optics_after(optics, &[&[1.0], &[-0.5]]);
        assert!((state.dome_sag_m - 0.5e-3).abs() < 1e-18 && state.changes_press());
    }
}
