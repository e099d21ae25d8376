//! Two regimes of friction with a transition at a grip force.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `regime_transition`: one coefficient below a grip force, another above. The lower one is `mu`; a factor on
/// both would be `mu` again. Wucherer et al. 2023 see a "phase transition" near 20 N and do not explain it.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "regime_transition",
    group: Group::Friction,
    about: "another friction coefficient above a grip force",
    formula: "mu' = mu (1 + step / (1 + exp(-(F_G - f_c_n) / width_n)))",
    source: "Wucherer et al. 2023, transition near 20 N; logistic step is ours",
    parameters: &[
        parameter("step", "1", 0.0, (-0.8, 2.0))
            .about("relative change of the coefficient from far below to far above"),
        parameter("f_c_n", "N", 20.0, (1.0, 100.0)).about("grip force of half the step"),
        parameter("width_n", "N", 2.0, (0.1, 20.0))
            .about("width; from f_c_n - 2.2 width_n to f_c_n + 2.2 width_n it goes from 10 to 90 %"),
    ],
    covariates: &["grip_force_n"],
    friction: Some(friction),
    plainly: "Friction is another one above some grip force, as if something in the contact or the gripper changed there.",
    number_means: "step = 0.15: the coefficient is 15 % higher far above f_c_n than far below it.",
    remedy: "Look for what changes at that force: a gripper that switches its control, a coating pressed through, a part that shifts in its fixture.",
    typical: &[("step", 0.2)],
    pulls: Ok(PullFit {
        fit: |_| {
            let forces_n = [10.0, 15.0, 20.0, 25.0, 35.0, 50.0];
            let steps = forces_n.iter().flat_map(|f_c_n| [0.15, -0.15].map(|step| (*f_c_n, step)));
            let start = |(f_c_n, step)| vec![("f_c_n", f_c_n), ("step", step), ("width_n", 2.0)];
            Fit {
                starts: steps.map(start).collect(),
                ..Fit::new(&[], &[("step", 0.1), ("f_c_n", 3.0), ("width_n", 1.0)])
            }
        },
        // A wider one is no transition but a saturation or a power law.
        bounds: |name, _, (low, high)| if name == "width_n" { (low, 6.0) } else { (low, high) },
        ..PullFit::PLAIN
    }),
    experiments: &[Experiment::WiderGripForces],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [step, f_c_n, width_n] = values(parameters);
    let share = 1.0 / (1.0 + libm::exp(-(at.grip_force_n - f_c_n) / width_n));
    mu * (1.0 + step * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn half_the_step_stands_at_the_critical_force_and_most_of_it_within_the_width() {
        let c = Covariates::default();
        let share = |force_n| (friction(&[-0.3, 20.0, 2.0], 0.2, &grip(&c, force_n)) / 0.2 - 1.0) / -0.3;
        assert!((share(20.0) - 0.5).abs() < 1e-12);
        assert!((share(20.0 + 2.0 * 9.0_f64.ln()) - 0.9).abs() < 1e-12);
        assert!((share(20.0 - 2.0 * 9.0_f64.ln()) - 0.1).abs() < 1e-12);
        assert!(share(5.0) < 1e-3 && share(80.0) > 0.999);
    }
}
