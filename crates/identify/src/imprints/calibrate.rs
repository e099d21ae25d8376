//! Imprint constants of grasps and of parts.

use super::ImprintData;
use super::model::{Acting, constants, shown};
use super::prepare::{FOLDS, Prepared, prepare};
use crate::diagnosis::ParameterEstimate;
use crate::grouped::t_quantile_95;
use crate::statistics::mean_and_error;
use std::collections::BTreeMap;

/// What shares a constant in a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SharedConstant {
    /// Each grasp has one; that of a part is their geometric mean.
    Grasp,
    /// All rows of a part have one.
    Part,
}

/// The constant of one grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspConstant {
    /// Name of the grasp.
    pub name: String,
    /// Its part, empty where nobody wrote it down.
    pub part: String,
    /// Rows.
    pub rows: usize,
    /// Largest measured volume, in mm^3.
    pub peak_mm3: f64,
    /// Constant in mm^3/N; the interval from constants without each stretch of the grasp.
    pub imprint_mm3_per_n: ParameterEstimate,
    /// Root of the mean squared residual, in mm^3.
    pub rmse_mm3: f64,
}

/// The constant of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartConstant {
    /// Its name, empty where nobody wrote it down.
    pub part: String,
    /// Grasps.
    pub grasps: usize,
    /// Rows.
    pub rows: usize,
    /// Constant in mm^3/N. The interval says how well the mean over grasps is known, where there are two; otherwise how well that of the
    /// one grasp is.
    pub imprint_mm3_per_n: ParameterEstimate,
    /// Standard deviation of the logarithm of the constants of its grasps.
    pub grasp_sd: Option<f64>,
    /// Root of the mean squared residual with that constant for all grasps, in mm^3.
    pub rmse_mm3: f64,
}

/// Constants of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintConstants {
    /// By part, in the order of the names.
    pub parts: Vec<PartConstant>,
    /// By grasp, in the order of the table.
    pub grasps: Vec<GraspConstant>,
    /// Smallest and largest force in N.
    pub force_n: (f64, f64),
    /// Remarks for people.
    pub notes: Vec<String>,
}

/// Fits `V = c F` with no delay by least squares. The error says what is missing.
///
/// # Errors
///
/// No grasp with two forces above 0; the text says so.
pub fn calibrate_imprint_set(data: &ImprintData, shared: SharedConstant) -> Result<ImprintConstants, String> {
    let prepared = prepare(data);
    if prepared.groups.is_empty() {
        let lack = "no grasp has two rows with a force above 0 and a volume";
        return Err(prepared.notes.first().map_or_else(|| lack.into(), |note| format!("{lack}: {note}")));
    }
    let grasps = grasp_constants(&prepared, &[]);
    let mut of_part: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (g, group) in prepared.groups.iter().enumerate() {
        of_part.entry(&group.part).or_default().push(g);
    }
    let parts = of_part.into_iter().map(|(part, of)| part_constant(&prepared, &grasps, part, &of, shared));
    let pressed = prepared.rows().map(|i| prepared.force_n[i]).filter(|f| *f > 0.0);
    let force_n = pressed.fold((f64::INFINITY, 0.0_f64), |(l, h), f| (l.min(f), h.max(f)));
    Ok(ImprintConstants { parts: parts.collect(), grasps, force_n, notes: prepared.notes })
}

fn part_constant(
    prepared: &Prepared,
    grasps: &[GraspConstant],
    part: &str,
    of: &[usize],
    shared: SharedConstant,
) -> PartConstant {
    let logs: Vec<f64> = of.iter().map(|&g| libm::log(grasps[g].imprint_mm3_per_n.value.max(1e-9))).collect();
    let n = of.len();
    let (mean, deviation) = mean_and_error(&logs);
    let rows: Vec<usize> = of.iter().flat_map(|&g| prepared.groups[g].rows.iter().copied()).collect();
    let half = t_quantile_95(n as f64 - 1.0) * deviation;
    let imprint_mm3_per_n = if n == 1 {
        grasps[of[0]].imprint_mm3_per_n.clone()
    } else {
        let centre = match shared {
            SharedConstant::Grasp => mean,
            SharedConstant::Part => {
                let sum = |a: &[f64], b: &[f64]| rows.iter().map(|&i| a[i] * b[i]).sum::<f64>();
                let fv = sum(&prepared.force_n, &prepared.volume_mm3);
                libm::log((fv / sum(&prepared.force_n, &prepared.force_n)).max(1e-9))
            }
        };
        let ends = (libm::exp(centre - half), libm::exp(centre + half));
        ParameterEstimate::new(libm::exp(centre), ends, "mm^3/N")
    };
    let c = imprint_mm3_per_n.value;
    let square = |&i: &usize| {
        let left = prepared.volume_mm3[i] - c * prepared.force_n[i];
        left * left
    };
    PartConstant {
        part: part.into(),
        grasps: n,
        rows: rows.len(),
        rmse_mm3: libm::sqrt(rows.iter().map(square).sum::<f64>() / rows.len().max(1) as f64),
        imprint_mm3_per_n,
        grasp_sd: (n > 1).then(|| deviation * libm::sqrt(n as f64)),
    }
}

/// The constants of all groups with some effects.
pub(super) fn grasp_constants(prepared: &Prepared, effects: &[Acting]) -> Vec<GraspConstant> {
    let shown_n = shown(prepared, effects);
    let c = constants(prepared, &shown_n, |_| true);
    let without: Vec<Vec<f64>> =
        (0..FOLDS).map(|fold| constants(prepared, &shown_n, |i| prepared.fold[i] != fold)).collect();
    let of = |g: usize| {
        let group = &prepared.groups[g];
        let folds = group.rows.iter().map(|&i| prepared.fold[i] + 1).max().unwrap_or(1);
        let all: Vec<f64> = without.iter().take(folds).map(|c| c[g]).collect();
        let (_, deviation) = mean_and_error(&all);
        // Jackknife (Tukey 1958): the standard error of the mean of values without one stretch, times their number less one.
        let more = folds as f64 - 1.0;
        let half = if folds > 1 { t_quantile_95(more) * deviation * more } else { 0.0 };
        let left = |i: usize| prepared.volume_mm3[i] - c[g] * shown_n[i];
        let square: f64 = group.rows.iter().map(|&i| left(i) * left(i)).sum();
        GraspConstant {
            name: group.name.clone(),
            part: group.part.clone(),
            rows: group.rows.len(),
            peak_mm3: group.peak_mm3,
            imprint_mm3_per_n: ParameterEstimate::new(c[g], (c[g] - half, c[g] + half), "mm^3/N"),
            rmse_mm3: libm::sqrt(square / group.rows.len() as f64),
        }
    };
    (0..prepared.groups.len()).map(of).collect()
}
