//! Fits of all rivals beside a model.

use super::fitting::Fitted;
use super::power::ScoreTest;
use super::search::{Entry, ModelTerm, Search};
use super::terms::Terms;
use gripgen_twin::predict::PullModel;
use std::sync::Mutex;

/// Gain of log-likelihood that the slope at nothing has to promise for an effect on signals to be fitted, and for anything
/// beside such an effect: these fits are slow.
const MIN_PROMISE: f64 = 1.5;

const MIN_PROMISE_BESIDE: f64 = 2.5;

/// Entries within this score of the best, and how many at most, are fitted again with everything free.
const REFIT_WITHIN: f64 = 6.0;

const MAX_REFITS: usize = 6;

/// Fits from the last end of a range, and the gain from which on there is another.
const MORE_FITS: usize = 3;

const ENOUGH: f64 = 0.3;

/// Parts at most, and pulls of each at least, of an effect that differs by part.
const MAX_PARTS: usize = 6;

const MIN_PULLS_OF_PART: usize = 10;

impl Search<'_> {
    pub(super) fn score(&self, fitted: &Fitted) -> f64 {
        fitted.score(self.rows.len())
    }

    /// `terms` with one rival more, from all its starts; the best fit. `test` is a score test beside them.
    pub(super) fn with(
        &self,
        start: &PullModel,
        terms: &Terms,
        rival: &ModelTerm,
        test: &ScoreTest<'_>,
    ) -> Option<Fitted> {
        let slow = terms.act_on_signals();
        let mut best: Option<Fitted> = None;
        let keep = |fitted: Option<Fitted>, best: &mut Option<Fitted>| {
            if let Some(f) = fitted
                && best.as_ref().is_none_or(|b| self.score(&f) > self.score(b))
            {
                *best = Some(f);
            }
        };
        match rival {
            ModelTerm::Curve(i) => {
                let curve = &self.curves[*i];
                if slow && test.curve(curve) < MIN_PROMISE_BESIDE {
                    return None;
                }
                let mut terms = terms.clone();
                terms.hold_signals = slow;
                terms.curves.push((curve.clone(), vec![0.0; curve.len()]));
                keep(self.context.fit(start, &terms, &self.rows), &mut best);
            }
            ModelTerm::ByPart(i) => {
                let candidates = self.candidates[*i].by_part(&self.context.data.parts);
                for from in &self.candidates[*i].starts {
                    let mut terms = terms.clone();
                    terms.hold_signals = slow;
                    terms.effects.extend(candidates.iter().map(|c| (c.clone(), from.clone())));
                    keep(self.context.fit(start, &terms, &self.rows), &mut best);
                }
            }
            ModelTerm::Effect(i) => {
                let candidate = &self.candidates[*i];
                let least = match (slow, candidate.acts_on_signals()) {
                    (true, _) => MIN_PROMISE_BESIDE,
                    (false, true) => MIN_PROMISE,
                    (false, false) => 0.0,
                };
                for from in &candidate.starts {
                    if least > 0.0 && test.effect(candidate, from) < least {
                        continue;
                    }
                    let mut terms = terms.clone();
                    terms.hold_signals = slow && !candidate.acts_on_signals();
                    terms.effects.push((candidate.clone(), from.clone()));
                    keep(self.context.fit(start, &terms, &self.rows), &mut best);
                }
                // Far from its end the pulls beyond it drag the force loop along: once more from the end that was found, and the loop as it was.
                let more = if candidate.is_end_of_a_range() { MORE_FITS } else { 0 };
                for _ in 0..more {
                    let Some(last) = best.clone() else { break };
                    keep(self.context.fit(start, &last.terms, &self.rows), &mut best);
                    if best.as_ref().is_none_or(|b| self.score(b) < self.score(&last) + ENOUGH) {
                        break;
                    }
                }
            }
        }
        best
    }

    /// Fits `terms` with each rival added, best first. `done` is called after each.
    pub(super) fn compete(
        &self,
        before: &Fitted,
        terms: &Terms,
        rivals: &[ModelTerm],
        done: &(dyn Fn() + Sync),
    ) -> Vec<Entry> {
        let results: Vec<Mutex<Option<Fitted>>> = rivals.iter().map(|_| Mutex::new(None)).collect();
        let test = ScoreTest::new(self.context, &before.model, terms, &self.rows, true);
        self.context.predictor.for_each(rivals.len(), &|i| {
            let fitted = self.with(&before.model, terms, &rivals[i], &test);
            if let Ok(mut slot) = results[i].lock() {
                *slot = fitted;
            }
            done();
        });
        let old = self.score(before);
        let mut entries: Vec<Entry> = rivals
            .iter()
            .zip(results)
            .filter_map(|(rival, slot)| {
                let fitted = slot.into_inner().ok().flatten()?;
                let gain = self.score(&fitted) - old;
                Some(Entry { rival: rival.clone(), fitted, gain })
            })
            .collect();
        entries.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        self.refit(&mut entries, old);
        entries
    }

    /// Fits the best entries again with everything free, where signals were held.
    pub(super) fn refit(&self, entries: &mut [Entry], old: f64) {
        let Some(best) = entries.first().map(|e| e.gain) else { return };
        let held = |e: &Entry| e.fitted.terms.hold_signals && e.gain > best - REFIT_WITHIN && e.gain > 0.0;
        let chosen: Vec<usize> = (0..entries.len()).filter(|&k| held(&entries[k])).take(MAX_REFITS).collect();
        let results: Vec<Mutex<Option<Fitted>>> = chosen.iter().map(|_| Mutex::new(None)).collect();
        self.context.predictor.for_each(chosen.len(), &|i| {
            let entry = &entries[chosen[i]];
            let terms = Terms { hold_signals: false, ..entry.fitted.terms.clone() };
            if let Ok(mut slot) = results[i].lock() {
                *slot = self.context.fit(&entry.fitted.model, &terms, &self.rows);
            }
        });
        for (&k, slot) in chosen.iter().zip(results) {
            if let Some(fitted) = slot.into_inner().ok().flatten() {
                let gain = self.score(&fitted) - old;
                entries[k] = Entry { rival: entries[k].rival.clone(), fitted, gain };
            }
        }
        entries.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    }

    pub(super) fn all(&self, without: &[usize]) -> Vec<ModelTerm> {
        // The slow ones first, so that threads end together.
        let mut effects: Vec<usize> = (0..self.candidates.len()).filter(|i| !without.contains(i)).collect();
        effects.sort_by_key(|&i| !self.candidates[i].acts_on_signals());
        let differing: Vec<usize> = effects.iter().copied().filter(|&i| self.may_differ(i)).collect();
        effects
            .into_iter()
            .map(ModelTerm::Effect)
            .chain(differing.into_iter().map(ModelTerm::ByPart))
            .chain((0..self.curves.len()).map(ModelTerm::Curve))
            .collect()
    }

    /// Whether effect `i` may have other parameters for each part, and every part has pulls enough to show them.
    pub(super) fn may_differ(&self, i: usize) -> bool {
        let data = self.context.data;
        let parts = data.parts.len();
        let fewest = (0..parts).map(|p| data.part_of.iter().filter(|&&q| q == p).count()).min();
        (2..=MAX_PARTS).contains(&parts)
            && fewest >= Some(MIN_PULLS_OF_PART)
            && self.candidates[i].spec.per_part
    }

    /// A fit with everything free.
    pub(super) fn freed(&self, fitted: &Fitted) -> Fitted {
        if !fitted.terms.hold_signals {
            return fitted.clone();
        }
        let terms = Terms { hold_signals: false, ..fitted.terms.clone() };
        self.context.fit(&fitted.model, &terms, &self.rows).unwrap_or_else(|| fitted.clone())
    }
}
