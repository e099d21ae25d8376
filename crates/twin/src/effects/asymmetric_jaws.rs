//! Two gels that do not rub alike.

use super::{EffectSpec, GripPoint, Group, parameter, values};
use crate::Jaw;

/// `asymmetric_jaws`: the coefficient of one jaw is higher and that of the other lower by the same share; the
/// mean is the baseline's.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "asymmetric_jaws",
    group: Group::Jaws,
    about: "friction coefficients that differ between the jaws",
    formula: "mu_left' = mu (1 + asymmetry), mu_right' = mu (1 - asymmetry)",
    source: "definition; 5 to 30 % between two gels",
    parameters: &[parameter("asymmetry", "1", 0.0, (-0.6, 0.6))
        .about("half of the relative difference, left minus right")],
    friction: Some(friction),
    plainly: "The two gels do not hold the same.",
    number_means: "asymmetry = 0.1: the left jaw has a coefficient 10 % above the mean, the right one 10 % below it.",
    remedy: "Swap the gels: what stays with the gel is the gel's. Their sum, and so the label, does not change.",
    typical: &[("asymmetry", 0.2)],
    pulls: Err("the jaws hold the sum of both coefficients, which it leaves as it is"),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [asymmetry] = values(parameters);
    match at.jaw {
        Jaw::Left => mu * (1.0 + asymmetry),
        Jaw::Right => mu * (1.0 - asymmetry),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::grip;
    use crate::{Covariates, PerJaw};

    #[test]
    fn the_jaws_differ_and_keep_their_mean() {
        let c = Covariates::default();
        let mu = PerJaw::from_fn(|jaw| friction(&[0.15], 0.2, &GripPoint { jaw, ..grip(&c, 40.0) }));
        assert!((mu.left - 0.23).abs() < 1e-15 && (mu.right - 0.17).abs() < 1e-15);
        assert!((mu.left + mu.right - 0.4).abs() < 1e-15);
    }
}
