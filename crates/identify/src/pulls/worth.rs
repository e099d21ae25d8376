//! Never worse: what was found is written only if it predicts held-out pulls as well as the recalibrated baseline does, both as they would be
//! written.

use super::paying::root_mean_square;
use super::search::{Accepted, Search};
use crate::diagnosis::Hint;

/// Errors on held-out pulls that differ by less are the same: an anisotropy with a chance of 0.0003 is not taken back for 0.03 % of them.
const SAME: f64 = 1.002;

/// Share of the error by which effects that traces show may miss the labels by chance.
const SHOWN_BY_TRACES: f64 = 1.02;

/// Standard deviations beyond which the error of a held-out pull counts no more.
pub(super) const BAD: f64 = 5.0;

/// Labels predicted for held-out pulls, before and after.
pub(super) struct HeldOut<'a> {
    /// By the recalibrated baseline.
    pub before_n: &'a [f64],
    /// By what was found.
    pub after_n: &'a [f64],
    /// Standard deviations of labels.
    pub sd_n: &'a [f64],
}

impl HeldOut<'_> {
    /// Root mean squares of both errors at `rows`; a few bad pulls decide nothing.
    fn errors_n(&self, label_n: &[f64], rows: &[usize]) -> [f64; 2] {
        let known = rows.iter().filter(|&&i| self.before_n[i].is_finite() && self.after_n[i].is_finite());
        let known: Vec<usize> = known.copied().collect();
        [self.before_n, self.after_n].map(|predicted| {
            let error =
                |&i: &usize| (predicted[i] - label_n[i]).clamp(-BAD * self.sd_n[i], BAD * self.sd_n[i]);
            root_mean_square(known.iter().map(error))
        })
    }
}

/// Why what was found is not written, if it predicts the pulls at `rows` worse.
pub(super) fn worse(
    search: &Search<'_>,
    accepted: &Accepted,
    held: &HeldOut<'_>,
    rows: &[usize],
) -> Option<String> {
    let [before, after] = held.errors_n(&search.context.data.label_n, rows);
    let signals = accepted.effects.iter().any(|(i, _)| search.candidates[*i].acts_on_signals());
    let most = if signals && !search.context.observations.is_empty() { SHOWN_BY_TRACES } else { SAME };
    (after > most * before).then(|| {
        format!("held-out pulls are predicted with an error of {after:.3} N with it, of {before:.3} N by the recalibrated baseline")
    })
}

/// Everything that was accepted, as hints.
pub(super) fn hints(search: &Search<'_>, accepted: &Accepted, reason: &str) -> Vec<Hint> {
    let effects = accepted.effects.iter().map(|(i, _)| search.candidates[*i].spec.id.to_string());
    let curves = accepted.curves.iter().map(|&k| search.curves[k].name.clone());
    effects.chain(curves).map(|name| Hint { name, gain: 0.0, reason: reason.into() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of 1 N before; after, 0.5 N but for one bad pull, which counts with five deviations, and one that nobody predicted, which does
    /// not count.
    #[test]
    fn errors_are_those_of_the_pulls_that_both_predict() {
        let label_n = [10.0; 5];
        let held = HeldOut {
            before_n: &[11.0, 9.0, 11.0, 9.0, 11.0],
            after_n: &[10.5, 9.5, 10.5, 90.0, f64::NAN],
            sd_n: &[0.4; 5],
        };
        let [before, after] = held.errors_n(&label_n, &[0, 1, 2, 3, 4]);
        assert!((before - 1.0).abs() < 1e-12, "{before}");
        assert!((after - ((3.0 * 0.25 + 4.0) / 4.0_f64).sqrt()).abs() < 1e-12, "{after}");
        let [before, after] = held.errors_n(&label_n, &[0, 1, 2]);
        assert!(after < before, "{before} {after}");
    }
}
