//! A press that is deeper, or less deep, than it is thought to be.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, PressNeeds, parameter, values};
use crate::OpticsState;

/// `press_depth`: zero and scale of the depth of the press are not those that the twin, or the stage of a calibration, believes.
/// The image shows the part pressed in so deep; forces and friction stay those of the twin, as all optics effects leave
/// them.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "press_depth",
    group: Group::Optics,
    about: "depth of the press that is seen",
    formula: "d' = factor d + offset_mm, at least 0; d = depth of the press",
    source: "depths seen in presses into a GelSight are 0.65 of those of the stage (Chen et al. 2022, its published presses), zeros of a stage 0.02 to 0.1 mm off",
    parameters: &[
        parameter("factor", "1", 1.0, (0.4, 2.0)).about("depth that is seen over the one that is believed"),
        parameter("offset_mm", "mm", 0.0, (-0.5, 0.5)).about("how much deeper the press is beyond that"),
    ],
    optics: Some(optics),
    sizes: 2,
    plainly: "Things are pressed in deeper, or less deep, than was written down.",
    number_means: "offset_mm = 0.1: contact began 0.1 mm before it was thought to; factor = 0.8: a fifth of each millimetre does not reach the gel.",
    remedy: "Find the first contact anew, from images in steps of 0.02 mm, and measure how much stage and gel give way.",
    typical: &[("offset_mm", 0.1)],
    presses: Some(PressFit {
        main: "offset_mm",
        start: |name, _| if name == "factor" { (1.0, 0.05) } else { (0.0, 0.02) },
        needs: PressNeeds::Depths,
        ..PressFit::DRAWN
    }),
    not_on_elastic_gel: Some("the depth of an elastic press follows from the force"),
    experiments: &[Experiment::PressesAtSeveralDepths],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [factor, offset_mm] = values(parameters);
    state.press_factor *= factor;
    state.press_offset_m = factor * state.press_offset_m + offset_mm * 1e-3;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn two_of_them_one_after_the_other_are_one() {
        let state = optics_after(optics, &[&[0.8, 0.1], &[1.5, -0.05]]);
        let depth_m = state.press_depth_m(0.5e-3);
        assert!((depth_m - (1.5 * (0.8 * 0.5e-3 + 0.1e-3) - 0.05e-3)).abs() < 1e-15);
        assert_eq!(OpticsState { press_offset_m: -1.0, ..state }.press_depth_m(0.5e-3), 0.0);
    }
}
