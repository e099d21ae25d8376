//! A new gel that takes a few cycles to settle.

use super::{EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, parameter, values};
use crate::PULLS_SINCE_REST;
use crate::draw::Drawn;

/// `conditioning`: silicone softens in its first cycles (Mullins effect), so that the contact changes and friction
/// moves to its settled value. What rest undoes comes back after every rest; what it does not happens once in the life of a
/// gel, where only a rise is told from `wear`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "conditioning",
    group: Group::Friction,
    about: "friction coefficient that settles in the first pulls of a gel, or after a rest",
    formula: "mu' = mu (1 - depth exp(-n / n0)), n = (1 - rests) pull_index + rests pulls_since_rest",
    source: "Mullins softening, 5 to 30 % in the first cycle, over in 3 to 10",
    parameters: &[
        parameter("depth", "1", 0.0, (-0.6, 0.6))
            .about("share of the settled coefficient that the first pull lacks"),
        parameter("n0", "1", 5.0, (0.5, 100.0)).about("pulls after which 63 % of that are there"),
        parameter("rests", "1", 0.0, (0.0, 1.0))
            .about("1 where every rest starts it anew, 0 where it happens once in the life of a gel"),
    ],
    covariates: &["pull_index"],
    references: &["rests"],
    friction: Some(friction),
    plainly: "The first pulls of a gel, or the first after a rest, hold less (or more) until it has settled.",
    number_means: "depth = 0.2: the first pull lacks 20 % of the settled coefficient, a third of that is left after n0 pulls.",
    remedy: "Make two or three times n0 pulls that do not count before a campaign and after every pause; ten where n0 is not known.",
    typical: &[("depth", 0.2)],
    pulls: Ok(PullFit {
        fit: |span| {
            let starts = [2.0, 6.0, 20.0].into_iter().flat_map(|n0| {
                let again = |depth| vec![("n0", n0), ("depth", depth), ("rests", 1.0)];
                let mut starts = vec![vec![("n0", n0), ("depth", 0.1)]];
                starts.extend([0.1, -0.1].into_iter().filter(|_| span.rests).map(again));
                starts
            });
            let free = Fit::new(&[], &[("depth", 0.05), ("n0", 2.0)]).searching(usize::from(span.rests));
            Fit { starts: starts.collect(), ..free }
        },
        // A gel that settles once to less friction is worn, which is another effect.
        bounds: |name, at, (low, high)| {
            let [_, _, rests] = values(at);
            if name == "depth" && rests == 0.0 { (0.0, high) } else { (low, high) }
        },
        ..PullFit::PLAIN
    }),
    experiments: &[Experiment::LongPause],
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [depth, n0, rests] = values(parameters);
    let index = at.covariates.pull_index as f64;
    let since = match at.covariates.extra.get(PULLS_SINCE_REST) {
        Some(Drawn::Number(n)) if rests > 0.0 => *n,
        _ => index,
    };
    let n = (1.0 - rests) * index + rests * since;
    mu * (1.0 - depth * libm::exp(-n / n0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    #[test]
    fn the_first_pull_lacks_depth_and_each_pull_the_same_share_of_what_is_left() {
        let lacks = |pull_index| {
            let c = Covariates { pull_index, ..Default::default() };
            1.0 - friction(&[0.2, 4.0, 0.0], 0.3, &grip(&c, 40.0)) / 0.3
        };
        assert!((lacks(0) - 0.2).abs() < 1e-12);
        assert!((lacks(4) - 0.2 * 0.367_879_441_17).abs() < 1e-12);
        for n in 0..10 {
            assert!((lacks(n + 1) / lacks(n) - 0.778_800_783_07).abs() < 1e-9, "exp(-1/4)");
        }
    }
    /// With rests, the count starts anew after each; where nobody counted, the pulls of the gel stand in.
    #[test]
    fn a_rest_starts_it_anew() {
        let mut c = Covariates { pull_index: 40, ..Default::default() };
        let lacks = |c: &Covariates, rests| 1.0 - friction(&[0.2, 4.0, rests], 0.3, &grip(c, 40.0)) / 0.3;
        assert_eq!(lacks(&c, 1.0), lacks(&c, 0.0));
        c.extra.insert(PULLS_SINCE_REST.into(), Drawn::Number(0.0));
        assert!((lacks(&c, 1.0) - 0.2).abs() < 1e-12);
        assert!(lacks(&c, 0.0) < 1e-4);
    }
}
