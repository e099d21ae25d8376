//! A camera with another exposure or response.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `exposure`: gain and gamma of the camera, the same for all channels, with and without contact. Two of them one after
/// the other are one.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "exposure",
    group: Group::Optics,
    about: "gain and gamma of the camera",
    formula: "I' = 255 (gain I / 255)^gamma",
    source: "power law of camera responses; gamma 0.8 to 1.2",
    parameters: &[
        parameter("gain", "1", 1.0, (0.3, 3.0)).about("exposure over that of the sensor file"),
        parameter("gamma", "1", 1.0, (0.4, 2.5)).about("exponent of the response"),
    ],
    optics: Some(optics),
    sizes: 2,
    plainly: "The camera's exposure or its curve is another one.",
    number_means: "gain = 1.1: the picture is exposed 10 % more; gamma below 1 brightens dark places.",
    remedy: "Fix exposure, gain and white balance of the camera, and take a new frame without contact.",
    typical: &[("gain", 1.1)],
    presses: Some(PressFit { main: "gain", start: |_, _| (1.0, 0.05), drawn: false, ..PressFit::DRAWN }),
    experiments: &[Experiment::FrameWithoutContact],
    not_shown_by: &[Experiment::FirstPressAgain],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [gain, gamma] = values(parameters);
    // (g2 (g1 x)^a)^b = (g2^(1/a) g1 x)^(a b)
    state.exposure_gain *= libm::pow(gain, 1.0 / state.gamma);
    state.gamma *= gamma;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn two_cameras_in_a_row_are_one() {
        let of = |list: &[&[f64]]| optics_after(optics, list);
        let seen = |s: &OpticsState, i: f64| 255.0 * (s.exposure_gain * i / 255.0).powf(s.gamma);
        let (first, second, both) = (of(&[&[0.9, 1.2]]), of(&[&[1.3, 0.8]]), of(&[&[0.9, 1.2], &[1.3, 0.8]]));
        for level in [3.0, 90.0, 200.0] {
            assert!((seen(&both, level) - seen(&second, seen(&first, level))).abs() < 1e-9);
        }
    }
}
