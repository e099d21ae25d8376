//! A background that is another one from one pull on.

use super::hooks::values;
use super::{EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit};
use crate::OpticsState;
use crate::optics::BACKGROUND_TERMS;

/// `background_change`: a smooth pattern is added to the frame, with and without contact. u and v run from -1 to 1
/// along the rows and columns of the image. Every term has mean 0 over the frame (`u^2` stands for `u^2` minus
/// its mean), so that a constant is left to `rest_offset` and `light_drift`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "background_change",
    group: Group::Optics,
    about: "pattern added to the frame from one pull on",
    formula: "I_c' = I_c + c_u u + c_v v + c_uu u^2 + c_uv u v + c_vv v^2 from pull at_pull_index on, c = red, green, blue",
    source: "a gel or its fabric that was changed; polynomial of second degree is ours, as the lights' fall-off",
    parameters: &[
        term("red_u"),
        term("red_v"),
        term("red_uu"),
        term("red_uv"),
        term("red_vv"),
        term("green_u"),
        term("green_v"),
        term("green_uu"),
        term("green_uv"),
        term("green_vv"),
        term("blue_u"),
        term("blue_v"),
        term("blue_uu"),
        term("blue_uv"),
        term("blue_vv"),
        ParameterSpec {
            name: "at_pull_index",
            unit: "1",
            neutral: 0.0,
            bounds: (0.0, 1e7),
            about: "first pull with it",
        },
    ],
    covariates: &["pull_index"],
    optics: Some(optics),
    sizes: 15,
    plainly: "From one press on the frame without contact looks different: gel, fabric or lights were touched.",
    number_means: "Grey levels that are added: green_u = 5 makes the right edge 5 levels greener and the left edge as much less.",
    remedy: "Take a new frame without contact after every change of gel or mounting.",
    typical: &[("green_u", 8.0), ("at_pull_index", 0.0)],
    presses: Some(PressFit {
        main: "green_u",
        start: |_, _| (0.0, 2.0),
        tried: Some("at_pull_index"),
        drawn: false,
        ..PressFit::DRAWN
    }),
    not_shown_by: &[Experiment::FrameWithoutContact, Experiment::FirstPressAgain],
    ..EffectSpec::BARE
};

const fn term(name: &'static str) -> ParameterSpec {
    let about = "coefficient of one term of one channel";
    ParameterSpec { name, unit: "grey levels", neutral: 0.0, bounds: (-60.0, 60.0), about }
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let [coefficients @ .., at_pull_index]: [f64; 3 * BACKGROUND_TERMS + 1] = values(parameters);
    if (at.covariates.pull_index as f64) < at_pull_index {
        return;
    }
    for (sum, coefficient) in state.background.as_flattened_mut().iter_mut().zip(coefficients) {
        *sum += coefficient;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn nothing_before_the_pull_and_the_whole_pattern_from_there_on() {
        let mut parameters: Vec<f64> = (1..=15).map(f64::from).collect();
        parameters.push(40.0);
        let pattern = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            let mut state = OpticsState::default();
            optics(&parameters, &mut state, &grip(&c, 40.0));
            state.background
        };
        assert_eq!(pattern(39), [[0.0; 5]; 3]);
        let named = |id: &str| SPEC.parameters.iter().position(|p| p.name == id).unwrap() as f64 + 1.0;
        assert_eq!(pattern(40)[1][3], named("green_uv"));
        assert_eq!(pattern(400)[2][4], named("blue_vv"));
    }
}
