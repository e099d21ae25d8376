//! A colour model that is not 0 at zero slope.

use super::{EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit, parameter, values};
use crate::OpticsState;

/// `rest_offset`: one constant per channel, the value that the real sensor's colours have where the gel is flat but
/// something touches it elsewhere. It is there in the whole frame of an image with contact, and not in the rest frame.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "rest_offset",
    group: Group::Optics,
    about: "constant added to images with contact",
    formula: "I_c' = I_c + c with contact, c = red, green, blue",
    source: "colour tables have -5 to 6 grey levels at zero slope where there should be none (Taxim, Si and Yuan 2022)",
    parameters: &[level("red"), level("green"), level("blue")],
    optics: Some(optics),
    sizes: 3,
    plainly: "Pictures with contact are brighter or darker everywhere, the frame without contact is right.",
    number_means: "green = 3: every pixel of a picture with contact is 3 grey levels too green.",
    remedy: "Calibrate the colours with the frame without contact taken out: an offset at zero slope is the colour table's.",
    typical: &[("red", 3.0), ("green", 3.0), ("blue", 3.0)],
    presses: Some(PressFit { main: "green", start: |_, _| (0.0, 2.0), drawn: false, ..PressFit::DRAWN }),
    not_shown_by: &[Experiment::FrameWithoutContact, Experiment::FirstPressAgain],
    ..EffectSpec::BARE
};

const fn level(name: &'static str) -> ParameterSpec {
    let about = "value of the channel at zero slope";
    parameter(name, "grey levels", 0.0, (-60.0, 60.0)).about(about)
}

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let offsets: [f64; 3] = values(parameters);
    for (sum, offset) in state.rest_offset.iter_mut().zip(offsets) {
        *sum += offset;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn offsets_add_channel_by_channel() {
        let state = optics_after(optics, &[&[3.0, 0.0, -2.0], &[1.0, 5.0, 0.0]]);
        assert_eq!(state.rest_offset, [4.0, 5.0, -2.0]);
    }
}
