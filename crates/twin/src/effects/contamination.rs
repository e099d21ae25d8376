//! Oil, dust or wear particles between part and gel, from one pull on.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};

/// `contamination`: the coefficient steps at a pull. A negative drop is a cleaning.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "contamination",
    group: Group::Friction,
    about: "friction coefficient that steps at one pull",
    formula: "mu' = mu (1 - drop) from pull at_pull_index on",
    source: "third bodies take 10 to 60 % of the friction, until they are cleaned off",
    parameters: &[
        parameter("drop", "1", 0.0, (-1.5, 0.9)).about("share of the coefficient that is lost"),
        parameter("at_pull_index", "1", 0.0, (0.0, 1e7)).about("first pull with it"),
    ],
    covariates: &["pull_index"],
    friction: Some(friction),
    plainly: "From one pull on friction is another one: something came onto the gel or the part, or went off it.",
    number_means: "drop = 0.2: 20 % of the coefficient are lost from pull at_pull_index on.",
    remedy: "Look up what happened before that pull (oil, dust, a touched part); clean gel and part, and repeat a few of the pulls before it.",
    typical: &[("drop", 0.2), ("at_pull_index", 150.0)],
    pulls: Ok(PullFit::of(|span| {
        Fit::over("at_pull_index", &span.splits, ("drop", 0.0), &[("drop", 0.05)]).searching(1)
    })),
    experiments: &[Experiment::LongPause],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [drop, at_pull_index] = values(parameters);
    if (at.covariates.pull_index as f64) < at_pull_index { mu } else { mu * (1.0 - drop) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn nothing_before_the_pull_and_all_of_it_from_there_on() {
        let mu = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            friction(&[0.25, 40.0], 0.2, &grip(&c, 40.0))
        };
        assert_eq!([mu(0), mu(39)], [0.2, 0.2]);
        assert!((mu(40) - 0.15).abs() < 1e-15 && mu(40) == mu(4000));
    }
}
