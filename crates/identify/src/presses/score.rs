//! Candidates fitted and scored on presses that their fit has not seen.

use super::candidates::{is_drawn, tried};
use super::model::{Head, NamedModel};
use super::observed::Observed;
use super::predict::ActingEffect;
use crate::{
    FreeParameter, GroupMoments, GroupedFit, GroupedModel, fit_grouped, fold_steps, grouped_step,
    held_out_costs,
};
use gripgen_twin::effects::EffectSpec;
use gripgen_twin::random::splitmix64;
use gripgen_twin::values::median;

/// A gain of less than this share of the error is no effect, however surely it is there: every sensor file misfits its
/// own presses by some of everything.
pub(super) const MATERIAL: f64 = 0.02;

/// Gains are this many standard errors above 0 at least.
pub(super) const SURE: f64 = 3.0;

/// Steps of a fit at most.
const MAX_STEPS: usize = 4;

/// Presses before and after a change of background at least.
const MIN_PRESSES_PER_SIDE: usize = 2;

/// Finer terms of an effect lower the error by this share at least.
const FINER: f64 = 0.01;

/// Presses, how much each counts, and which are held out together.
#[derive(Debug, Clone)]
pub(super) struct Design {
    pub(super) weights: Vec<f64>,
    /// Drawn.
    pub(super) folds: Vec<usize>,
    /// Neighbours in order.
    pub(super) blocks: Vec<usize>,
}

impl Design {
    pub(super) fn new(n: usize) -> Self {
        let k = if n < 12 { n } else { 6 };
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&i| hash(i as u64));
        let mut folds = vec![0; n];
        order.iter().enumerate().for_each(|(place, &i)| folds[i] = place % k.max(1));
        let blocks = (0..n).map(|i| i * k.min(6) / n.max(1)).collect();
        Self { weights: vec![1.0; n], folds, blocks }
    }

    /// Weights that keep single presses from deciding.
    pub(super) fn reweigh(&mut self, costs: &[f64]) {
        let median = median(costs.to_vec()).unwrap_or(1.0).max(1e-12);
        self.weights = costs.iter().map(|c| (6.0 * median / c.max(1e-12)).min(1.0)).collect();
    }

    /// Weighted mean over the presses and its standard error.
    pub(super) fn mean(&self, values: &[f64]) -> (f64, f64) {
        let sum: f64 = self.weights.iter().sum();
        let mean = values.iter().zip(&self.weights).map(|(v, w)| v * w).sum::<f64>() / sum;
        let squares: f64 = values.iter().zip(&self.weights).map(|(v, w)| (w * (v - mean)).powi(2)).sum();
        let n = values.len() as f64;
        (mean, (squares * n / (n - 1.0).max(1.0)).sqrt() / sum)
    }

    /// Standard error of the mean where presses are of two kinds: what they scatter about the mean of their kind.
    pub(super) fn error_by_kind(&self, values: &[f64], kinds: &[bool]) -> f64 {
        let sum: f64 = self.weights.iter().sum();
        let of = |kind: bool| {
            let own: Vec<(f64, f64)> = values
                .iter()
                .zip(&self.weights)
                .zip(kinds)
                .filter(|(_, k)| **k == kind)
                .map(|((v, w), _)| (*v, *w))
                .collect();
            let total: f64 = own.iter().map(|(_, w)| w).sum();
            let mean = own.iter().map(|(v, w)| v * w).sum::<f64>() / total.max(1e-12);
            let n = own.len() as f64;
            own.iter().map(|(v, w)| (w * (v - mean)).powi(2)).sum::<f64>() * n / (n - 1.0).max(1.0)
        };
        (of(true) + of(false)).sqrt() / sum
    }
}

/// Random bits that are a function of `i` alone.
pub(super) fn hash(i: u64) -> u64 {
    splitmix64(&mut i.wrapping_add(6).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// How one candidate did.
#[derive(Debug, Clone, PartialEq)]
pub struct PressTrial {
    /// Round of the search, from 0 on; curves without a name come in a round of their own after the others.
    pub round: usize,
    /// Id of the effect, or `curve in` with the name of the covariate.
    pub name: String,
    /// What the mean held-out cost falls by; 1 is what the zones had before this round.
    pub gain: f64,
    /// Standard error of the gain over the presses.
    pub standard_error: f64,
    /// Mean held-out cost with the candidate.
    pub cost: f64,
    /// Fitted values, for people; at most five.
    pub values: String,
}

/// A set of effects, fitted and scored.
#[derive(Debug, Clone)]
pub(super) struct Scored {
    pub(super) acting: Vec<ActingEffect>,
    pub(super) free: Vec<(usize, usize)>,
    pub(super) parameters: Vec<FreeParameter>,
    pub(super) fit: GroupedFit,
    /// Cost of each press under a fit without its fold.
    pub(super) held_out: Vec<f64>,
}

impl Scored {
    /// The effects as the fit without each fold has them.
    pub(super) fn by_fold(&self, weights: &[f64], folds: &[usize]) -> Vec<Vec<ActingEffect>> {
        fold_steps(&self.parameters, &self.fit, weights, folds)
            .iter()
            .map(|step| {
                let mut acting = self.acting.clone();
                for (k, &(e, j)) in self.free.iter().enumerate() {
                    acting[e].values[j] = self.fit.values[k] + step[k];
                }
                acting
            })
            .collect()
    }
}

/// Fits and scores a set of effects together.
pub(super) fn scored(observed: &Observed<'_>, design: &Design, acting: Vec<ActingEffect>) -> Scored {
    if acting.is_empty() {
        let costs = NamedModel::new(observed, acting).moments_alone();
        let moments = costs.iter().map(|&cost| GroupMoments { cost, ..GroupMoments::zero(0) }).collect();
        let fit = GroupedFit { values: Vec::new(), moments };
        return Scored { acting: Vec::new(), free: Vec::new(), parameters: Vec::new(), fit, held_out: costs };
    }
    let model = NamedModel::new(observed, acting);
    let fit = fit_grouped(&model.parameters, MAX_STEPS, &design.weights, &model);
    let held_out = held_out_costs(&model.parameters, &fit, &design.weights, &design.folds);
    Scored { acting: model.at(&fit.values), free: model.free, parameters: model.parameters, fit, held_out }
}

/// A set of effects without one of them.
pub(super) fn left_out(
    observed: &Observed<'_>,
    design: &Design,
    acting: &[ActingEffect],
    e: usize,
) -> Scored {
    let mut rest = acting.to_vec();
    rest.remove(e);
    scored(observed, design, rest)
}

/// Differences press by press.
pub(super) fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// What costs fall by, press by press, as shares of both: 1 where all of it goes, 0 where nothing does.
pub(super) fn shares(before: &[f64], after: &[f64]) -> Vec<f64> {
    before.iter().zip(after).map(|(b, a)| (b - a) / (b + a).max(1e-300)).collect()
}

/// What a candidate is added to: accepted effects with what their parameters do.
pub(super) struct Base<'a> {
    pub(super) acting: &'a [ActingEffect],
    pub(super) held_out: &'a [f64],
    pub(super) head: Head,
}

impl<'a> Base<'a> {
    pub(super) fn new(observed: &Observed<'_>, scored: &'a Scored) -> Self {
        let head = Head::new(observed, &scored.acting);
        Self { acting: &scored.acting, held_out: &scored.held_out, head }
    }
}

/// The accepted effects with one more, which alone is fitted; the others follow to first order. `least`: a gain that
/// would count; a candidate whose first step does not show it is not drawn for a fit. A change of background is tried
/// from every press on, and with finer terms as long as they predict better.
pub(super) fn with(
    observed: &Observed<'_>,
    design: &Design,
    base: &Base<'_>,
    spec: &'static EffectSpec,
    least: f64,
) -> Scored {
    let mut acting = base.acting.to_vec();
    acting.push(ActingEffect::start(spec, observed.predictor.px_mm()));
    if let Some(at) = tried(spec) {
        let place = step_place(observed, design, &acting, at);
        if let Some(last) = acting.last_mut() {
            last.values[at] = place;
        }
    }
    let mut best = fitted_behind(observed, design, base, acting, least);
    for &order in spec.presses.iter().flat_map(|fit| fit.orders).skip(1) {
        let mut acting = best.acting.clone();
        if let Some(last) = acting.last_mut() {
            last.fitted = order;
        }
        let finer = fitted_behind(observed, design, base, acting, least);
        let (gain, error) = design.mean(&differences(&best.held_out, &finer.held_out));
        if gain < FINER * design.mean(&best.held_out).0 || gain < error {
            break;
        }
        best = finer;
    }
    best
}

/// The last of some effects fitted, those before it following to first order.
fn fitted_behind(
    observed: &Observed<'_>,
    design: &Design,
    base: &Base<'_>,
    acting: Vec<ActingEffect>,
    least: f64,
) -> Scored {
    let is_drawn = acting.last().is_some_and(|last| is_drawn(last.spec));
    let model = NamedModel::last(observed, acting);
    let (free, parameters) = model.behind(&base.head);
    let whole = |tail: &[f64]| -> GroupedFit {
        let values = base.head.values().chain(tail.iter().copied()).collect();
        GroupedFit { values, moments: model.moments_behind(&base.head, tail) }
    };
    let start: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
    let mut fit = whole(&start);
    let step = grouped_step(&parameters, &fit.values, &fit.moments, &design.weights);
    let reached: Vec<f64> = fit.moments.iter().map(|m| m.cost_after(&step)).collect();
    let promise = design.mean(&differences(base.held_out, &reached)).0;
    let known = base.head.values().count();
    let mut values: Vec<f64> = (known..fit.values.len()).map(|k| fit.values[k] + step[k]).collect();
    if !is_drawn || promise > least {
        let found = fit_grouped(&model.parameters, MAX_STEPS, &design.weights, &model);
        fit = whole(&found.values);
        values = found.values;
    }
    let held_out = held_out_costs(&parameters, &fit, &design.weights, &design.folds);
    Scored { acting: model.at(&values), free, parameters, fit, held_out }
}

/// The pull index from which on the last effect of a model explains most, held out.
fn step_place(observed: &Observed<'_>, design: &Design, acting: &[ActingEffect], at: usize) -> f64 {
    let model = NamedModel::last(observed, acting.to_vec());
    let values: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
    let moments = GroupedModel::moments(&model, &values);
    let own = vec![true; model.free.len()];
    let n = moments.len();
    let index = |i: usize| observed.predictor.circumstances()[i].pull_index as f64;
    let neutral = acting.last().map_or(0.0, |a| a.spec.parameters[at].neutral);
    let places = std::iter::once(0)
        .chain(MIN_PRESSES_PER_SIDE..(n + 1).saturating_sub(MIN_PRESSES_PER_SIDE))
        .map(|first| {
            let masked: Vec<GroupMoments> = moments
                .iter()
                .enumerate()
                .map(|(i, m)| if i < first { without(m, &own) } else { m.clone() })
                .collect();
            let fit = GroupedFit { values: values.clone(), moments: masked };
            let costs = held_out_costs(&model.parameters, &fit, &design.weights, &design.folds);
            (first, design.mean(&costs).0)
        });
    let best = places.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(neutral, |(first, _)| if first == 0 { neutral } else { index(first) })
}

/// Moments of a press on which some parameters do not act.
fn without(moments: &GroupMoments, own: &[bool]) -> GroupMoments {
    let mut masked = moments.clone();
    for (k, _) in own.iter().enumerate().filter(|(_, own)| **own) {
        masked.gradient[k] = 0.0;
        masked.normal.row_mut(k).fill(0.0);
        masked.normal.column_mut(k).fill(0.0);
    }
    masked
}

impl NamedModel<'_> {
    fn moments_alone(&self) -> Vec<f64> {
        GroupedModel::costs(self, &[])
    }
}
