//! Diagnosis of imprints of grasps beside the normal force of the jaw, without a pull.
//!
//! `V = c F`, c of each grasp always free: it is the baseline, not an effect, and the same rows give it before and after.
//! Effects change the force that an imprint shows, in the order of the library: a reading that comes late, a gel that relaxes, a power
//! of the force, a light that drifts. Errors are those of rows that gave neither c nor a value of an effect: effects are fitted to other
//! grasps, c to other stretches of the same one. `docs/diagnosis-imprints.md` describes the method.

mod answer;
mod calibrate;
mod constant;
mod errors;
mod model;
mod prepare;
mod residual;
mod search;
#[cfg(test)]
mod tests;

pub use answer::{ImprintDiagnosis, ImprintEvidence, ImprintRow, MeasuredGrasp, diagnose_imprints};
pub use calibrate::{GraspConstant, ImprintConstants, PartConstant, SharedConstant, calibrate_imprint_set};
pub use constant::{FittedPress, ImprintEstimate, imprint_constant};
pub use errors::{ImprintComparison, compare_imprints};

use crate::permutation::Covariate;

/// Imprints beside the force of the jaw. All columns have one value for each row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImprintData {
    /// Names of the rows.
    pub ids: Vec<String>,
    /// Normal force of the jaw, in N.
    pub grip_force_n: Vec<f64>,
    /// Volume of the imprint, in mm^3.
    pub volume_mm3: Vec<f64>,
    /// Time in s, rising within a grasp; NaN where nobody wrote it down.
    pub time_s: Vec<f64>,
    /// Grasp of each row: an index into `grasps`.
    pub grasp: Vec<usize>,
    /// Names of the grasps.
    pub grasps: Vec<String>,
    /// Part of each row, empty where nobody wrote it down.
    pub part: Vec<String>,
    /// Session of each row, empty where nobody wrote it down.
    pub session: Vec<String>,
    /// Further columns, of unknown meaning.
    pub extra: Vec<(String, Covariate)>,
}
