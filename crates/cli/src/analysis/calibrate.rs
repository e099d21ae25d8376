//! Calibration of a twin from measured pulls.

use crate::analysis::diagnose::{PullTwinError, check_fit, given_model, pull_values};
use crate::analysis::expect::pull_predictor;
use crate::analysis::priors::shipped_priors;
use crate::analysis::twin_edits::{TwinEdits, effect_entry, put_estimate};
use gripgen::Library;
use gripgen_identify::pulls::calibrate::{
    CalibrateError, CalibrateRequest, PullCalibration, calibrate_pulls,
};
use gripgen_identify::pulls::data::PullData;
use gripgen_identify::pulls::few::FewDensity;
use gripgen_identify::pulls::priors::PullPriors;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::{EffectSpec, OFFSET_LAW, find};
use gripgen_twin::{MeasuredPulls, Twin};

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

/// Asks the posterior density of which [`calibrate_twin`] has draws, of few labels without traces: see [`FewDensity`]. `None` where nothing can be
/// predicted.
///
/// # Errors
///
/// A twin that lacks a part of the campaign.
pub fn with_few_density<T>(
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    priors: &PullPriors,
    law: bool,
    ask: impl FnOnce(&FewDensity<'_>) -> T,
) -> Result<Option<T>, CalibratePullsError> {
    check_fit(measured, twin)?;
    let predictor = pull_predictor(measured, twin, library, 1);
    let given = given_model(twin, predictor.part_names()).map_err(PullTwinError::from)?;
    let data = PullData::new(measured);
    Ok(FewDensity::new(&data, &predictor, &given, priors, law).map(|density| ask(&density)))
}

/// Fits the baseline of `twin` to measured pulls, with the law and the effects asked for, and returns what changes in the
/// twin. Its own effects on pulls are replaced by those fitted; laws are written for the range they were fitted on, and
/// extrapolated. Few pulls are weighed with the beliefs of the request, or those that are shipped.
///
/// # Errors
///
/// A part that the twin lacks, a twist that fits cannot follow, or pulls that allow no fit.
pub fn calibrate_twin(
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    request: &CalibrateRequest,
    jobs: usize,
) -> Result<(PullCalibration, TwinEdits), CalibratePullsError> {
    check_fit(measured, twin)?;
    let predictor = pull_predictor(measured, twin, library, jobs);
    let given = given_model(twin, predictor.part_names()).map_err(PullTwinError::from)?;
    let mut request = request.clone();
    request.priors.get_or_insert_with(|| shipped_priors(twin));
    let found = calibrate_pulls(measured, &predictor, &given, &request)?;
    let (low, high) = found.grip_force_n;
    let evidence = format!("gripgen calibrate pulls, {} pulls at {low} to {high} N", measured.pulls.len());
    let mut values = pull_values(&found.model, &found.baseline, &predictor, &evidence, &measured.sha256);
    // With the law the coefficient stays that of the twin: a is a factor on it.
    if !found.laws.is_empty() {
        values.retain(|v| !(v.key.starts_with("parts.") && v.key.ends_with(".mu")));
    }
    let plain = |spec: &EffectSpec, part: Option<String>| EffectFile {
        part,
        fitted_grip_force_n: spec.is_load_law().then_some([low, high]),
        ..effect_entry(spec.id, &evidence)
    };
    let mut effects = Vec::new();
    for law in &found.laws {
        let mut entry = plain(OFFSET_LAW, Some(law.part.clone()));
        for (name, p) in [("a", &law.a), ("b_n", &law.b_n)] {
            put_estimate(&mut entry, name, p, &evidence, &measured.sha256);
        }
        effects.push(entry);
    }
    for (spec, parameters) in found.effects.iter().filter_map(|(name, p)| Some((find(name)?, p))) {
        let mut entry = plain(spec, None);
        for (name, p) in parameters {
            put_estimate(&mut entry, name, p, &evidence, &measured.sha256);
        }
        effects.push(entry);
    }
    Ok((found, TwinEdits { values, effects: Some(effects) }))
}
