//! How far the law of a twin is from a table of imprints.

use super::ImprintData;
use super::model::{constants, shown};
use super::prepare::prepare;
use gripgen_twin::effects::EffectSpec;

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
