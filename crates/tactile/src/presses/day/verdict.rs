//! Which explanation holds, and which ones hold as well.

use super::{Change, Explanation, RADIUS, Tried};

/// Least gain of an explanation that counts, in standard errors over the presses.
const TIMES_SE: f64 = 2.0;

/// What an explanation has to gain at least: the sum over the zones of the logarithm of the error, so that a third of the error of one
/// zone is enough. Presses of the day of the calibration gain up to 0.3 by chance.
const LEAST_GAIN: f64 = 0.4;

/// An explanation that loses less than this share of what the best one gains is as good: gels are tried at steps.
const SHARE: f64 = 0.1;

/// Mean and its standard error.
pub(super) fn mean_and_se(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / (n - 1.0).max(1.0) / n).sqrt())
}

/// Whether the contacts are larger or smaller than their marks say, beyond what marks are unsure by.
fn radii_are_off(ln_radii: &[f64]) -> bool {
    let (mean, se) = mean_and_se(ln_radii);
    mean.abs() > RADIUS && mean.abs() > TIMES_SE * se
}

/// The explanation that holds, if one does, and all of them with their weights.
///
/// `ln_radii`: by how much the contact of each press is larger than its mark, without any change. `measured_depths`: the radii follow
/// from how far the ball travelled, so that nobody saw them.
pub(super) fn decide(
    tried: Vec<Tried>,
    ln_radii: &[f64],
    measured_depths: bool,
) -> (Option<Tried>, Vec<Explanation>) {
    let off = radii_are_off(ln_radii);
    let holds = |tried: &Tried| {
        let (gain, se) = mean_and_se(&tried.gains);
        let force = matches!(tried.change, Change::Force { .. });
        gain > LEAST_GAIN && gain > TIMES_SE * se && (!force || off)
    };
    let mean = |tried: &Tried| mean_and_se(&tried.gains).0;
    let mut best = (0..tried.len())
        .filter(|&i| holds(&tried[i]))
        .max_by(|&a, &b| mean(&tried[a]).total_cmp(&mean(&tried[b])));
    // Radii and gels look alike. A radius that was seen is believed, one that follows from a depth is not.
    if let Some(at) = best {
        let other = (0..tried.len()).find(|&i| {
            holds(&tried[i])
                && match (&tried[at].change, &tried[i].change) {
                    (Change::Force { .. }, Change::Gel { .. }) => !measured_depths,
                    (Change::Gel { .. }, Change::Force { .. }) => measured_depths,
                    _ => false,
                }
        });
        best = other.filter(|&i| is_as_good(&tried[at], &tried[i])).or(best);
    }
    // Contacts of another size and images that need nothing else: the same two, as far as the gel explains anything.
    let sizes = off && best.is_none();
    let of_size = |t: &Tried| match t.change {
        Change::Force { .. } => true,
        Change::Gel { .. } => mean(t) > 0.0,
        _ => false,
    };
    if sizes {
        let at = |force: bool| {
            let named = |t: &Tried| of_size(t) && matches!(t.change, Change::Force { .. }) == force;
            tried.iter().position(named)
        };
        best = at(measured_depths).or(at(true));
    }
    let holds = |t: &Tried| holds(t) || (sizes && of_size(t));
    let list = explanations(&tried, best, holds);
    (best.and_then(|i| tried.into_iter().nth(i)), list)
}

/// Whether an explanation loses next to nothing against the best one.
fn is_as_good(best: &Tried, other: &Tried) -> bool {
    let (most, gain) = (mean_and_se(&best.gains).0, mean_and_se(&other.gains).0);
    loss(best, other) < TIMES_SE || most - gain < SHARE * most
}

/// Loss of one explanation against another, in standard errors over the presses.
fn loss(best: &Tried, other: &Tried) -> f64 {
    let differences: Vec<f64> = best.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect();
    let (mean, se) = mean_and_se(&differences);
    if mean <= 0.0 { 0.0 } else { mean / se.max(1e-9) }
}

fn explanations(tried: &[Tried], best: Option<usize>, holds: impl Fn(&Tried) -> bool) -> Vec<Explanation> {
    let zero = |change: Change| Tried {
        change,
        folds: vec![],
        gains: vec![0.0; tried.first().map_or(0, |t| t.gains.len())],
    };
    let nothing = zero(Change::Nothing);
    let winner = best.map_or(&nothing, |i| &tried[i]);
    let list: Vec<(&Tried, bool)> = std::iter::once((&nothing, best.is_none()))
        .chain(tried.iter().enumerate().map(|(i, t)| (t, holds(t) || Some(i) == best)))
        .collect();
    let raw: Vec<f64> = list
        .iter()
        .map(|(t, holds)| {
            let t = if is_as_good(winner, t) { loss(winner, t).min(1.0) } else { loss(winner, t) };
            if *holds { libm::exp(-0.5 * t * t) } else { 0.0 }
        })
        .collect();
    let total: f64 = raw.iter().sum();
    let each = list.iter().zip(&raw).map(|((t, holds), raw)| {
        let (gain, gain_se) = mean_and_se(&t.gains);
        let ties = *holds && is_as_good(winner, t) && !std::ptr::eq(*t, winner);
        Explanation { cause: t.change.cause(), gain, gain_se, weight: raw / total.max(1e-300), ties }
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presses::day::Cause;

    fn tried(change: Change, gains: [f64; 5]) -> Tried {
        Tried { change, folds: vec![], gains: gains.to_vec() }
    }

    fn gel() -> Change {
        Change::Gel { sink_in_fraction: 0.3, width: 1.0 }
    }

    fn decided(list: Vec<Tried>, ln_radius: f64, depths: bool) -> (Cause, Vec<Cause>) {
        let radii = [ln_radius, ln_radius + 0.01, ln_radius - 0.01, ln_radius, ln_radius];
        let (best, all) = decide(list, &radii, depths);
        let ties = all.iter().filter(|e| e.ties).map(|e| e.cause).collect();
        assert!((all.iter().map(|e| e.weight).sum::<f64>() - 1.0).abs() < 1e-9);
        (best.map_or(Cause::Nothing, |t| t.change.cause()), ties)
    }

    #[test]
    fn what_gains_little_or_in_few_presses_is_nothing() {
        let small = tried(gel(), [0.3, 0.31, 0.29, 0.3, 0.3]);
        let unsure = tried(gel(), [4.0, -1.0, 0.2, -0.5, 0.1]);
        assert_eq!(decided(vec![small, unsure], 0.01, false), (Cause::Nothing, vec![]));
        let sure = tried(gel(), [0.9, 1.1, 1.0, 0.8, 1.2]);
        assert_eq!(decided(vec![sure], 0.01, false), (Cause::Gel, vec![]));
    }

    #[test]
    fn a_radius_counts_as_far_as_it_was_seen() {
        let list = || {
            let force = tried(Change::Force { factor: 1.2 }, [1.2, 1.0, 1.1, 0.9, 1.3]);
            vec![tried(gel(), [0.9, 1.1, 1.0, 0.8, 1.2]), force]
        };
        // Within what marks are unsure by there is no question of it.
        assert_eq!(decided(list(), 0.03, false), (Cause::Gel, vec![]));
        assert_eq!(decided(list(), 0.15, false), (Cause::Gel, vec![Cause::Force]));
        assert_eq!(decided(list(), 0.15, true), (Cause::Force, vec![Cause::Gel]));
        // Contacts of another size, and images that need nothing else.
        let little = tried(gel(), [0.1, 0.2, 0.1, 0.3, 0.2]);
        let force = tried(Change::Force { factor: 1.2 }, [0.1, 0.3, 0.1, 0.2, 0.2]);
        assert_eq!(decided(vec![little, force], 0.08, false), (Cause::Gel, vec![Cause::Force]));
        let alone = tried(Change::Force { factor: 1.2 }, [0.1, 0.0, 0.1, 0.1, 0.0]);
        assert_eq!(decided(vec![alone], 0.15, false).0, Cause::Force);
    }
}
