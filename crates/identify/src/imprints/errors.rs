//! Predictions of rows that gave neither a constant nor a value of an effect, and their errors; how far the law of a twin is from
//! a table.

use super::ImprintData;
use super::model::{Acting, constants, refit, shown};
use super::prepare::{FOLDS, Prepared, prepare};
use crate::diagnosis::HeldOutError;
use crate::statistics::{log_error_half90, mean_and_error};
use gripgen_twin::effects::EffectSpec;

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
    let half = log_error_half90(mean_and_error(&squares).0, &squares);
    let rmse = libm::sqrt(mean);
    HeldOutError {
        rmse_mm3: Some(rmse),
        low90: rmse * libm::exp(-half),
        high90: rmse * libm::exp(half),
        mape_pct: (volumes > 0.0).then(|| 100.0 * absolute / volumes),
        ..HeldOutError::default()
    }
}

/// Force below which the constant is fitted.
const BELOW_N: f64 = 10.0;
/// Rows in contact that are needed below and beyond it.
const MIN_ROWS_PER_SIDE: usize = 3;
/// Smallest force that says something of a constant, as a share of the limit.
const MIN_FORCE_SHARE: f64 = 0.1;

/// Rows beyond the limit with predictions from a constant that rows of their group below it gave.
pub(super) struct Extrapolated {
    /// Rows that are predicted.
    pub(super) rows: Vec<usize>,
    /// Predictions of the baseline and with the effects, in mm^3; 0 elsewhere.
    pub(super) before_mm3: Vec<f64>,
    pub(super) after_mm3: Vec<f64>,
}

/// Predicts rows beyond [`BELOW_N`]. Effects are those of other grasps; where there are too few of them, those of the rows below.
pub(super) fn extrapolated(prepared: &Prepared, found: &HeldOut) -> Extrapolated {
    let below = |i: usize| prepared.force_n[i] <= BELOW_N;
    let enough = |rows: &[usize]| {
        let pressing = rows.iter().filter(|&&i| prepared.force_n[i] > MIN_FORCE_SHARE * BELOW_N);
        let (low, high): (Vec<usize>, Vec<usize>) = pressing.partition(|&&i| below(i));
        low.len() >= MIN_ROWS_PER_SIDE && high.len() >= MIN_ROWS_PER_SIDE
    };
    let used: Vec<bool> = prepared.groups.iter().map(|g| enough(&g.rows)).collect();
    let is_used = |i: usize| prepared.group[i].is_some_and(|g| used[g]);
    let rows: Vec<usize> = prepared.rows().filter(|&i| is_used(i) && !below(i)).collect();
    let n = prepared.group.len();
    let predict = |sets: &[Vec<Acting>]| {
        let mut predicted = vec![0.0; n];
        for (u, effects) in sets.iter().enumerate() {
            let shown_n = shown(prepared, effects);
            let c = constants(prepared, &shown_n, below);
            for &i in rows.iter().filter(|&&i| sets.len() == 1 || prepared.unit[i] == u) {
                predicted[i] = prepared.group[i].map_or(0.0, |g| c[g]) * shown_n[i];
            }
        }
        predicted
    };
    let sets = match (found.effects.is_empty(), prepared.whole_grasps) {
        (true, _) => vec![Vec::new()],
        (false, true) => found.without.clone(),
        (false, false) => vec![refit(prepared, &found.effects, &below).0],
    };
    let (before_mm3, after_mm3) = (predict(&[Vec::new()]), predict(&sets));
    Extrapolated { rows, before_mm3, after_mm3 }
}

/// The error of a law, the constant of each grasp refitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintComparison {
    /// Rows.
    pub n: usize,
    /// Root of the mean squared error, in mm^3.
    pub rmse_mm3: f64,
    /// Root of the mean squared error as a share of the largest measured volume of its grasp, in percent.
    pub rmse_pct_of_peak: f64,
    /// Name, rows and both errors of each grasp.
    pub by_grasp: Vec<(String, usize, f64, f64)>,
    /// Remarks for people.
    pub notes: Vec<String>,
}

/// Compares `V = c F` and some effects, in their order, with a table; c of each grasp is the best one. The error says what is missing.
///
/// # Errors
///
/// No grasp with two forces above 0; the text says so.
pub fn compare_imprints(
    data: &ImprintData,
    effects: &[(&'static EffectSpec, Vec<f64>)],
) -> Result<ImprintComparison, String> {
    let prepared = prepare(data);
    if prepared.groups.is_empty() {
        return Err("no grasp has two rows with a force above 0 and a volume".into());
    }
    let shown_n = shown(&prepared, effects);
    let c = constants(&prepared, &shown_n, |_| true);
    let mut by_grasp = Vec::new();
    let (mut squares, mut shares, mut n) = (0.0, 0.0, 0);
    for (g, group) in prepared.groups.iter().enumerate() {
        let left = |i: usize| prepared.volume_mm3[i] - c[g] * shown_n[i];
        let square: f64 = group.rows.iter().map(|&i| left(i) * left(i)).sum();
        let rmse = libm::sqrt(square / group.rows.len() as f64);
        by_grasp.push((group.name.clone(), group.rows.len(), rmse, 100.0 * rmse / group.peak_mm3));
        squares += square;
        shares += square / (group.peak_mm3 * group.peak_mm3);
        n += group.rows.len();
    }
    Ok(ImprintComparison {
        n,
        rmse_mm3: libm::sqrt(squares / n as f64),
        rmse_pct_of_peak: 100.0 * libm::sqrt(shares / n as f64),
        by_grasp,
        notes: prepared.notes,
    })
}
