//! Calibration of a twin from measured pulls.

use crate::diagnose::{PullTwinError, check_fit, given_model, pull_values};
use crate::library::Library;
use crate::predict::PullPredictor;
use crate::twin_edits::TwinEdits;
use gripgen_identify::pulls::calibrate::{
    CalibrateError, CalibrateRequest, PullCalibration, calibrate_pulls,
};
use gripgen_twin::config::{CalibrationFile, EffectFile};
use gripgen_twin::effects::{OFFSET_LAW, OutsideFit, Per};
use gripgen_twin::{MeasuredPulls, Twin};
use std::collections::BTreeMap;

/// Why a twin could not be calibrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibratePullsError {
    /// The twin.
    #[error(transparent)]
    Twin(#[from] PullTwinError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] CalibrateError),
}

/// Fits the baseline of `twin` to measured pulls, with the law and the effects asked for, and returns what changes in the
/// twin. Its own effects on pulls are replaced by those fitted; laws are written for the range they were fitted on, and
/// extrapolated.
pub fn calibrate_twin(
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    request: &CalibrateRequest,
    jobs: usize,
) -> Result<(PullCalibration, TwinEdits), CalibratePullsError> {
    check_fit(measured, twin)?;
    let predictor = PullPredictor::new(measured, twin, library, jobs);
    let given = given_model(twin, predictor.part_names()).map_err(PullTwinError::from)?;
    let found = calibrate_pulls(measured, &predictor, &given, request)?;
    let (low, high) = found.grip_force_n;
    let evidence = format!("gripgen calibrate pulls, {} pulls at {low} to {high} N", measured.pulls.len());
    let calibration = |low90: f64, high90: f64| CalibrationFile {
        low90,
        high90,
        evidence: Some(evidence.clone()),
        data_sha256: Some(measured.sha256.clone()),
    };
    let mut values = pull_values(&found.fitted, &found.baseline, predictor.part_names(), &calibration);
    // With the law the coefficient stays that of the twin: a is a factor on it.
    if !found.laws.is_empty() {
        values.retain(|v| !(v.key.starts_with("parts.") && v.key.ends_with(".mu")));
    }
    let plain = |name: &str, part: Option<String>, load_law: bool| EffectFile {
        name: name.into(),
        part,
        fitted_grip_force_n: load_law.then_some([low, high]),
        outside_fit: OutsideFit::Extrapolate,
        per: Per::Jaw,
        reference_area_mm2: None,
        source: Some(evidence.clone()),
        calibration: BTreeMap::new(),
        parameters: BTreeMap::new(),
    };
    let mut effects = Vec::new();
    for law in &found.laws {
        let mut file = plain(OFFSET_LAW.id, Some(law.part.clone()), true);
        for (name, p) in [("a", &law.a), ("b_n", &law.b_n)] {
            file.parameters.insert(name.into(), toml::Value::Float(p.value));
            file.calibration.insert(name.into(), calibration(p.low90, p.high90));
        }
        effects.push(file);
    }
    for (name, parameters) in &found.effects {
        let load_law =
            gripgen_twin::effects::find(name).is_some_and(gripgen_twin::effects::EffectSpec::is_load_law);
        let mut file = plain(name, None, load_law);
        for (parameter, p) in parameters {
            file.parameters.insert(parameter.clone(), toml::Value::Float(p.value));
            file.calibration.insert(parameter.clone(), calibration(p.low90, p.high90));
        }
        effects.push(file);
    }
    Ok((found, TwinEdits { values, effects: Some(effects) }))
}
