//! Prediction of large forces from a constant that smaller ones gave.

use super::errors::HeldOut;
use super::model::{Acting, constants, refit, shown};
use super::prepare::Prepared;

/// Force below which the constant is fitted.
pub(super) const BELOW_N: f64 = 10.0;
/// Rows in contact that are needed below and beyond it.
const MIN_ROWS: usize = 3;
/// Smallest force that says something of a constant, as a share of the limit.
const LEAST: f64 = 0.1;

/// Rows beyond the limit with predictions from a constant that rows of their group below it gave.
pub(super) struct Beyond {
    /// Rows that are predicted.
    pub(super) rows: Vec<usize>,
    /// Predictions of the baseline and with the effects, in mm^3; 0 elsewhere.
    pub(super) before_mm3: Vec<f64>,
    pub(super) after_mm3: Vec<f64>,
}

/// Predicts rows beyond [`BELOW_N`]. Effects are those of other grasps; where there are too few of them, those of the rows below.
pub(super) fn beyond(prepared: &Prepared, found: &HeldOut) -> Beyond {
    let below = |i: usize| prepared.force_n[i] <= BELOW_N;
    let enough = |rows: &[usize]| {
        let pressing = rows.iter().filter(|&&i| prepared.force_n[i] > LEAST * BELOW_N);
        let (low, high): (Vec<usize>, Vec<usize>) = pressing.partition(|&&i| below(i));
        low.len() >= MIN_ROWS && high.len() >= MIN_ROWS
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
    Beyond { rows, before_mm3, after_mm3 }
}
