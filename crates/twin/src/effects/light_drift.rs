//! Lights whose brightness drifts with the clock.

use super::{
    EffectSpec, Experiment, Fit, GripPoint, Group, ImprintFit, ParameterSpec, PressFit, parameter, values,
};
use crate::OpticsState;

/// `light_drift`: every channel is multiplied, with and without contact, by a factor that starts at 1 and changes
/// linearly with the clock of the campaign; never below 0.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "light_drift",
    group: Group::Optics,
    about: "brightness of each channel that changes with time",
    formula: "I_c' = I_c (1 + c_per_h t), c = red, green, blue",
    source: "temperature and ageing of LEDs, up to 5 % per channel",
    parameters: &[rate("red_per_h", "red"), rate("green_per_h", "green"), rate("blue_per_h", "blue")],
    covariates: &["time_s"],
    optics: Some(optics),
    sizes: 3,
    plainly: "The lights get brighter or darker with time.",
    number_means: "green_per_h = 0.02: the green light is 2 % brighter after an hour.",
    remedy: "Let the lights warm up for half an hour; take a frame without contact before every press.",
    typical: &[("red_per_h", 0.05), ("green_per_h", 0.05), ("blue_per_h", 0.05)],
    presses: Some(PressFit {
        main: "green_per_h",
        start: |_, _| (0.0, 0.05),
        drawn: false,
        ..PressFit::DRAWN
    }),
    // A volume that was integrated from colours grows with the light, whatever its colour; what came before a grasp is in its c.
    imprints: Some(ImprintFit {
        timed: true,
        fit: |span| {
            let scale = 180.0 / span.longest_s.max(1e-3);
            Fit::new(&[&[("red_per_h", scale)], &[("red_per_h", -scale)]], &[("red_per_h", scale)])
        },
        alike: &["green_per_h", "blue_per_h"],
        // Half of the light over a grasp of seconds is far more in an hour.
        bounds: |span, library| super::wider(library, 1800.0 / span.longest_s.max(1e-3)),
        factor: Some(|parameters, time_s| (1.0 + parameters[0] * (time_s / 3600.0)).max(0.0)),
        ..ImprintFit::PLAIN
    }),
    experiments: &[Experiment::FrameWithoutContact, Experiment::FirstPressAgain, Experiment::LongHold],
    ..EffectSpec::BARE
};

const fn rate(name: &'static str, about: &'static str) -> ParameterSpec {
    parameter(name, "1/h", 0.0, (-1.0, 1.0)).about(about)
}

fn optics(parameters: &[f64], state: &mut OpticsState, at: &GripPoint<'_>) {
    let rates: [f64; 3] = values(parameters);
    for (gain, rate) in state.light_gain.iter_mut().zip(rates) {
        *gain *= (1.0 + rate * (at.covariates.time_s / 3600.0)).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn each_channel_moves_by_its_rate_every_hour_from_the_first_image_on() {
        let gain = |hours: f64| {
            let c = Covariates { time_s: 3600.0 * hours, ..Default::default() };
            let mut state = OpticsState::default();
            optics(&[0.02, 0.0, -0.5], &mut state, &grip(&c, 40.0));
            state.light_gain
        };
        assert_eq!(gain(0.0), [1.0; 3]);
        assert_eq!(gain(1.0), [1.02, 1.0, 0.5]);
        assert_eq!(gain(3.0), [1.06, 1.0, 0.0], "no light is less than none");
    }
}
