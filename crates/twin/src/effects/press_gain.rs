//! A camera whose white balance is another one, or differs from grip to grip.

use super::{EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit, parameter, values};
use crate::random::{Purpose, Stream};
use crate::{Jaw, OpticsState};

/// `press_gain`: the camera balances white, or exposes, by itself, so that red and blue have another gain than green, and each
/// grip has gains of its own, with and without contact. A gain that all colours share is one of `exposure`. Repetitions of
/// a grip share their gains, the jaws do not: each has its camera.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "press_gain",
    group: Group::Optics,
    about: "white balance that is another one, or differs from grip to grip",
    formula: "I_c' = I_c g_c exp(c_sd n), g = red, 1, blue; n a standard normal number for each grip, jaw and colour, c = red, green, blue",
    source: "gains of 21 presses into a GelSight scatter by 4.6, 0.8 and 4.6 % (Zhao et al. 2024, FOTS: its published presses)",
    parameters: &[
        gain("red", "gain of red over that of green"),
        gain("blue", "gain of blue over that of green"),
        scatter("red_sd"),
        scatter("green_sd"),
        scatter("blue_sd"),
    ],
    optics: Some(optics),
    sizes: 5,
    plainly: "Pictures have a colour cast, all the same or each its own: the camera balances white, or exposes, by itself.",
    number_means: "red = 1.05: red is 5 % brighter than it was; red_sd = 0.05: its gain differs by 5 % (standard deviation) from grip to grip.",
    remedy: "Switch the camera's automatic white balance, exposure and gain off, and take the presses again.",
    typical: &[("red_sd", 0.04), ("green_sd", 0.01), ("blue_sd", 0.04)],
    presses: Some(PressFit {
        main: "red",
        start: |name, _| if name.ends_with("_sd") { (0.0, 0.01) } else { (1.0, 0.02) },
        orders: &[2],
        drawn: false,
        scatters: 3,
        ..PressFit::DRAWN
    }),
    experiments: &[Experiment::FrameWithoutContact],
    ..EffectSpec::BARE
};

const fn gain(name: &'static str, about: &'static str) -> ParameterSpec {
    parameter(name, "1", 1.0, (0.5, 2.0)).about(about)
}

const fn scatter(name: &'static str) -> ParameterSpec {
    let about = "standard deviation of the logarithm of the channel's gain";
    parameter(name, "1", 0.0, (0.0, 0.5)).about(about)
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let [red, blue, sd @ ..]: [f64; 5] = values(parameters);
    state.light_gain[0] *= red;
    state.light_gain[2] *= blue;
    let lane = match at.jaw {
        Jaw::Left => 0,
        Jaw::Right => 1,
    };
    let mut draws = Stream::with_lane(at.grip.0, at.grip.1, Purpose::PressGain, lane);
    for (gain, sd) in state.light_gain.iter_mut().zip(sd) {
        *gain *= libm::exp(sd * draws.normal());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::{grip, optics_after};

    fn gain(jaw: Jaw, grip_key: (u64, u64), sd: [f64; 3]) -> [f64; 3] {
        let c = Covariates::default();
        let mut state = OpticsState::default();
        optics(
            &[1.0, 1.0, sd[0], sd[1], sd[2]],
            &mut state,
            &GripPoint { jaw, grip: grip_key, ..grip(&c, 40.0) },
        );
        state.light_gain
    }

    /// Over 4000 grips the logarithms have the mean 0 and the standard deviations of the parameters, and no channel or jaw
    /// follows another.
    #[test]
    fn gains_scatter_by_their_parameters_and_by_themselves() {
        let sd = [0.05, 0.01, 0.03];
        let n = 4000;
        let draws: Vec<[f64; 6]> = (0..n)
            .map(|i| {
                let of = |jaw| gain(jaw, (7, i), sd).map(f64::ln);
                let ([a, b, c], [d, e, f]) = (of(Jaw::Left), of(Jaw::Right));
                [a / sd[0], b / sd[1], c / sd[2], d / sd[0], e / sd[1], f / sd[2]]
            })
            .collect();
        let within = 4.0 / (n as f64).sqrt();
        for i in 0..6 {
            let mean = draws.iter().map(|d| d[i]).sum::<f64>() / n as f64;
            assert!(mean.abs() < within, "mean of {i}: {mean}");
            for j in 0..6 {
                let moment = draws.iter().map(|d| d[i] * d[j]).sum::<f64>() / n as f64;
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((moment - wanted).abs() < 1.5 * within, "{i} with {j}: {moment}");
            }
        }
    }

    #[test]
    fn a_grip_has_one_gain_and_another_seed_another() {
        let sd = [0.05; 3];
        assert_eq!(gain(Jaw::Left, (1, 2), sd), gain(Jaw::Left, (1, 2), sd));
        assert_ne!(gain(Jaw::Left, (1, 2), sd), gain(Jaw::Left, (2, 2), sd));
        assert_eq!(gain(Jaw::Right, (1, 2), [0.0; 3]), [1.0; 3]);
    }

    #[test]
    fn a_white_balance_that_stays_is_its_two_gains() {
        let state = optics_after(optics, &[&[1.06, 0.94, 0.0, 0.0, 0.0]]);
        assert_eq!(state.light_gain, [1.06, 1.0, 0.94]);
    }
}
