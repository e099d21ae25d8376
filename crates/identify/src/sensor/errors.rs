//! Errors on blocks and sessions that the fit has not seen.

use super::candidates::{chain, is_shape_only, size_parameter};
use super::moments::{Model, Moments};
use super::noise::{Noise, Whitener};
use super::search::{Weighing, Workspace, combined};
use crate::diagnosis::{ErrorPair, HeldOutError};
use crate::statistics::log_error_half90;
use gripgen_twin::effects::EffectSpec;

/// Held-out errors before and after.
pub(crate) struct Errors {
    pub blocks: ErrorPair,
    pub sessions: Option<ErrorPair>,
    /// Predictions of the groups, each from the folds without it.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
}

/// Errors of the baseline and with effects. The inner parameters of the effects stay, their sizes are refitted without
/// the block (an effect without size has nothing to refit).
pub(crate) fn errors(ws: &Workspace<'_>, effects: &[(&'static EffectSpec, Vec<f64>)]) -> Errors {
    let prepared = ws.prepared;
    let response = ws.columns.len() - 1;
    let mut columns = vec![ws.columns[0].clone(), ws.columns[1].clone()];
    let mut model = Model::baseline();
    // Effects of shape only change the force; those with a size are added, in the order of the chain.
    let list: Vec<(&EffectSpec, &[f64])> = effects.iter().map(|(s, v)| (*s, v.as_slice())).collect();
    let gains: Vec<f64> = ws.raw.solve(&Model::baseline(), |_| true).sessions.iter().map(|s| s[1]).collect();
    let sessions = prepared.group_session();
    for k in 0..list.len() {
        let before = chain(prepared, &list[..k]);
        let after = chain(prepared, &list[..=k]);
        let difference: Vec<f64> = after.iter().zip(&before).map(|(a, b)| a - b).collect();
        let grouped = prepared.grouped(&difference);
        let spec = list[k].0;
        let has_size = !is_shape_only(spec, prepared);
        debug_assert_eq!(size_parameter(spec), 0);
        if has_size {
            columns.push(grouped.iter().zip(&sessions).map(|(v, &s)| v * gains[s]).collect());
            model.added.push(vec![(columns.len() - 1, 1.0)]);
        } else {
            columns.push(grouped);
            model.force.push((columns.len() - 1, 1.0));
        }
    }
    columns.push(ws.columns[response].clone());
    let raw = Moments::new(&prepared.units, &columns);
    let noise = if ws.weighing == Weighing::Likelihood { ws.noise } else { Noise::WHITE };
    let whitener = Whitener::new(noise, &prepared.group_steps);
    let mut weighed = columns.clone();
    for column in &mut weighed {
        whitener.apply(column);
    }
    let fit = Moments::new(&prepared.units, &weighed);
    let y = &columns[columns.len() - 1];
    let predict = |model: &Model| held_out_rows(&fit, model, &columns);
    let (before, after) = (predict(&Model::baseline()), predict(&model));
    let pair = |before: &[f64], after: &[f64]| ErrorPair {
        before: error(ws, y, before),
        after: error(ws, y, after),
    };
    let by_sessions = (raw.sessions >= 2).then(|| {
        let rows = |model: &Model| {
            let by_unit = fit.held_out_sessions(model, &raw);
            summary(ws, &by_unit, y)
        };
        ErrorPair { before: rows(&Model::baseline()), after: rows(&model) }
    });
    Errors { blocks: pair(&before, &after), sessions: by_sessions, before, after }
}

fn held_out_rows(fit: &Moments, model: &Model, columns: &[Vec<f64>]) -> Vec<f64> {
    let folds = fit.units.iter().map(|u| u.fold + 1).max().unwrap_or(0);
    let force = combined(columns, &model.force);
    let added: Vec<Vec<f64>> = model.added.iter().map(|c| combined(columns, c)).collect();
    let mut predicted = vec![0.0; force.len()];
    for fold in 0..folds {
        let solution = fit.solve(model, |u| u.fold != fold);
        for unit in fit.units.iter().filter(|u| u.fold == fold) {
            let [offset, gain] = solution.sessions[unit.session];
            for i in unit.from..unit.to {
                let more: f64 = added.iter().zip(&solution.added).map(|(c, a)| c[i] * a).sum();
                predicted[i] = offset + gain * force[i] + more;
            }
        }
    }
    predicted
}

fn error(ws: &Workspace<'_>, y: &[f64], predicted: &[f64]) -> HeldOutError {
    let by_unit: Vec<f64> = ws
        .prepared
        .units
        .iter()
        .map(|u| (u.from..u.to).map(|i| (y[i] - predicted[i]) * (y[i] - predicted[i])).sum())
        .collect();
    let absolute: f64 = y.iter().zip(predicted).map(|(a, b)| (a - b).abs()).sum();
    let readings: f64 = y.iter().map(|v| v.abs()).sum();
    HeldOutError {
        mape_pct: (readings > 0.0).then(|| 100.0 * absolute / readings),
        ..summary(ws, &by_unit, y)
    }
}

/// Root mean square over all rows; the interval from the scatter of the mean square over folds of sessions, on a
/// logarithmic scale.
fn summary(ws: &Workspace<'_>, by_unit: &[f64], y: &[f64]) -> HeldOutError {
    let mut blocks: Vec<((usize, usize), f64, f64)> = Vec::new();
    for (unit, sum) in ws.prepared.units.iter().zip(by_unit) {
        let key = (unit.session, unit.fold);
        let rows = (unit.to - unit.from) as f64;
        match blocks.last_mut() {
            Some(last) if last.0 == key => {
                last.1 += sum;
                last.2 += rows;
            }
            _ => blocks.push((key, *sum, rows)),
        }
    }
    let mean = by_unit.iter().sum::<f64>() / y.len() as f64;
    let squares: Vec<f64> = blocks.iter().map(|b| b.1 / b.2.max(1.0)).collect();
    let half = log_error_half90(mean, &squares);
    let rmse = libm::sqrt(mean);
    HeldOutError {
        rmse_n: Some(rmse),
        low90: rmse * libm::exp(-half),
        high90: rmse * libm::exp(half),
        ..HeldOutError::default()
    }
}
