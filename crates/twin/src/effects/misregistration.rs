//! A contact that is seen elsewhere than it is thought to be.

use super::{
    EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit, PressNeeds, parameter, values,
};
use crate::Jaw;
use crate::OpticsState;

/// `misregistration`: the part lies displaced and turned between the jaws, or the camera has another pixel size or a
/// distortion that the sensor file does not know. What the contact changes in the image moves; the rest frame, which
/// that camera took, stays, unless the camera itself was moved since: `frame_moves` says how much of the way it goes
/// along. Both cameras look at one part from opposite sides: `shift_x_mm` and `rotation_deg` are those of the left image
/// and have the other sign in the right one.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "misregistration",
    group: Group::Optics,
    about: "contact displaced, turned, scaled or distorted in the image",
    formula: "at x is seen what lies at R(-rotation_deg) (1 + k1 r^2) (x - shift) / scale, r = abs(x - shift) in half image widths; in the frame at rest the same with shift and rotation_deg times frame_moves alone",
    source: "pose errors of 0.2 to 1 mm and 1 to 3 deg, which Wucherer et al. 2023 name; radial term: Brown 1966",
    parameters: &[
        length("shift_x_mm", "to the right in the left image, to the left in the right one"),
        length("shift_y_mm", "down in both images"),
        parameter("rotation_deg", "deg", 0.0, (-10.0, 10.0)).about("from right to down in the left image, against that in the right one"),
        parameter("scale", "1", 1.0, (0.8, 1.25)).about("pixel size of the sensor file over the true one"),
        parameter("k1", "1", 0.0, (-0.1, 0.1)).about("radial distortion half an image width from the middle, positive for a barrel"),
        parameter("frame_moves", "1", 0.0, (0.0, 1.0)).about("how much of the way the frame at rest moves along: 0 if the part lies elsewhere, 1 if the camera does"),
    ],
    optics: Some(optics),
    sizes: 5,
    plainly: "The contact stands elsewhere in the picture than it should: moved, turned, or at another scale.",
    number_means: "shift_x_mm = 0.5: the contact is seen 0.5 mm too far to the right in the left image.",
    remedy: "Measure the pose of sensor and part again; mark the contacts of a few presses.",
    typical: &[("shift_x_mm", 0.5)],
    presses: Some(PressFit {
        main: "shift_x_mm",
        start: |name, px_mm| match name {
            "shift_x_mm" | "shift_y_mm" => (0.0, px_mm),
            "rotation_deg" => (0.0, 1.0),
            "scale" => (1.0, 0.02),
            // Beside 0 and 1, between which the picture says.
            "frame_moves" => (0.5, 0.5),
            _ => (0.0, 0.02),
        },
        needs: PressNeeds::Marks,
        ..PressFit::DRAWN
    }),
    experiments: &[Experiment::PressesNearTheCorners],
    ..EffectSpec::BARE
};

const fn length(name: &'static str, about: &'static str) -> ParameterSpec {
    parameter(name, "mm", 0.0, (-3.0, 3.0)).about(about)
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let [shift_x_mm, shift_y_mm, rotation_deg, scale, k1, frame_moves] = values(parameters);
    let side = match at.jaw {
        Jaw::Left => 1.0,
        Jaw::Right => -1.0,
    };
    state.shift_m[0] += side * shift_x_mm * 1e-3;
    state.shift_m[1] += shift_y_mm * 1e-3;
    state.rotation_rad += side * rotation_deg.to_radians();
    state.scale *= scale;
    state.distortion_k1 += k1;
    // What goes nowhere takes nothing along.
    if [shift_x_mm, shift_y_mm, rotation_deg, scale - 1.0, k1] != [0.0; 5] {
        state.frame_moves = (state.frame_moves + frame_moves).min(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_cameras_see_one_displaced_part_from_both_sides() {
        let c = Covariates::default();
        let of = |jaw| {
            let mut state = OpticsState::default();
            optics(&[0.5, 0.25, 2.0, 1.01, 0.02, 1.0], &mut state, &GripPoint { jaw, ..grip(&c, 40.0) });
            state
        };
        let (left, right) = (of(Jaw::Left), of(Jaw::Right));
        assert_eq!((left.shift_m, right.shift_m), ([5e-4, 2.5e-4], [-5e-4, 2.5e-4]));
        assert_eq!(left.rotation_rad, -right.rotation_rad);
        assert_eq!((left.scale, left.distortion_k1), (right.scale, right.distortion_k1));
        assert_eq!((left.frame_moves, right.frame_moves), (1.0, 1.0));
    }
}
