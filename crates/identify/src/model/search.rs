//! The search for the model: terms are added, exchanged and dropped while the score rises, the logarithm of evidence and prior.

use super::features::memory;
use super::gaussian::{Block, Gaussian, Measured, NoisePriors, SdPrior, log_mean};
use super::terms::{Kind, Term};
use crate::pulls::data::PullData;
use nalgebra::DMatrix;

/// What is believed of scatter and noise.
pub(super) const NOISE: NoisePriors = NoisePriors {
    scatter: SdPrior { median: 0.03, spread: 0.7 },
    reading: SdPrior { median: 0.12, spread: 0.8 },
};
/// Friction of a part: a factor of seven either way.
const PART: SdPrior = SdPrior { median: 2.0, spread: 0.0 };
/// What sessions and neighbours share.
const OF_SESSION: SdPrior = SdPrior { median: 0.012, spread: 0.5 };
const OF_MEMORY: SdPrior = SdPrior { median: 0.012, spread: 0.6 };
/// Pulls over which a session forgets.
const MEMORY: f64 = 3.0;

/// An outlier has this many times the deviation, and this share of all pulls are outliers.
const OUTLIER: f64 = 8.0;
const OUTLIERS: f64 = 0.02;
/// Outliers at most, as a share of the pulls.
const MOST_OUTLIERS: f64 = 0.03;

/// Terms at most, and names among them.
const MAX_TERMS: usize = 6;
const MAX_NAMES: usize = 3;
/// Terms that are fitted after a screening, and how far below the best they may lie.
const FITTED: usize = 6;
const WITHIN: f64 = 6.0;
/// Terms that are fitted in the place of each.
const IN_PLACE: usize = 8;
/// Rounds in which terms are exchanged.
const EXCHANGES: usize = 2;
/// A score has to rise by this.
const RISES: f64 = 1e-6;

/// A term of a model: which, in which shape, and what choosing the shape cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chosen {
    pub(super) term: usize,
    pub(super) shape: usize,
    pub(super) cost: f64,
}

/// A model with its fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) chosen: Vec<Chosen>,
    /// What is added for prediction alone.
    pub(super) process: Vec<Block>,
    pub(super) gaussian: Gaussian,
    pub(super) score: f64,
}

/// What may stand in the place of a term, with the weight of each; `None` is nothing.
pub(super) type Pool = Vec<(Option<Chosen>, Fit, f64)>;

/// Pulls and what may explain them.
#[derive(Clone)]
pub(super) struct Search {
    pub(super) measured: Measured,
    pub(super) terms: Vec<Term>,
    /// What is always there: parts, sessions, memory.
    base: Vec<Block>,
    pub(super) session: Option<usize>,
}

impl Search {
    pub(super) fn new(data: &PullData<'_>, measured: Measured, terms: Vec<Term>) -> Self {
        let n = data.len();
        let indicators =
            |of: &[usize], count: usize| DMatrix::from_fn(n, count, |i, k| f64::from(u8::from(of[i] == k)));
        let block = |features, sd| Block { features, sd, range: None };
        let mut base = vec![block(indicators(&data.part_of, data.parts.len()), PART)];
        let sessions = data.session_of.iter().max().map_or(0, |m| m + 1);
        let session = (sessions > 1).then_some(base.len());
        if sessions > 1 {
            base.push(block(indicators(&data.session_of, sessions), OF_SESSION));
        }
        if n > 3 * data.parts.len() + 6 {
            base.push(block(memory(&data.session_of, MEMORY), OF_MEMORY));
        }
        Self { measured, terms, base, session }
    }

    /// Position of the block of a chosen term.
    pub(super) fn block_of(&self, place: usize) -> usize {
        self.base.len() + place
    }

    /// What parts and terms say of the friction in each label. Effects of the sensor are worked out there and not at the label itself, whose
    /// noise they would explain.
    pub(super) fn explained(&self, fit: &Fit) -> Vec<f64> {
        let mut z = fit.gaussian.part(0);
        let own = fit.chosen.len() + fit.process.len();
        (0..own).for_each(|place| z += fit.gaussian.part(self.block_of(place)));
        z.iter().copied().collect()
    }

    fn fit(&self, chosen: Vec<Chosen>, from: Option<&Gaussian>) -> Option<Fit> {
        self.fit_with(chosen, vec![], from)
    }

    fn fit_with(&self, chosen: Vec<Chosen>, process: Vec<Block>, from: Option<&Gaussian>) -> Option<Fit> {
        let own = chosen.iter().map(|c| &self.terms[c.term].shapes[c.shape].block);
        let blocks: Vec<&Block> = self.base.iter().chain(own).chain(&process).collect();
        let gaussian = Gaussian::fit(&self.measured, &blocks, NOISE, from)?;
        let prior: f64 = chosen.iter().map(|c| self.terms[c.term].log_prior + c.cost).sum();
        let score = gaussian.log_evidence + prior;
        Some(Fit { chosen, process, gaussian, score })
    }

    /// Without any term.
    pub(super) fn plain(&self) -> Option<Fit> {
        self.fit(vec![], None)
    }

    /// Widens the pulls that the full additive model, every curve in it, cannot explain. Returns what that model says of each pull.
    pub(super) fn widen_outliers(&mut self) -> Option<Vec<f64>> {
        let most = (MOST_OUTLIERS * self.measured.z.len() as f64).floor() as usize;
        let mut said = None;
        for _ in 0..2 {
            let curves =
                self.terms.iter().filter(|t| matches!(t.kind, Kind::Column(_) | Kind::ColumnOfParts(_)));
            let own = curves.filter_map(|t| t.shapes.get(1).or(t.shapes.first())).map(|s| &s.block);
            let blocks: Vec<&Block> = self.base.iter().chain(own).collect();
            let full = Gaussian::fit(&self.measured, &blocks, NOISE, None)?;
            let left = full.left_out();
            // The mixture of both deviations: where an outlier is the likelier one.
            let ratio = libm::log((1.0 - OUTLIERS) * OUTLIER / OUTLIERS);
            let beyond = (2.0 * ratio / (1.0 - 1.0 / (OUTLIER * OUTLIER))).sqrt();
            let mut far: Vec<(f64, usize)> = left
                .iter()
                .zip(&self.measured.wider)
                .map(|(t, w)| t.abs() * w.sqrt())
                .zip(0..)
                .filter(|(t, _)| *t > beyond)
                .collect();
            far.sort_by(|a, b| b.0.total_cmp(&a.0));
            self.measured.wider.fill(1.0);
            far.iter().take(most).for_each(|(_, i)| self.measured.wider[*i] = OUTLIER * OUTLIER);
            said = Some((&self.measured.z - &full.residual).iter().copied().collect());
        }
        said
    }

    /// Whether a term may be added to others: no effect twice, no column twice.
    fn may_join(&self, term: usize, others: &[Chosen]) -> bool {
        let names = others.iter().filter(|c| self.terms[c.term].is_effect()).count();
        let own = &self.terms[term];
        if own.is_effect() && names >= MAX_NAMES {
            return false;
        }
        let same = |a: &Kind, b: &Kind| match (a, b) {
            (Kind::Effect(i) | Kind::EffectOfParts(i), Kind::Effect(k) | Kind::EffectOfParts(k)) => i == k,
            (Kind::Column(a) | Kind::ColumnOfParts(a), Kind::Column(b) | Kind::ColumnOfParts(b)) => a == b,
            (a, b) => a == b,
        };
        others.iter().all(|c| !same(&self.terms[c.term].kind, &own.kind))
    }

    /// The terms that may be added to a model, best first: which shape, and the score that a screening promises.
    fn screened(&self, fit: &Fit) -> Vec<(f64, Chosen)> {
        let mut found: Vec<(f64, Chosen)> = Vec::new();
        for (term, own) in self.terms.iter().enumerate() {
            if !self.may_join(term, &fit.chosen) {
                continue;
            }
            let each: Vec<f64> = own.shapes.iter().map(|s| fit.gaussian.screen(&s.block)).collect();
            let Some((shape, best)) = each
                .iter()
                .copied()
                .enumerate()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, b)| b.is_finite())
            else {
                continue;
            };
            let mean = log_mean(&each);
            found.push((mean + own.log_prior, Chosen { term, shape, cost: mean - best }));
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found
    }

    /// Fits of a model with one more term, the most promising few.
    fn with_one_more(&self, fit: &Fit, count: usize) -> Vec<Fit> {
        let screened = self.screened(fit);
        let Some(best) = screened.first().map(|s| s.0) else { return vec![] };
        let near = screened.into_iter().take(count).filter(|(promised, _)| *promised > best - WITHIN);
        let added = |(_, chosen): (f64, Chosen)| {
            let all = [&fit.chosen[..], &[chosen]].concat();
            self.fit(all, Some(&fit.gaussian))
        };
        near.filter_map(added).collect()
    }

    /// A model without one of its terms.
    pub(super) fn without(&self, fit: &Fit, place: usize) -> Option<Fit> {
        let mut chosen = fit.chosen.clone();
        chosen.remove(place);
        self.fit(chosen, None)
    }

    /// A model with some of its terms.
    pub(super) fn only(&self, fit: &Fit, stay: &[bool]) -> Option<Fit> {
        let chosen = fit.chosen.iter().zip(stay).filter(|(_, stay)| **stay).map(|(c, _)| *c).collect();
        self.fit(chosen, None)
    }

    fn best(fits: Vec<Fit>) -> Option<Fit> {
        fits.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// The model with the highest score that is found from a start.
    pub(super) fn run(&self, start: Fit) -> Fit {
        let mut now = self.exchanged(start);
        while now.chosen.len() < MAX_TERMS {
            match Self::best(self.with_one_more(&now, FITTED)) {
                Some(next) if next.score > now.score + RISES => now = next,
                _ => break,
            }
            for _ in 0..EXCHANGES {
                let before = now.score;
                now = self.exchanged(now);
                if now.score <= before + RISES {
                    break;
                }
            }
        }
        now
    }

    /// Tries every other term, and nothing, in the place of each.
    fn exchanged(&self, mut now: Fit) -> Fit {
        for place in (0..now.chosen.len()).rev() {
            if place >= now.chosen.len() {
                continue;
            }
            let Some(fewer) = self.without(&now, place) else { continue };
            let others = self.with_one_more(&fewer, FITTED);
            if let Some(better) =
                Self::best([vec![fewer], others].concat()).filter(|best| best.score > now.score + RISES)
            {
                now = better;
            }
        }
        now
    }

    /// What may stand in the place of a term, nothing among it, with weights.
    pub(super) fn pool(&self, fit: &Fit, place: usize) -> Pool {
        let own = fit.chosen[place];
        let mut pool: Vec<(Option<Chosen>, Fit)> = vec![(Some(own), fit.clone())];
        if let Some(fewer) = self.without(fit, place) {
            for other in self.with_one_more(&fewer, IN_PLACE) {
                let last = other.chosen[other.chosen.len() - 1];
                if last.term != own.term {
                    pool.push((Some(last), other));
                }
            }
            pool.push((None, fewer));
        }
        let most = pool.iter().map(|(_, f)| f.score).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = pool.iter().map(|(_, f)| libm::exp(f.score - most)).sum();
        pool.into_iter()
            .map(|(c, f)| {
                let w = libm::exp(f.score - most) / sum;
                (c, f, w)
            })
            .collect()
    }

    /// The same terms fitted again, after a shape or the labels changed.
    pub(super) fn refitted(&self, fit: &Fit) -> Option<Fit> {
        self.fit_with(fit.chosen.clone(), fit.process.clone(), Some(&fit.gaussian))
    }

    /// The same without what some of the pulls show.
    pub(super) fn without_rows(&self, rows: &[usize]) -> Self {
        let mut rest = self.clone();
        rows.iter().for_each(|&row| rest.measured.wider[row] = f64::INFINITY);
        rest
    }

    /// A fit with further blocks for prediction.
    pub(super) fn with_process(&self, fit: &Fit, process: Vec<Block>) -> Option<Fit> {
        self.fit_with(fit.chosen.clone(), process, Some(&fit.gaussian))
    }
}
