//! A grip that loosens while it is held at constant width.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, ImprintFit, PullFit, parameter, values};

/// `grip_relaxation`: the gel's stress relaxes with one time constant while the jaws keep their width. It acts
/// on the normal force, so the imprint shows it too; that tells it from ageing of the friction. Beside a load cell that reads the
/// normal force itself, the imprint is larger than the reading says: at constant width the force falls, at constant force
/// the imprint grows, both with the one kernel `1 - depth (1 - exp(-t / tau_s))`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "grip_relaxation",
    group: Group::Jaws,
    about: "normal force that falls during the dwell",
    formula: "F_N = F_G (1 - depth (1 - exp(-t_dwell / tau_s)))",
    source: "one term of a Prony series; 5 to 25 % in 100 s, tau 0.3 to 100 s. Tiezzi and Kao 2007",
    parameters: &[
        parameter("depth", "1", 0.0, (0.0, 0.6)).about("share of the normal force that is lost in the end"),
        parameter("tau_s", "s", 10.0, (0.05, 1000.0)).about("dwell after which 63 % of it are lost"),
    ],
    covariates: &["dwell_s"],
    normal_force: Some(normal_force),
    plainly: "The jaws press less and less while they wait: gel or drive give way.",
    number_means: "depth = 0.1: 10 % of the normal force are lost in the end, two thirds of it after tau_s.",
    remedy: "Let the gripper hold its force rather than its width, or wait equally long before every pull.",
    typical: &[("depth", 0.15)],
    pulls: Ok(PullFit::of(|_| {
        let free = [("depth", 0.05), ("tau_s", 5.0)];
        Fit::over("tau_s", &[1.0, 8.0, 60.0], ("depth", 0.08), &free)
    })),
    grasp_force: Some(grasp_force),
    imprints: Some(ImprintFit {
        timed: true,
        fit: |span| {
            let longest_s = span.longest_s.max(0.2);
            let free = [("depth", 0.05), ("tau_s", 0.2 * longest_s)];
            let taus_s = [0.05, 0.3, 1.0].map(|part| (part * longest_s).clamp(0.05, 1000.0));
            Fit::over("tau_s", &taus_s, ("depth", 0.08), &free)
        },
        ..ImprintFit::PLAIN
    }),
    experiments: &[Experiment::DwellTimes, Experiment::LongHold],
    ..EffectSpec::BARE
};

/// The force u that would press the imprint without relaxation: `F(t) = u - depth w`, `tau_s dw/dt = u - w`, w the part of the
/// imprint that has relaxed. Forces are straight between two readings, which is integrated exactly; before the first one the
/// grasp stood still.
fn grasp_force(parameters: &[f64], time_s: &[f64], force_n: &[f64]) -> Vec<f64> {
    let [depth, tau_s] = values(parameters);
    if depth == 0.0 {
        return force_n.to_vec();
    }
    let rate = (1.0 - depth) / tau_s;
    let mut relaxed = force_n.first().map_or(0.0, |f| f / (1.0 - depth));
    let mut shown = Vec::with_capacity(force_n.len());
    for (i, &force) in force_n.iter().enumerate() {
        if i > 0 {
            let (step_s, before) = (time_s[i] - time_s[i - 1], force_n[i - 1]);
            // dw/dt = (F - (1 - depth) w) / tau_s with F = before + slope t.
            let slope = (force - before) / step_s;
            let level = |f: f64| (f - slope / rate) / (1.0 - depth);
            relaxed = level(force) + (relaxed - level(before)) * libm::exp(-rate * step_s);
        }
        shown.push(force + depth * relaxed);
    }
    shown
}

fn normal_force(parameters: &[f64], force_n: f64, at: &GripPoint<'_>) -> f64 {
    let [depth, tau_s] = values(parameters);
    force_n * (1.0 + depth * libm::expm1(-at.covariates.dwell_s / tau_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    /// A standard linear solid under a constant force creeps to 1 / (1 - depth) times its first imprint with tau / (1 - depth).
    #[test]
    fn an_imprint_under_constant_force_grows_as_the_solid_says() {
        let (depth, tau_s) = (0.2, 3.0);
        let time_s: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.05).collect();
        // No force, then 10 N at once.
        let force_n: Vec<f64> = (0..400).map(|i| if i == 0 { 0.0 } else { 10.0 }).collect();
        let shown = grasp_force(&[depth, tau_s], &time_s, &force_n);
        assert_eq!(shown[0], 0.0);
        let end = 10.0 / (1.0 - depth);
        for (i, u) in shown.iter().enumerate().skip(1) {
            let late_s = time_s[i] - 0.025;
            let expected = end - (end - 10.0) * libm::exp(-(1.0 - depth) * late_s / tau_s);
            assert!((u - expected).abs() < 0.02, "{i}: {u} {expected}");
        }
        assert!(
            grasp_force(&[depth, tau_s], &[0.0, 1.0, 2.0], &[4.0; 3]).iter().all(|u| (u - 5.0).abs() < 1e-12)
        );
    }

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
