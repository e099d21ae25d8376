//! What may be missing: effects of the library on a grid of their inner parameter, and curves without a name.

use super::prepare::{Prepared, range};
use super::{SensorData, moments::Model};
use crate::permutation::Covariate;
use gripgen_twin::effects::{EffectSpec, FORCE_RATE, LIBRARY, REFERENCE_FORCE, SensorMemory, SensorPoint};

/// Effects that compete. Gain and bias are the baseline.
pub(crate) fn effects() -> impl Iterator<Item = &'static EffectSpec> {
    LIBRARY.iter().copied().filter(|spec| spec.table.is_some())
}

/// How a candidate enters the model at one point of its grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Change {
    /// Columns with a coefficient each; the value of the first lies within the bounds.
    Add(Vec<usize>, (f64, f64)),
    /// A column that is added to the force.
    Force(usize),
}

impl Change {
    pub fn on(&self, model: &Model) -> Model {
        match self {
            Change::Add(columns, _) => model.with(columns),
            Change::Force(column) => model.changed(*column),
        }
    }

    /// Columns with a coefficient.
    pub fn size(&self) -> usize {
        match self {
            Change::Add(columns, _) => columns.len(),
            Change::Force(_) => 0,
        }
    }
}

/// What a candidate is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    /// Of the library.
    Effect(&'static EffectSpec),
    /// A curve in this covariate.
    Curve(String),
}

/// One that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    pub kind: Kind,
    /// Points of the grid: inner parameter (by position) with its value, and the change.
    pub points: Vec<(Option<(usize, f64)>, Change)>,
}

impl Candidate {
    /// Id or covariate.
    pub fn name(&self) -> &str {
        match &self.kind {
            Kind::Effect(spec) => spec.id,
            Kind::Curve(covariate) => covariate,
        }
    }

    pub fn is_effect(&self) -> bool {
        matches!(self.kind, Kind::Effect(_))
    }

    /// Covariates through which an effect acts.
    pub fn acts_through(&self) -> &'static [&'static str] {
        match &self.kind {
            Kind::Effect(spec) => spec.table.map_or(&[], |fit| fit.acts_through),
            Kind::Curve(_) => &[],
        }
    }

    /// Whether a larger value of the first parameter is more of the effect: of a filter, and not of a limit, whose neutral
    /// value is the largest.
    pub fn grows_with_its_shape(&self) -> bool {
        match &self.kind {
            Kind::Effect(spec) => spec.parameters[0].neutral < spec.parameters[0].bounds.1,
            Kind::Curve(_) => true,
        }
    }
}

/// Reading of a chain of effects on the reference forces, each session from the start.
pub(crate) fn chain(prepared: &Prepared, effects: &[(&EffectSpec, &[f64])]) -> Vec<f64> {
    let mut memories = vec![SensorMemory::default(); effects.len()];
    (0..prepared.reference_n.len())
        .map(|i| {
            if i > 0 && prepared.session[i] != prepared.session[i - 1] {
                memories.fill(SensorMemory::default());
            }
            let at = SensorPoint {
                clock_s: prepared.clock_s[i],
                step_s: prepared.step_s[i],
                ..SensorPoint::default()
            };
            effects.iter().zip(&mut memories).fold(
                prepared.reference_n[i],
                |force, ((spec, values), memory)| {
                    spec.sensor.map_or(force, |hook| hook(values, force, memory, &at))
                },
            )
        })
        .collect()
}

/// Position of the parameter that sets the size of an effect; the others give its shape.
pub(crate) fn size_parameter(spec: &EffectSpec) -> usize {
    // The library lists the size first; an effect with one parameter has nothing else.
    debug_assert!(!spec.parameters.is_empty());
    0
}

/// Bounds of a parameter in this table.
pub(crate) fn bounds(spec: &EffectSpec, parameter: usize, prepared: &Prepared) -> (f64, f64) {
    let library = spec.parameters[parameter].bounds;
    spec.table.map_or(library, |fit| (fit.bounds)(&prepared.span(), library))
}

/// Values of the inner parameter of an effect that are tried.
fn grid(spec: &EffectSpec, prepared: &Prepared) -> Option<(usize, Vec<f64>)> {
    let (name, values) = spec.table?.grid?(&prepared.span());
    Some((spec.position(name)?, values))
}

/// Whether an effect has no size but its inner parameter: it changes the force, and no coefficient goes with it.
pub(crate) fn is_shape_only(spec: &EffectSpec, prepared: &Prepared) -> bool {
    grid(spec, prepared).is_some_and(|(parameter, _)| parameter == size_parameter(spec))
}

/// Candidates and their columns; columns 0 (constant) and 1 (reference) come first, the measured force is not among
/// them. `gains` are those of the sessions: columns of effects are in the units of the measured force.
pub(crate) fn candidates(
    data: &SensorData,
    prepared: &Prepared,
    gains: &[f64],
) -> (Vec<Candidate>, Vec<Vec<f64>>) {
    let sessions = prepared.group_session();
    let scaled = |full: &[f64]| -> Vec<f64> {
        prepared.grouped(full).iter().zip(&sessions).map(|(v, &s)| v * gains[s]).collect()
    };
    let reference = prepared.grouped(&prepared.reference_n);
    let mut columns = vec![vec![1.0; reference.len()], reference];
    let mut all = Vec::new();
    for spec in effects() {
        let neutral: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
        let inner = grid(spec, prepared);
        let places: Vec<Option<(usize, f64)>> = match &inner {
            Some((parameter, values)) => values.iter().map(|&v| Some((*parameter, v))).collect(),
            None => vec![None],
        };
        let size = size_parameter(spec);
        let points = places
            .into_iter()
            .map(|place| {
                let mut values = neutral.clone();
                if let Some((parameter, value)) = place {
                    values[parameter] = value;
                }
                let only_inner = place.is_some_and(|(parameter, _)| parameter == size);
                if !only_inner {
                    values[size] = 1.0;
                }
                let changed = chain(prepared, &[(spec, &values)]);
                let difference: Vec<f64> =
                    changed.iter().zip(&prepared.reference_n).map(|(a, b)| a - b).collect();
                columns.push(if only_inner { prepared.grouped(&difference) } else { scaled(&difference) });
                let column = columns.len() - 1;
                let change = if only_inner {
                    Change::Force(column)
                } else {
                    Change::Add(vec![column], bounds(spec, size, prepared))
                };
                (place, change)
            })
            .collect();
        all.push(Candidate { kind: Kind::Effect(spec), points });
    }
    let mut curve = |name: &str, full: Vec<Vec<f64>>| {
        let from = columns.len();
        columns.extend(full.iter().map(|c| prepared.grouped(c)));
        let change = Change::Add((from..columns.len()).collect(), (f64::NEG_INFINITY, f64::INFINITY));
        (Kind::Curve(name.to_string()), change)
    };
    let mut add = |(kind, change): (Kind, Change)| match all.iter_mut().find(|c| c.kind == kind) {
        Some(known) => known.points.push((None, change)),
        None => all.push(Candidate { kind, points: vec![(None, change)] }),
    };
    let x = &prepared.reference_n;
    let times = |columns: &[Vec<f64>]| -> Vec<Vec<f64>> {
        columns.iter().map(|c| c.iter().zip(x).map(|(a, b)| a * b).collect()).collect()
    };
    let clock = hats(&prepared.clock_s, 5);
    add(curve("time_s", clock.clone()));
    add(curve("time_s", times(&clock)));
    add(curve(REFERENCE_FORCE, hats(x, 3)));
    add(curve(FORCE_RATE, hats(&force_rate(prepared), 3)));
    for (name, covariate) in &data.extra {
        if let Some(shapes) = shapes(covariate, prepared) {
            add(curve(name, shapes.clone()));
            add(curve(name, times(&shapes)));
        }
    }
    (all, columns)
}

/// Change of the reference per second, over two steps.
pub(crate) fn force_rate(prepared: &Prepared) -> Vec<f64> {
    let n = prepared.reference_n.len();
    let same = |a: usize, b: usize| prepared.session[a] == prepared.session[b];
    (0..n)
        .map(|i| {
            let from = if i > 0 && same(i - 1, i) { i - 1 } else { i };
            let to = if i + 1 < n && same(i, i + 1) { i + 1 } else { i };
            let time = prepared.clock_s[to] - prepared.clock_s[from];
            if time > 0.0 { (prepared.reference_n[to] - prepared.reference_n[from]) / time } else { 0.0 }
        })
        .collect()
}

/// A straight line and a piecewise linear curve with inner knots at quantiles.
fn hats(values: &[f64], knots: usize) -> Vec<Vec<f64>> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let scale = if high > low { 1.0 / (high - low) } else { 0.0 };
    let unit = |v: f64| (v - low) * scale;
    let mut columns: Vec<Vec<f64>> = vec![values.iter().map(|&v| unit(v)).collect()];
    for k in 1..=knots {
        let knot = unit(sorted[k * (sorted.len() - 1) / (knots + 1)]);
        if knot > 0.02 && knot < 0.98 {
            columns.push(values.iter().map(|&v| (unit(v) - knot).max(0.0)).collect());
        }
    }
    columns
}

/// Columns of a covariate, if it varies; a missing value counts as the mean.
fn shapes(covariate: &Covariate, prepared: &Prepared) -> Option<Vec<Vec<f64>>> {
    if !covariate.varies() {
        return None;
    }
    let known: Vec<bool> = prepared.row.iter().map(|&i| covariate.is_known(i)).collect();
    let count = known.iter().filter(|k| **k).count();
    if count < 12 {
        return None;
    }
    match covariate {
        Covariate::Number(values) => {
            let at = |i: usize| values[prepared.row[i]];
            let mean = (0..known.len()).filter(|&i| known[i]).map(at).sum::<f64>() / count as f64;
            let filled: Vec<f64> = (0..known.len()).map(|i| if known[i] { at(i) } else { mean }).collect();
            let (low, high) = range(filled.iter().copied());
            (high > low).then(|| hats(&filled, 3))
        }
        Covariate::Word(values) => {
            let mut words: Vec<u32> =
                (0..known.len()).filter(|&i| known[i]).map(|i| values[prepared.row[i]]).collect();
            words.sort_unstable();
            words.dedup();
            if words.len() < 2 || words.len() > 12 {
                return None;
            }
            let column = |word: &u32| -> Vec<f64> {
                prepared.row.iter().map(|&i| f64::from(u8::from(values[i] == *word))).collect()
            };
            Some(words.iter().skip(1).map(column).collect())
        }
    }
}
