//! A background that is another one from one pull on.

use super::{EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit, parameter, values};
use crate::OpticsState;
use crate::optics::{BACKGROUND_TERMS, FINER_TERMS};

/// `background_change`: a smooth pattern is added to the frame, with and without contact. u and v run from -1 to 1
/// along the rows and columns of the image. Every term has mean 0 over the frame (`u^2` stands for `u^2` minus
/// its mean), so that a constant is left to `rest_offset` and `light_drift`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "background_change",
    group: Group::Optics,
    about: "pattern added to the frame from one pull on",
    formula: "I_c' = I_c + c_u u + c_v v + c_uu u^2 + c_uv u v + c_vv v^2 + sum of c_uIvJ P_I(u) P_J(v) from pull at_pull_index on, c = red, green, blue, P = Legendre polynomials, 3 <= I + J <= 6",
    source: "a gel or its fabric that was changed; polynomials are ours, as the lights' fall-off; sixth degree holds one and a half waves over the frame",
    parameters: &PARAMETERS,
    covariates: &["pull_index"],
    optics: Some(optics),
    sizes: SIZES,
    plainly: "From one press on the frame without contact looks different: gel, fabric or lights were touched.",
    number_means: "Grey levels that are added: green_u = 5 makes the right edge 5 levels greener and the left edge as much less.",
    remedy: "Take a new frame without contact after every change of gel or mounting.",
    typical: &[("green_u", 8.0), ("at_pull_index", 0.0)],
    presses: Some(PressFit {
        main: "green_u",
        start: |_, _| (0.0, 2.0),
        tried: Some("at_pull_index"),
        // Degrees 2, 4 and 6.
        orders: &[15, 42, SIZES],
        drawn: false,
        ..PressFit::DRAWN
    }),
    not_shown_by: &[Experiment::FrameWithoutContact, Experiment::FirstPressAgain],
    ..EffectSpec::BARE
};

/// Terms of all channels.
const SIZES: usize = 3 * (BACKGROUND_TERMS + FINER_TERMS.len());

/// The terms of each channel, as many channels after one another.
macro_rules! of_channels {
    ($($term:literal)*) => {
        [$(term(concat!("red_", $term)),)* $(term(concat!("green_", $term)),)* $(term(concat!("blue_", $term)),)*]
    };
}

const SQUARE: [ParameterSpec; 15] = of_channels!("u" "v" "uu" "uv" "vv");
const QUARTIC: [ParameterSpec; 27] =
    of_channels!("u3v0" "u2v1" "u1v2" "u0v3" "u4v0" "u3v1" "u2v2" "u1v3" "u0v4");
const SEXTIC: [ParameterSpec; 39] = of_channels!(
    "u5v0" "u4v1" "u3v2" "u2v3" "u1v4" "u0v5" "u6v0" "u5v1" "u4v2" "u3v3" "u2v4" "u1v5" "u0v6"
);

/// Terms by degree, so that the first ones are the coarse ones, and where they begin.
const PARAMETERS: [ParameterSpec; SIZES + 1] = {
    let mut all = [AT_PULL_INDEX; SIZES + 1];
    let mut i = 0;
    while i < SIZES {
        all[i] = match i {
            0..15 => SQUARE[i],
            15..42 => QUARTIC[i - 15],
            _ => SEXTIC[i - 42],
        };
        i += 1;
    }
    all
};

const AT_PULL_INDEX: ParameterSpec =
    parameter("at_pull_index", "1", 0.0, (0.0, 1e7)).about("first pull with it");

const fn term(name: &'static str) -> ParameterSpec {
    let about = "coefficient of one term of one channel";
    parameter(name, "grey levels", 0.0, (-60.0, 60.0)).about(about)
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let [coefficients @ .., at_pull_index]: [f64; SIZES + 1] = values(parameters);
    if (at.covariates.pull_index as f64) < at_pull_index {
        return;
    }
    let (square, finer) = coefficients.split_at(3 * BACKGROUND_TERMS);
    for (sum, coefficient) in state.background.as_flattened_mut().iter_mut().zip(square) {
        *sum += coefficient;
    }
    let (quartic, sextic) = finer.split_at(QUARTIC.len());
    for (c, sums) in state.finer_background.iter_mut().enumerate() {
        let own =
            [quartic, sextic].into_iter().flat_map(|terms| &terms[c * terms.len() / 3..][..terms.len() / 3]);
        sums.iter_mut().zip(own).for_each(|(sum, coefficient)| *sum += coefficient);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn nothing_before_the_pull_and_the_whole_pattern_from_there_on() {
        let mut parameters: Vec<f64> = (1..=SIZES).map(|i| i as f64).collect();
        parameters.push(40.0);
        let pattern = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            let mut state = OpticsState::default();
            optics(&parameters, &mut state, &grip(&c, 40.0));
            (state.background, state.finer_background)
        };
        assert_eq!(pattern(39), ([[0.0; 5]; 3], [[0.0; 22]; 3]));
        let named = |id: &str| SPEC.parameters.iter().position(|p| p.name == id).unwrap() as f64 + 1.0;
        assert_eq!(pattern(40).0[1][3], named("green_uv"));
        assert_eq!(pattern(400).0[2][4], named("blue_vv"));
        for (c, colour) in ["red", "green", "blue"].into_iter().enumerate() {
            for (k, (i, j)) in FINER_TERMS.into_iter().enumerate() {
                assert_eq!(pattern(40).1[c][k], named(&format!("{colour}_u{i}v{j}")));
            }
        }
    }
}
