//! Predictions of rows that gave neither a constant nor a value of an effect, and their errors.

use super::model::{Acting, constants, refit, shown};
use super::prepare::{FOLDS, Prepared};
use crate::diagnosis::HeldOutError;
use crate::grouped::t_quantile_95;

/// A model that was fitted with each unit held out.
#[derive(Debug, Clone)]
pub(super) struct HeldOut {
    /// Effects fitted to all rows.
    pub(super) effects: Vec<Acting>,
    /// Effects without each unit.
    pub(super) without: Vec<Vec<Acting>>,
    /// Held-out predictions, in mm^3.
    pub(super) predicted_mm3: Vec<f64>,
    /// Sum over the rows of each unit of squared errors, as shares of the largest volume of their group.
    pub(super) squares: Vec<f64>,
}

impl HeldOut {
    /// Sum of squares over all units.
    pub(super) fn all(&self) -> f64 {
        self.squares.iter().sum()
    }

    /// Value of a parameter of an effect with its jackknife standard error (Tukey 1958).
    pub(super) fn value(&self, effect: usize, parameter: usize) -> (f64, f64) {
        let n = self.without.len() as f64;
        let all: Vec<f64> = self.without.iter().map(|m| m[effect].1[parameter]).collect();
        let mean = all.iter().sum::<f64>() / n;
        let square: f64 = all.iter().map(|x| (x - mean) * (x - mean)).sum();
        (self.effects[effect].1[parameter], libm::sqrt((n - 1.0) / n * square))
    }
}

/// Fits effects without each unit in turn, from their values on all rows, and predicts what was held out.
pub(super) fn hold_out(prepared: &Prepared, effects: Vec<Acting>) -> HeldOut {
    let without: Vec<Vec<Acting>> = (0..prepared.units)
        .map(|u| match effects.is_empty() {
            true => Vec::new(),
            false => refit(prepared, &effects, &|i| prepared.unit[i] != u).0,
        })
        .collect();
    let predicted_mm3 = predict(prepared, &without, &|i| prepared.unit[i]);
    let mut squares = vec![0.0; prepared.units];
    for i in prepared.rows() {
        let share = (prepared.volume_mm3[i] - predicted_mm3[i]) / prepared.peak(i);
        squares[prepared.unit[i]] += share * share;
    }
    HeldOut { effects, without, predicted_mm3, squares }
}

/// Predicts each row by the effects of its set, `of`, with a constant from the other stretches of its group.
pub(super) fn predict(prepared: &Prepared, sets: &[Vec<Acting>], of: &dyn Fn(usize) -> usize) -> Vec<f64> {
    let mut predicted = vec![0.0; prepared.group.len()];
    for (u, effects) in sets.iter().enumerate() {
        let shown_n = shown(prepared, effects);
        for fold in 0..FOLDS {
            let c = constants(prepared, &shown_n, |i| prepared.fold[i] != fold);
            for i in prepared.rows().filter(|&i| of(i) == u && prepared.fold[i] == fold) {
                predicted[i] = prepared.group[i].map_or(0.0, |g| c[g]) * shown_n[i];
            }
        }
    }
    predicted
}

/// The interval is for the error of new data of the same size, whose own scatter is as large: root of 2.
const NEW_DATA: f64 = std::f64::consts::SQRT_2;

/// Error of some rows in mm^3; the interval from the scatter of its square over the groups, or over stretches where there
/// are fewer than four.
pub(super) fn error(prepared: &Prepared, predicted_mm3: &[f64], rows: &[usize]) -> HeldOutError {
    let left = |i: usize| prepared.volume_mm3[i] - predicted_mm3[i];
    let n = rows.len().max(1) as f64;
    let mean = rows.iter().map(|&i| left(i) * left(i)).sum::<f64>() / n;
    let volumes: f64 = rows.iter().map(|&i| prepared.volume_mm3[i].abs()).sum();
    let absolute: f64 = rows.iter().map(|&i| left(i).abs()).sum();
    let mut parts: std::collections::BTreeMap<usize, (f64, f64)> = std::collections::BTreeMap::new();
    for &i in rows {
        let part = parts.entry(prepared.unit[i]).or_default();
        part.0 += left(i) * left(i);
        part.1 += 1.0;
    }
    let squares: Vec<f64> = parts.values().map(|(sum, n)| sum / n).collect();
    let (middle, deviation) = mean_and_error(&squares);
    let half = if middle > 0.0 && deviation.is_finite() {
        0.5 * NEW_DATA * t_quantile_95(squares.len() as f64 - 1.0) * (deviation / middle).min(3.0)
    } else {
        0.0
    };
    let rmse = libm::sqrt(mean);
    HeldOutError {
        rmse_mm3: Some(rmse),
        low90: rmse * libm::exp(-half),
        high90: rmse * libm::exp(half),
        mape_pct: (volumes > 0.0).then(|| 100.0 * absolute / volumes),
        ..HeldOutError::default()
    }
}

/// Mean and its standard error; infinite for one value.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n.max(1.0);
    if values.len() < 2 {
        return (mean, f64::INFINITY);
    }
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, libm::sqrt(square / (n - 1.0) / n))
}
