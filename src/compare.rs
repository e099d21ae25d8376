//! How far a twin is from measured pulls.

use crate::diagnose::{UnknownPartError, given_model};
use crate::predict::PullPredictor;
use gripgen_identify::pulls::model::{ModelEffect, PredictPulls, PullModel};
use gripgen_twin::effects::OutsideFit;
use gripgen_twin::{MeasuredPulls, Table, TableTarget, Twin};
use std::collections::BTreeMap;

/// Errors of predicted labels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LabelErrors {
    /// Pulls.
    pub n: usize,
    /// Root of the mean squared error.
    pub rmse_n: f64,
    /// Mean of the absolute error as a share of the label.
    pub mape_pct: f64,
    /// Mean of predicted less measured.
    pub bias_n: f64,
}

/// A twin against measured pulls.
#[derive(Debug, Clone, PartialEq)]
pub struct PullComparison {
    /// All labels.
    pub pulls: LabelErrors,
    /// Labels by part.
    pub by_part: BTreeMap<String, LabelErrors>,
    /// Pulls outside the grip forces on which an effect was fitted; they count all the same.
    pub outside_fit: usize,
    /// Traces, and the root of the mean squared difference of their readings.
    pub traces: (usize, f64),
    /// Label predicted for each pull.
    pub label_n: Vec<f64>,
    /// Readings predicted for the rows of each pull's trace from time 0 on, as far as the pull lasts; empty without a trace.
    pub trace_n: Vec<Vec<f64>>,
}

impl LabelErrors {
    fn of(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut sums = (0.0, 0.0, 0.0);
        let mut n = 0;
        for (measured, predicted) in pairs {
            let e = predicted - measured;
            sums = (sums.0 + e * e, sums.1 + e.abs() / measured.abs().max(0.1), sums.2 + e);
            n += 1;
        }
        let count = n.max(1) as f64;
        Self { n, rmse_n: (sums.0 / count).sqrt(), mape_pct: 100.0 * sums.1 / count, bias_n: sums.2 / count }
    }
}

/// A twin as it predicts pulls of these parts, with its effects.
fn model_of(twin: &Twin, parts: &[String]) -> Result<PullModel, UnknownPartError> {
    let mut model = given_model(twin, parts)?;
    for effect in &twin.effects {
        let part = effect.part.as_ref().map(|name| parts.iter().position(|p| p == name));
        // An effect of a part that nobody pulled.
        if part == Some(None) {
            continue;
        }
        let held = effect.fitted_grip_force_n.filter(|_| effect.outside_fit == OutsideFit::Hold);
        model.effects.push(ModelEffect {
            spec: effect.spec,
            values: effect.values.clone(),
            part: part.flatten(),
            held_grip_force_n: held,
        });
    }
    Ok(model)
}

/// What the tables of a twin multiply the friction of each pull by. A force that a table adds to the readings is taken as one
/// that the jaws hold: labels are read at the slip.
fn apply_tables(model: &mut PullModel, twin: &Twin, measured: &MeasuredPulls, predictor: &PullPredictor<'_>) {
    if twin.tables.is_empty() {
        return;
    }
    let value = |p: &gripgen_twin::MeasuredPull, target: TableTarget, t: &Table| {
        let forces = [p.grip_force_n, p.increment_n, p.step_s];
        (t.target == target).then(|| t.at(&p.part, forces, &p.covariates)).flatten()
    };
    let limits_n = predictor.limits_n(model);
    let factor = |(p, limit_n): (&gripgen_twin::MeasuredPull, &f64)| {
        let factor: f64 = twin.tables.iter().filter_map(|t| value(p, TableTarget::Factor, t)).product();
        let added =
            twin.tables.iter().filter_map(|t| value(p, TableTarget::Offset, t)).fold(0.0, |a, b| a + b);
        (factor * (1.0 + added / limit_n.max(0.1))).max(0.05)
    };
    model.factor = measured.pulls.iter().zip(&limits_n).map(factor).collect();
}

/// Predicts every pull of a campaign, with expected values over scatter and noise, and compares.
pub fn compare_pulls(
    measured: &MeasuredPulls,
    twin: &Twin,
    jobs: usize,
) -> Result<PullComparison, UnknownPartError> {
    let predictor = PullPredictor::new(measured, twin, jobs);
    let parts = predictor.part_names().to_vec();
    let mut model = model_of(twin, &parts)?;
    apply_tables(&mut model, twin, measured, &predictor);
    let mut label_n = vec![0.0; measured.pulls.len()];
    let mut trace_n = vec![vec![]; measured.pulls.len()];
    let (mut square, mut readings, mut traces) = (0.0, 0_usize, 0);
    for name in &parts {
        let part = &twin.parts[name];
        let own = PullModel { kinetic_ratio: part.kinetic_ratio, scatter: part.scatter, ..model.clone() };
        let rows: Vec<usize> =
            (0..measured.pulls.len()).filter(|&i| measured.pulls[i].part == *name).collect();
        for (&i, p) in rows.iter().zip(predictor.pulls(&own, &rows)) {
            label_n[i] = p.label_n;
        }
        for &i in &rows {
            let Some(trace) = &measured.pulls[i].trace else { continue };
            let times: Vec<f64> = trace.time_s.iter().copied().filter(|t| *t >= 0.0).collect();
            let before = trace.len() - times.len();
            let predicted = predictor.expected_trace_n(&own, i, &times);
            let pairs = predicted.iter().zip(&trace.measured_force_n[before..]);
            square += pairs.map(|(p, m)| (p - m) * (p - m)).sum::<f64>();
            readings += predicted.len();
            traces += 1;
            trace_n[i] = predicted;
        }
    }
    let all = || measured.pulls.iter().zip(&label_n);
    let by_part = parts
        .iter()
        .map(|name| {
            let own = all().filter(|(p, _)| p.part == *name).map(|(p, l)| (p.max_pull_force_n, *l));
            (name.clone(), LabelErrors::of(own))
        })
        .collect();
    let outside = |p: &gripgen_twin::MeasuredPull| {
        twin.effects.iter().any(|e| {
            let range = e.fitted_grip_force_n.filter(|_| e.spec.is_load_law() && e.acts_on(&p.part));
            range.is_some_and(|(low, high)| !(low..=high).contains(&p.grip_force_n))
        })
    };
    Ok(PullComparison {
        pulls: LabelErrors::of(all().map(|(p, l)| (p.max_pull_force_n, *l))),
        by_part,
        outside_fit: measured.pulls.iter().filter(|p| outside(p)).count(),
        traces: (traces, (square / readings.max(1) as f64).sqrt()),
        label_n,
        trace_n,
    })
}
