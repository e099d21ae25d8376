//! A camera that is out of focus.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `defocus`: a Gaussian blur of what the contact changes in the image. The rest frame is smooth and was taken with the
/// same lens: it stays as it is.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "defocus",
    group: Group::Optics,
    about: "blur of the contact in the image",
    formula: "dI' = dI * N(0, sigma_mm)",
    source: "Gaussian point spread function; sigma up to 3 px",
    parameters: &[parameter("sigma_mm", "mm", 0.0, (0.0, 0.6))
        .about("standard deviation of the point spread function, on the gel")],
    optics: Some(optics),
    plainly: "Contacts look blurred: the camera is out of focus.",
    number_means: "sigma_mm = 0.1: a point on the gel is smeared over about 0.2 mm.",
    remedy: "Focus the camera on the gel, and clean its window.",
    typical: &[("sigma_mm", 0.1)],
    presses: Some(PressFit { main: "sigma_mm", start: |_, px_mm| (1.5 * px_mm, px_mm), ..PressFit::DRAWN }),
    experiments: &[Experiment::AnotherShape],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [sigma_mm] = values(parameters);
    if sigma_mm != 0.0 {
        state.defocus_m = libm::hypot(state.defocus_m, sigma_mm * 1e-3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn variances_of_two_blurs_add() {
        let state = optics_after(optics, &[&[0.3], &[0.4]]);
        assert!((state.defocus_m - 5e-4).abs() < 1e-18);
    }
}
