//! Entries of a twin file from what was found in measurements.

use gripgen_identify::ParameterEstimate;
use gripgen_twin::config::{CalibrationFile, EffectFile};
use gripgen_twin::effects::{OutsideFit, Per};
use std::collections::BTreeMap;

/// An effect without values, of every part and every grip force; `source` says where it comes from.
pub(crate) fn effect_entry(name: &str, source: &str) -> EffectFile {
    EffectFile {
        name: name.into(),
        part: None,
        fitted_grip_force_n: None,
        outside_fit: OutsideFit::Extrapolate,
        per: Per::Jaw,
        reference_area_mm2: None,
        source: Some(source.into()),
        calibration: BTreeMap::new(),
        parameters: BTreeMap::new(),
    }
}

/// How well a value is known, and from which data.
pub(crate) fn calibration_entry(value: &ParameterEstimate, evidence: &str, sha256: &str) -> CalibrationFile {
    let (low90, high90) = (value.low90, value.high90);
    let (evidence, data_sha256) = (Some(evidence.into()), Some(sha256.into()));
    CalibrationFile { low90, high90, evidence, data_sha256, before: None }
}

/// Puts a fitted value with its interval into an entry.
pub(crate) fn put_estimate(
    entry: &mut EffectFile,
    parameter: &str,
    value: &ParameterEstimate,
    evidence: &str,
    sha256: &str,
) {
    entry.parameters.insert(parameter.into(), toml::Value::Float(value.value));
    entry.calibration.insert(parameter.into(), calibration_entry(value, evidence, sha256));
}
