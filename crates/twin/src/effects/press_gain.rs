//! A camera whose gains differ from grip to grip.

use super::hooks::values;
use super::{EffectSpec, Experiment, GripPoint, Group, ParameterSpec, PressFit};
use crate::random::{Purpose, Stream};
use crate::{Jaw, OpticsState};

/// `press_gain`: the camera balances white, or exposes, by itself, so that each grip has a gain of its own for each colour,
/// with and without contact. Repetitions of a grip share it, the jaws do not: each has its camera.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "press_gain",
    group: Group::Optics,
    about: "gain of each colour that differs from grip to grip",
    formula: "I_c' = I_c exp(c_sd n), n a standard normal number for each grip, jaw and colour, c = red, green, blue",
    source: "gains of 21 presses into a GelSight scatter by 4.6, 0.8 and 4.6 % (Zhao et al. 2024, FOTS: its published presses)",
    parameters: &[scatter("red_sd"), scatter("green_sd"), scatter("blue_sd")],
    covariates: &[],
    optics: Some(optics),
    sizes: 3,
    plainly: "Each picture has a colour cast of its own: the camera balances white, or exposes, by itself.",
    number_means: "red_sd = 0.05: the gain of red differs by 5 % (standard deviation) from grip to grip.",
    remedy: "Switch the camera's automatic white balance, exposure and gain off, and take the presses again.",
    typical: &[("red_sd", 0.04), ("green_sd", 0.01), ("blue_sd", 0.04)],
    presses: Some(PressFit {
        main: "red_sd",
        start: |_, _| (0.0, 0.01),
        drawn: false,
        scatters: true,
        ..PressFit::DRAWN
    }),
    experiments: &[Experiment::FrameWithoutContact],
    ..EffectSpec::BARE
};

const fn scatter(name: &'static str) -> ParameterSpec {
    let about = "standard deviation of the logarithm of the channel's gain";
    ParameterSpec { name, unit: "1", neutral: 0.0, bounds: (0.0, 0.5), about }
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let sd: [f64; 3] = values(parameters);
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
    use crate::effects::testing::grip;

    fn gain(jaw: Jaw, grip_key: (u64, u64), parameters: [f64; 3]) -> [f64; 3] {
        let c = Covariates::default();
        let mut state = OpticsState::default();
        optics(&parameters, &mut state, &GripPoint { jaw, grip: grip_key, ..grip(&c, 40.0) });
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
}
