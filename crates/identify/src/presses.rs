//! Diagnosis of ball presses on a tactile sensor: what the sensor file lacks.
//!
//! The baseline is the sensor file as it stands. Each optics effect of the library is fitted to the presses, scored on
//! presses that its fit has not seen, and compared with the others, with nothing, and with smooth fields that have no
//! name. The press is the unit of all of it: pixels of one image err together. What is drawn stands behind
//! [`PredictPresses`]. `docs/diagnosis-presses.md` describes the method.

mod answer;
mod candidates;
mod frame_error;
mod gains;
mod model;
mod observed;
mod power;
mod predict;
mod residual;
mod score;
mod search;
#[cfg(test)]
mod tests;
mod unnamed;

pub use predict::{ActingEffect, PRESS_ZONES, PredictPresses, PressPixels};
pub use score::PressTrial;
pub use unnamed::{PressCovariate, PressValues};

use crate::{Diagnosis, Verdict};
use answer::{Answer, bare};
use candidates::candidates;
use gripgen_twin::effects::PressNeeds;
use observed::Observed;
use search::search;

/// Presses that a diagnosis needs at least.
pub const MIN_DIAGNOSED_PRESSES: usize = 4;

/// What is known of presses beside their pixels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressData {
    /// Name of each press, in the order in which they were taken.
    pub names: Vec<String>,
    /// Hash of the data.
    pub sha256: String,
    /// Mean square of the camera's noise at a pixel of the image, in grey levels squared.
    pub noise_mse: f64,
    /// What the residual may depend on, one value per press.
    pub covariates: Vec<PressCovariate>,
    /// What of the presses is known: places that were found in the images say nothing of where they should be.
    pub known: Vec<PressNeeds>,
    /// Standard deviation of the logarithm of each channel's gain from press to press, where the sensor file knows it.
    pub press_gain_sd: Option<[f64; 3]>,
}

/// What is found out about presses.
#[derive(Debug, Clone, PartialEq)]
pub struct PressDiagnosis {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// The effects that were named, with all their values.
    pub acting: Vec<ActingEffect>,
    /// The candidates in the order in which they were tried.
    pub trials: Vec<PressTrial>,
    /// Mean squared error of each press over its whole frame in grey levels squared: without the effects, and with them as
    /// a fit without this press has them.
    pub frame_mse: Vec<(f64, f64)>,
    /// Mean squared residual in each zone in grey levels squared: without the effects, and with them.
    pub zone_mse: [[f64; PRESS_ZONES]; 2],
}

/// Diagnoses presses, whose names in `data` are as many as `predictor` has presses. `progress` hears how far it is, from
/// 0 to 1, and what is tried. With fewer than [`MIN_DIAGNOSED_PRESSES`] the verdict is
/// [`Verdict::Insufficient`].
pub fn diagnose_presses(
    predictor: &dyn PredictPresses,
    data: &PressData,
    progress: &mut dyn FnMut(f64, &str),
) -> PressDiagnosis {
    let n = predictor.circumstances().len().min(data.names.len());
    if n < MIN_DIAGNOSED_PRESSES || n < predictor.circumstances().len() {
        return PressDiagnosis {
            diagnosis: too_few_presses(data, n),
            acting: Vec::new(),
            trials: Vec::new(),
            frame_mse: Vec::new(),
            zone_mse: [[0.0; PRESS_ZONES]; 2],
        };
    }
    let mut observed = Observed::new(predictor);
    let candidates = candidates(&data.known);
    let mut found = search(&mut observed, &data.covariates, &candidates, data.press_gain_sd, progress);
    progress(0.97, "whole frames");
    let errors = frame_error::borne_out(&observed, &mut found);
    Answer { data, observed: &observed, found, errors }.diagnosed()
}

/// The answer where too few presses show a contact; `visible`: how many do.
pub fn too_few_presses(data: &PressData, visible: usize) -> Diagnosis {
    let mut diagnosis = bare(data);
    diagnosis.verdict = Verdict::Insufficient;
    diagnosis.notes.push(format!(
        "too little to go by: {visible} presses with a visible contact, {MIN_DIAGNOSED_PRESSES} are needed"
    ));
    diagnosis
}
