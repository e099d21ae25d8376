//! A grip that loosens while it is held at constant width.

use super::hooks::values;
use super::{EffectSpec, Experiment, Fit, GripPoint, Group, ParameterSpec, PullFit};

/// `grip_relaxation`: the gel's stress relaxes with one time constant while the jaws keep their width. It acts
/// on the normal force, so the imprint shows it too; that tells it from ageing of the friction.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "grip_relaxation",
    group: Group::Jaws,
    about: "normal force that falls during the dwell",
    formula: "F_N = F_G (1 - depth (1 - exp(-t_dwell / tau_s)))",
    source: "one term of a Prony series; 5 to 25 % in 100 s, tau 0.3 to 100 s. Tiezzi and Kao 2007",
    parameters: &[
        ParameterSpec {
            name: "depth",
            unit: "1",
            neutral: 0.0,
            bounds: (0.0, 0.6),
            about: "share of the normal force that is lost in the end",
        },
        ParameterSpec {
            name: "tau_s",
            unit: "s",
            neutral: 10.0,
            bounds: (0.05, 1000.0),
            about: "dwell after which 63 % of it are lost",
        },
    ],
    covariates: &["dwell_s"],
    normal_force: Some(normal_force),
    plainly: "The jaws press less and less while they wait: gel or drive give way.",
    number_means: "depth = 0.1: 10 % of the normal force are lost in the end, two thirds of it after tau_s.",
    remedy: "Let the gripper hold its force rather than its width, or wait equally long before every pull.",
    typical: &[("depth", 0.15)],
    pulls: Ok(PullFit {
        fit: |_| {
            let free = [("depth", 0.05), ("tau_s", 5.0)];
            Fit::over("tau_s", &[1.0, 8.0, 60.0], ("depth", 0.08), &free)
        },
        ..PullFit::PLAIN
    }),
    experiments: &[Experiment::DwellTimes],
    ..EffectSpec::BARE
};

fn normal_force(parameters: &[f64], force_n: f64, at: &GripPoint<'_>) -> f64 {
    let [depth, tau_s] = values(parameters);
    force_n * (1.0 + depth * libm::expm1(-at.covariates.dwell_s / tau_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn after_tau_63_percent_of_the_depth_are_lost_at_every_force() {
        for force_n in [5.0, 80.0] {
            let held = |dwell_s| {
                let c = Covariates { dwell_s, ..Default::default() };
                normal_force(&[0.2, 30.0], force_n, &grip(&c, force_n)) / force_n
            };
            assert_eq!(held(0.0), 1.0);
            assert!((held(30.0) - (1.0 - 0.2 * 0.632_120_558_83)).abs() < 1e-11);
            assert!((held(1e6) - 0.8).abs() < 1e-12);
        }
    }
}
