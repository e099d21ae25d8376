//! What was accepted, as far as held-out labels bear it out.

use super::fitting::Fitted;
use super::heldout::predicted;
use super::search::{Accepted, Search};
use super::worth::BAD;
use gripgen_twin::predict::PullPrediction;

/// Part of the squared error by which labels that no fit has seen may be predicted worse, by chance, with an effect that
/// shows in the traces only.
const WORSE: f64 = 1.03;

/// Standard deviations of labels, as a fit sees them.
pub(super) fn label_sd_n(fitted: &Fitted, predicted: &[PullPrediction]) -> Vec<f64> {
    let scale = fitted.likelihood.scale.max(0.1);
    predicted.iter().map(|p| (scale * scale * p.label_sd_n * p.label_sd_n + 0.03 * 0.03).sqrt()).collect()
}

/// What was accepted, as far as it does not predict labels worse that no fit has seen: the last term goes first.
pub(super) fn confirmed(
    search: &Search<'_>,
    before: &Fitted,
    mut accepted: Accepted,
    heldout_before: &[f64],
    repetitions: &[Vec<usize>],
) -> Accepted {
    let data = search.context.data;
    let sd_n = label_sd_n(before, &search.context.predictor.pulls(&before.model, &search.rows));
    // A few bad pulls decide nothing.
    let squares = |predicted: &[f64]| -> f64 {
        let each = data.label_n.iter().zip(predicted).zip(&sd_n).filter(|((_, p), _)| p.is_finite());
        each.map(|((l, p), sd)| ((l - p) / sd).powi(2).min(BAD * BAD)).sum()
    };
    loop {
        if accepted.effects.is_empty() && accepted.curves.is_empty() {
            return accepted;
        }
        let after = predicted(search.context, &accepted.fitted, repetitions, false);
        if squares(&after) <= WORSE * squares(heldout_before) {
            return accepted;
        }
        let mut fewer = accepted.fitted.terms.clone();
        if accepted.effects.len() > 1 || accepted.curves.is_empty() {
            if let Some((last, _)) = accepted.effects.pop() {
                fewer.effects.retain(|(c, _)| c.spec != search.candidates[last].spec);
            }
        } else {
            accepted.curves.pop();
            fewer.curves.pop();
        }
        let refitted = search.context.fit(&before.model, &fewer, &search.rows);
        accepted.fitted = refitted.unwrap_or_else(|| before.clone());
    }
}
