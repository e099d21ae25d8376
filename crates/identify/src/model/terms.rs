//! What competes: effects of the library, curves in columns, pairs of columns, each with what is believed of it before the pulls.

use super::features::{PairSum, of_column, of_pair, of_parts};
use super::gaussian::{Block, SdPrior};
use super::labels::LabelCurves;
use crate::pulls::candidates::Candidate;
use crate::pulls::curves::{CLOCKS, SESSION};
use crate::pulls::data::{Column, PullData};
use gripgen_twin::predict::{ModelEffect, PredictPulls};
use nalgebra::DMatrix;

/// How far an effect or a curve moves labels, root mean square of the logarithm.
pub(super) const SIZE: SdPrior = SdPrior { median: 0.06, spread: 1.0 };
/// Number of names, columns and pairs of columns that act in a campaign, expected before it is looked at.
pub(super) const EXPECTED: Expected = Expected { names: 0.25, columns: 0.06, pairs: 0.04 };
/// Logarithm of the prior odds of an effect with a separate size per part.
const OF_EACH_PART: f64 = -2.0;
/// A column that moves labels by less than this is none.
const LEAST: f64 = 1e-5;
/// Pulls from which on two columns are looked at together.
const MIN_OF_PAIR: usize = 40;

pub(super) struct Expected {
    names: f64,
    pub(super) columns: f64,
    pairs: f64,
}

/// What a term is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// An effect of the library, by position among the candidates.
    Effect(usize),
    /// The same with a separate size per part.
    EffectOfParts(usize),
    /// A curve in a column.
    Column(String),
    /// A curve in a column for each part.
    ColumnOfParts(String),
    /// Two columns together.
    Pair(String, String),
}

/// Where the column of an effect was worked out.
#[derive(Debug, Clone)]
pub(super) struct At {
    /// Values of the effect.
    pub(super) values: Vec<f64>,
    /// By how much they move labels, root mean square about the mean of each part.
    pub(super) rms: f64,
    /// That mean.
    pub(super) means: Vec<f64>,
}

/// A form that a term may have.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) block: Block,
    /// Of an effect.
    pub(super) at: Option<At>,
    /// Of two columns of numbers.
    pub(super) sum: Option<PairSum>,
}

/// Something that may be added to a model.
#[derive(Debug, Clone)]
pub(super) struct Term {
    pub(super) kind: Kind,
    pub(super) log_prior: f64,
    /// One of them acts, each as likely as the others.
    pub(super) shapes: Vec<Shape>,
}

impl Term {
    pub(super) fn is_effect(&self) -> bool {
        matches!(self.kind, Kind::Effect(_) | Kind::EffectOfParts(_))
    }
}

/// The column of an effect at some values, less its mean in each part, of root mean square 1; `None` where it does nothing.
pub(super) fn effect_shape(
    data: &PullData<'_>,
    curves: &LabelCurves,
    predictor: &dyn PredictPulls,
    candidate: &Candidate,
    values: Vec<f64>,
    z: &[f64],
) -> Option<Shape> {
    let raw = curves.column(predictor, &ModelEffect::new(candidate.spec, values.clone()), z);
    if raw.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let silent = |i: usize| {
        candidate.spec.covariates.iter().any(|c| data.missing.get(*c).is_some_and(|rows| rows.contains(&i)))
    };
    let mut sums = vec![(0.0, 0.0_f64); data.parts.len()];
    for (i, x) in raw.iter().enumerate().filter(|(i, _)| !silent(*i)) {
        let own = &mut sums[data.part_of[i]];
        *own = (own.0 + x, own.1 + 1.0);
    }
    let mean = |part: usize| sums[part].0 / sums[part].1.max(1.0);
    let own = |i: usize| if silent(i) { 0.0 } else { raw[i] - mean(data.part_of[i]) };
    let column: Vec<f64> = (0..raw.len()).map(own).collect();
    let rms = (column.iter().map(|x| x * x).sum::<f64>() / raw.len() as f64).sqrt();
    if rms < LEAST {
        return None;
    }
    let features = DMatrix::from_fn(raw.len(), 1, |i, _| column[i] / rms);
    let range = range_of(candidate, &values, rms);
    let means = (0..sums.len()).map(mean).collect();
    Some(Shape { block: Block { features, sd: SIZE, range }, at: Some(At { values, rms, means }), sum: None })
}

/// Bounds of the size of an effect.
pub(super) fn bounds_of(candidate: &Candidate, values: &[f64]) -> (f64, f64) {
    let p = &candidate.spec.parameters[candidate.size()];
    candidate.spec.pulls.map_or(p.bounds, |fit| (fit.bounds)(p.name, values, p.bounds))
}

/// Where the coefficient of a column of this root mean square may lie, so that the size stays in its bounds.
fn range_of(candidate: &Candidate, values: &[f64], rms: f64) -> Option<(f64, f64)> {
    let (low, high) = bounds_of(candidate, values);
    let neutral = candidate.spec.parameters[candidate.size()].neutral;
    let share = |bound: f64| rms * (bound - neutral) / (values[candidate.size()] - neutral);
    let (a, b) = (share(low), share(high));
    Some((a.min(b), a.max(b)))
}

/// Values of an effect whose column is worked out: those of a start, with a size that is not nothing.
fn sized(candidate: &Candidate, start: &[f64]) -> Vec<f64> {
    let mut values = start.to_vec();
    let i = candidate.size();
    let neutral = candidate.spec.parameters[i].neutral;
    if values[i] == neutral {
        let scale = candidate.free.first().map_or(1.0, |f| f.1);
        let (low, high) = bounds_of(candidate, start);
        values[i] = if neutral + scale <= high { neutral + scale } else { (neutral - scale).max(low) };
    }
    values
}

/// Columns that may act on friction: those with more than one value, words often enough.
pub(super) fn usable_columns<'d>(data: &'d PullData<'_>) -> Vec<&'d str> {
    let usable = |(name, column): &(&String, &Column)| {
        let words = matches!(column, Column::Word(..));
        let distinct = column.distinct();
        *name != "part" && *name != SESSION && distinct > 1 && (!words || distinct * 4 <= data.len())
    };
    data.columns.iter().filter(usable).map(|(name, _)| name.as_str()).collect()
}

/// All terms that these pulls can show.
pub(super) fn all_terms(
    data: &PullData<'_>,
    curves: &LabelCurves,
    predictor: &dyn PredictPulls,
    candidates: &[Candidate],
    z: &[f64],
) -> Vec<Term> {
    let mut terms = Vec::new();
    let name = libm::log(EXPECTED.names / candidates.len().max(1) as f64);
    for (i, candidate) in candidates.iter().enumerate() {
        let mut shapes: Vec<Shape> = Vec::new();
        for start in &candidate.starts {
            let values = sized(candidate, start);
            // A size of the other sign is the same column.
            let alike = |shape: &Shape| {
                let other = shape.at.as_ref().map(|at| at.values.clone()).unwrap_or_default();
                let size = candidate.size();
                let neutral = candidate.spec.parameters[size].neutral;
                (0..other.len()).all(|k| {
                    if k == size {
                        (other[k] - neutral).abs() == (values[k] - neutral).abs()
                    } else {
                        other[k] == values[k]
                    }
                })
            };
            if !shapes.iter().any(alike) {
                shapes.extend(effect_shape(data, curves, predictor, candidate, values, z));
            }
        }
        if shapes.is_empty() {
            continue;
        }
        if data.parts.len() > 1 {
            let apart = |shape: &Shape| {
                let column = shape.block.features.column(0);
                let features = DMatrix::from_fn(data.len(), data.parts.len(), |i, part| {
                    if data.part_of[i] == part { column[i] } else { 0.0 }
                });
                Shape { block: Block { features, ..shape.block.clone() }, at: shape.at.clone(), sum: None }
            };
            let shapes = shapes.iter().map(apart).collect();
            terms.push(Term { kind: Kind::EffectOfParts(i), log_prior: name + OF_EACH_PART, shapes });
        }
        terms.push(Term { kind: Kind::Effect(i), log_prior: name, shapes });
    }
    let n = data.len();
    let columns = usable_columns(data);
    let one = libm::log(EXPECTED.columns / columns.len().max(1) as f64);
    let block = |features| Shape { block: Block { features, sd: SIZE, range: None }, at: None, sum: None };
    for name in &columns {
        let shapes = of_column(data, name, CLOCKS.contains(name));
        let shapes: Vec<Shape> = shapes.into_iter().map(block).collect();
        terms.push(Term { kind: Kind::Column((*name).into()), log_prior: one, shapes });
    }
    let parts = data.parts.len() > 1;
    let pairs = columns.len() * columns.len().saturating_sub(1) / 2 + if parts { columns.len() } else { 0 };
    let two = libm::log(EXPECTED.pairs / pairs.max(1) as f64);
    if parts {
        for name in &columns {
            let shapes = of_parts(data, name).into_iter().map(block).collect();
            terms.push(Term { kind: Kind::ColumnOfParts((*name).into()), log_prior: two, shapes });
        }
    }
    if n >= MIN_OF_PAIR {
        for (k, a) in columns.iter().enumerate() {
            for b in &columns[k + 1..] {
                if let Some(pair) = of_pair(data, a, b) {
                    let kind = Kind::Pair((*a).into(), (*b).into());
                    let shapes = vec![Shape { sum: pair.sum, ..block(pair.features) }];
                    terms.push(Term { kind, log_prior: two, shapes });
                }
            }
        }
    }
    terms.retain(|term| !term.shapes.is_empty());
    terms
}
