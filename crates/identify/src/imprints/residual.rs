//! What no effect explains: on what the residual depends.

use super::ImprintData;
use super::errors::HeldOut;
use super::model::{constants, shown};
use super::prepare::{FOLDS, Prepared};
use crate::diagnosis::UnknownCovariate;
use crate::permutation::{Covariate, benjamini_hochberg, dependence};

/// Rows that are needed to look.
const MIN_ROWS: usize = 30;
/// Permutations of stretches.
const PERMUTATIONS: usize = 999;
/// Share of false finds among all (Benjamini and Hochberg 1995).
const FALSE_RATE: f64 = 0.02;
/// Smallest share of the variance of the residual that is said.
const MIN_STRENGTH: f64 = 0.1;

/// Residuals on all rows, as shares of the largest volume of their group, in the order of [`Prepared::rows`].
pub(super) fn residuals(prepared: &Prepared, found: &HeldOut) -> Vec<f64> {
    let shown_n = shown(prepared, &found.effects);
    let c = constants(prepared, &shown_n, |_| true);
    let of = |i: usize| {
        let c = prepared.group[i].map_or(0.0, |g| c[g]);
        (prepared.volume_mm3[i] - c * shown_n[i]) / prepared.peak(i)
    };
    prepared.rows().map(of).collect()
}

/// Columns on which a residual may depend: force, its change, time in the grasp, and what else was written down.
pub(super) fn covariates(data: &ImprintData, prepared: &Prepared) -> Vec<(String, Covariate)> {
    let n = prepared.group.len();
    let (mut clock_s, mut rate) = (vec![f64::NAN; n], vec![f64::NAN; n]);
    for (rows, time_s) in &prepared.series {
        for (k, &i) in rows.iter().enumerate() {
            clock_s[i] = time_s[k];
            let (a, b) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
            rate[i] = (prepared.force_n[rows[b]] - prepared.force_n[rows[a]]) / (time_s[b] - time_s[a]);
        }
    }
    let words = |cells: &[String]| Covariate::words(cells.iter().map(String::as_str));
    let mut all = vec![
        ("grip_force_n".to_string(), Covariate::Number(prepared.force_n.clone())),
        ("time_s".to_string(), Covariate::Number(clock_s)),
        ("force_rate_n_per_s".to_string(), Covariate::Number(rate)),
        ("part".to_string(), words(&data.part)),
        ("session".to_string(), words(&data.session)),
    ];
    all.extend(data.extra.iter().cloned());
    let at = |covariate: &Covariate| match covariate {
        Covariate::Number(x) => Covariate::Number(prepared.rows().map(|i| x[i]).collect()),
        Covariate::Word(x) => Covariate::Word(prepared.rows().map(|i| x[i]).collect()),
    };
    all.into_iter().map(|(name, covariate)| (name, at(&covariate))).collect()
}

/// Columns on which the residual depends, strongest first. Stretches of grasps change places, rows inside them do not.
pub(super) fn unknown(
    prepared: &Prepared,
    found: &HeldOut,
    columns: &[(String, Covariate)],
) -> Vec<UnknownCovariate> {
    let residual = residuals(prepared, found);
    if residual.len() < MIN_ROWS {
        return Vec::new();
    }
    let block = |i: usize| prepared.group[i].unwrap_or(0) * FOLDS + prepared.fold[i];
    let blocks: Vec<usize> = prepared.rows().map(block).collect();
    let varying: Vec<&(String, Covariate)> = columns.iter().filter(|(_, c)| c.varies()).collect();
    let tested: Vec<_> = varying
        .iter()
        .zip(0..)
        .map(|((_, covariate), seed)| dependence(&residual, &[], covariate, &blocks, PERMUTATIONS, seed))
        .collect();
    let p_values: Vec<f64> = tested.iter().map(|d| d.p_value).collect();
    let real = benjamini_hochberg(&p_values, FALSE_RATE);
    let mut unknown: Vec<UnknownCovariate> = varying
        .iter()
        .zip(tested.iter().zip(real))
        .filter(|(_, (d, real))| *real && d.strength >= MIN_STRENGTH)
        .map(|((name, _), (d, _))| UnknownCovariate {
            covariate: name.clone(),
            strength: d.strength,
            p_value: d.p_value,
        })
        .collect();
    unknown.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    unknown
}
