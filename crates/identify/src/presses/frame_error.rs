//! Errors over whole frames, at the resolution of the images: what a comparison with the twin says. Names were found at some pixels, with
//! zones that count alike; one that makes the frames of presses that were held out worse is no name.

use super::observed::Observed;
use super::score::{differences, left_out};
use super::search::Found;
use crate::Hint;

/// The error of each press over its whole frame.
pub(super) struct FrameErrors {
    pub(super) before: Vec<f64>,
    /// Held out in folds that were drawn.
    pub(super) after: Vec<f64>,
    /// Held out in blocks of neighbours.
    pub(super) after_blocks: Vec<f64>,
}

/// Takes the effects away that whole frames do not bear out, the one of the least gain first, and gives the errors with what stays.
pub(super) fn borne_out(observed: &Observed<'_>, found: &mut Found) -> FrameErrors {
    let before = observed.for_each(observed.count(), |i| observed.predictor.frame_mse(i, &[]));
    let mut after = held_out(observed, found, &before, &found.design.folds);
    while !found.model.acting.is_empty() && mean(&after) > mean(&before) {
        let worse = mean(&after) / mean(&before);
        let least = found.gains.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(e, _)| e);
        let dropped = drop_effect(observed, found, least);
        found.hints.insert(0, Hint {
            name: dropped.into(),
            gain: 0.0,
            reason: format!(
                "it explains the pixels that were looked at, but whole frames that were held out become worse, by {:.0} %",
                100.0 * (worse - 1.0)
            ),
        });
        after = held_out(observed, found, &before, &found.design.folds);
    }
    let after_blocks = held_out(observed, found, &before, &found.design.blocks);
    FrameErrors { before, after, after_blocks }
}

/// Leaves an effect out and fits the others again; its id.
fn drop_effect(observed: &Observed<'_>, found: &mut Found, e: usize) -> &'static str {
    let dropped = found.model.acting[e].spec.id;
    found.rivals.remove(e);
    found.gains.remove(e);
    found.model = left_out(observed, &found.design, &found.model.acting, e);
    for (e, gain) in found.gains.iter_mut().enumerate() {
        let without = left_out(observed, &found.design, &found.model.acting, e);
        *gain = found.design.mean(&differences(&without.held_out, &found.model.held_out)).0;
    }
    found.cost = found.design.mean(&found.model.held_out).0;
    dropped
}

fn held_out(observed: &Observed<'_>, found: &Found, before: &[f64], folds: &[usize]) -> Vec<f64> {
    if found.model.acting.is_empty() && found.scatter.named.is_none() {
        return before.to_vec();
    }
    let mut by_fold = found.model.by_fold(&found.design.weights, folds);
    by_fold.iter_mut().for_each(|acting| *acting = found.scatter.beside(std::mem::take(acting)));
    observed.for_each(before.len(), |i| observed.predictor.frame_mse(i, &by_fold[folds[i]]))
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}
