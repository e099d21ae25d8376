//! A gel that follows the part more or less closely than its kernels say.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `gel_kernel`: the sizes of the kernels that deform the gel around a contact, all by one factor. Between two odd
/// sizes the weights are interpolated.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "gel_kernel",
    group: Group::Optics,
    about: "smoothing length of the gel",
    formula: "k' = factor k for every kernel",
    source: "kernels that were not fitted to the gel are wrong by some 30 %; Si and Yuan 2022 on the kernels",
    parameters: &[
        parameter("factor", "1", 1.0, (0.5, 2.0)).about("true size of the kernels over that of the twin")
    ],
    optics: Some(optics),
    plainly: "The gel smooths a contact over a wider or narrower neighbourhood than the twin thinks.",
    number_means: "factor = 1.3: edges are smeared over a length 30 % larger.",
    remedy: "Calibrate the sensor with presses of this gel.",
    typical: &[("factor", 1.3)],
    not_on_elastic_gel: Some("scales the blurs of the gel, which an elastic gel does not have"),
    presses: Some(PressFit { main: "factor", start: |_, _| (1.0, 0.1), ..PressFit::DRAWN }),
    not_shown_by: &[Experiment::AnotherShape],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [factor] = values(parameters);
    state.kernel_scale *= factor;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn factors_multiply() {
        let state = optics_after(optics, &[&[1.5], &[0.5]]);
        assert_eq!(state.kernel_scale, 0.75);
    }
}
