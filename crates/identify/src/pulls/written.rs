//! Fits as they are written, and their errors on held-out pulls, worked out once for each fit.

use super::context::Context;
use super::fitting::Fitted;
use super::heldout::predicted;
use gripgen_twin::predict::PullModel;
use std::sync::Mutex;

/// What a fit and all that follows from it depend on.
#[derive(Debug, PartialEq)]
struct Key {
    model: PullModel,
    names: Vec<String>,
    hold_signals: bool,
    learnt_share: f64,
    ends: Vec<Option<f64>>,
}

impl Key {
    fn of(fitted: &Fitted) -> Self {
        Self {
            model: fitted.model.clone(),
            names: fitted.names.clone(),
            hold_signals: fitted.terms.hold_signals,
            learnt_share: fitted.terms.learnt_share,
            ends: fitted.terms.effects.iter().map(|(c, _)| c.end).collect(),
        }
    }
}

/// Folds with the labels that were predicted for them.
type Predicted = (Vec<Vec<usize>>, Vec<f64>);

/// Fits as they are written and labels of held-out pulls, each with what it depends on.
#[derive(Default)]
pub struct Written<'a> {
    fits: Mutex<Vec<(Key, (Context<'a>, Fitted))>>,
    labels_n: Mutex<Vec<(Key, Predicted)>>,
}

impl<'a> Written<'a> {
    /// A fit as it is written into a twin, with the context that predicts it.
    pub(super) fn stated(&self, context: &Context<'a>, fitted: &Fitted) -> (Context<'a>, Fitted) {
        let key = Key::of(fitted);
        if let Ok(known) = self.fits.lock()
            && let Some((_, found)) = known.iter().find(|(k, _)| *k == key)
        {
            return found.clone();
        }
        let found = context.stated(fitted);
        if let Ok(mut known) = self.fits.lock() {
            known.push((key, found.clone()));
        }
        found
    }

    /// Errors on held-out labels of the twin that is written for a fit, by pull of `rows`. What traces show is held, which is fast.
    pub(super) fn held_out(
        &self,
        context: &Context<'a>,
        fitted: &Fitted,
        repetitions: &[Vec<usize>],
        rows: &[usize],
    ) -> Vec<(usize, f64)> {
        let labels_n = self.held_labels_n(context, fitted, repetitions);
        let errors = rows.iter().map(|&i| (i, labels_n[i] - context.data.label_n[i]));
        errors.filter(|(_, e)| e.is_finite()).collect()
    }

    fn held_labels_n(&self, context: &Context<'a>, fitted: &Fitted, repetitions: &[Vec<usize>]) -> Vec<f64> {
        let key = Key::of(fitted);
        if let Ok(known) = self.labels_n.lock()
            && let Some((_, (_, found))) =
                known.iter().find(|(k, (sets, _))| *k == key && sets == repetitions)
        {
            return found.clone();
        }
        let (context, stated) = self.stated(context, fitted);
        let found = predicted(&context, &stated, repetitions, !context.observations.is_empty());
        if let Ok(mut known) = self.labels_n.lock() {
            known.push((key, (repetitions.to_vec(), found.clone())));
        }
        found
    }
}
