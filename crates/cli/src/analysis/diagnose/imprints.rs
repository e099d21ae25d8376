//! Sets of imprints: diagnosis, calibration, comparison.

use super::diagnosed::Diagnosed;
use crate::analysis::imprint_set::ImprintSet;
use crate::analysis::twin_edits::{EditedValue, TwinEdits, calibration_entry, effect_entry};
use gripgen_identify::{
    ImprintComparison, ImprintConstants, ImprintDiagnosis, NamedEffect, ParameterEstimate, SharedConstant,
    Verdict, calibrate_imprint_set, compare_imprints, diagnose_imprints,
};
use gripgen_report::imprint_report;
use gripgen_twin::Twin;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::EffectSpec;
use std::collections::BTreeMap;

/// Diagnoses a set: what imprints do beside `V = c F`.
pub fn diagnose_imprint_table(set: &ImprintSet, twin: &Twin) -> Diagnosed {
    let mut answer = diagnose_imprints(&set.data);
    answer.diagnosis.data.sha256.clone_from(&set.sha256);
    answer.diagnosis.notes.extend(set.notes.iter().cloned());
    let edits = edits(&mut answer, twin, &set.sha256);
    let report = imprint_report(&answer);
    Diagnosed::new(answer.diagnosis, edits, report)
}

/// The constants of a set; the error says what it lacks.
///
/// # Errors
///
/// A set from which no constant follows; the text says why.
pub fn calibrate_imprint_table(set: &ImprintSet, shared: SharedConstant) -> Result<ImprintConstants, String> {
    let mut found = calibrate_imprint_set(&set.data, shared)?;
    found.notes.extend(set.notes.iter().cloned());
    Ok(found)
}

/// Error of `V = c F` with the effects of a twin that imprints can show, the constant of each grasp refitted; the error says what
/// the set lacks. Effects of one part are left aside.
///
/// # Errors
///
/// A set without a grasp of two forces; the text says so.
pub fn compare_imprint_table(set: &ImprintSet, twin: &Twin) -> Result<ImprintComparison, String> {
    let acting = twin.effects.iter().filter(|e| e.spec.imprints.is_some() && e.part.is_none());
    let mut effects: Vec<(&'static EffectSpec, Vec<f64>)> =
        acting.map(|e| (e.spec, e.values.clone())).collect();
    let place = |spec: &EffectSpec| gripgen_twin::effects::LIBRARY.iter().position(|s| s.id == spec.id);
    effects.sort_by_key(|(spec, _)| place(spec));
    compare_imprints(&set.data, &effects)
}

/// Constants as they stand in a twin. `only` names the part of rows that name none. The error says which part the twin lacks.
///
/// # Errors
///
/// A part that the twin does not have, or none that is named.
pub fn imprint_calibration_edits(
    found: &ImprintConstants,
    twin: &Twin,
    only: Option<&str>,
    sha256: &str,
) -> Result<TwinEdits, String> {
    let mut values = Vec::new();
    for constant in &found.parts {
        let part = match (constant.part.as_str(), only) {
            ("", Some(only)) => only,
            ("", None) => return Err("the rows name no part".into()),
            (part, _) => part,
        };
        if !twin.parts.contains_key(part) {
            let known: Vec<&str> = twin.parts.keys().map(String::as_str).collect();
            return Err(format!("the twin has no part `{part}`; its parts: {}", known.join(", ")));
        }
        let (low, high) = found.force_n;
        let evidence = format!(
            "gripgen calibrate imprints, {} rows of {} grasps at {low:.2} to {high:.2} N",
            constant.rows, constant.grasps
        );
        values.push(edited(twin, part, &constant.imprint_mm3_per_n, &evidence, sha256));
    }
    Ok(TwinEdits { values, effects: None })
}

/// The constant of a part for gels of compliance 1, as a file has it: the gels of the twin multiply it. Which jaw was measured is not known.
fn own_constant(twin: &Twin, mm3_per_n: f64) -> f64 {
    2.0 * mm3_per_n / (twin.gel.left.compliance + twin.gel.right.compliance)
}

fn edited(twin: &Twin, part: &str, c: &ParameterEstimate, evidence: &str, sha256: &str) -> EditedValue {
    let own = |mm3_per_n| own_constant(twin, mm3_per_n);
    let c =
        ParameterEstimate { value: own(c.value), low90: own(c.low90), high90: own(c.high90), ..c.clone() };
    EditedValue {
        key: format!("parts.{part}.imprint_mm3_per_n"),
        value: c.value,
        calibration: Some(calibration_entry(&c, evidence, sha256)),
    }
}

/// Constants of parts that the twin has, and the effects that were found. A value outside the library's bounds (a drift of seconds,
/// extrapolated to an hour) cannot stand in a twin, and a note says so. Effects that imprints cannot show stay.
fn edits(answer: &mut ImprintDiagnosis, twin: &Twin, sha256: &str) -> TwinEdits {
    if answer.diagnosis.verdict == Verdict::Insufficient {
        return TwinEdits::default();
    }
    let mut of_part: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for grasp in answer.grasps.iter().filter(|g| twin.parts.contains_key(&g.constant.part)) {
        let c = grasp.constant.imprint_mm3_per_n.value;
        of_part.entry(&grasp.constant.part).or_default().push(libm::log(c.max(1e-9)));
    }
    let constant = |(part, logs): (&str, &Vec<f64>)| EditedValue {
        key: format!("parts.{part}.imprint_mm3_per_n"),
        value: own_constant(twin, libm::exp(logs.iter().sum::<f64>() / logs.len() as f64)),
        calibration: None,
    };
    let values = of_part.iter().map(|(part, logs)| constant((part, logs))).collect();
    let mut effects = Vec::new();
    for (spec, found) in &answer.effects {
        let outside = spec.parameters.iter().zip(found).find(|(p, v)| **v < p.bounds.0 || **v > p.bounds.1);
        if let Some((p, value)) = outside {
            answer.diagnosis.notes.push(format!(
                "{}: {} = {value:.4} {} is outside {} to {}, where a twin can hold it; it is left out of the new twin",
                spec.id, p.name, p.unit, p.bounds.0, p.bounds.1
            ));
            continue;
        }
        let named = answer.diagnosis.effects.iter().find(|e| e.name == spec.id);
        effects.push(effect_file(spec, found, named, sha256));
    }
    if effects.is_empty() {
        return TwinEdits { values, effects: None };
    }
    let kept = twin.effects.iter().filter(|e| e.spec.imprints.is_none() || e.part.is_some());
    let mut all: Vec<EffectFile> = kept.map(kept_file).collect();
    all.extend(effects);
    TwinEdits { values, effects: Some(all) }
}

/// An effect of the twin as it stands.
fn kept_file(effect: &gripgen_twin::effects::Effect) -> EffectFile {
    let mut file = effect_entry(effect.spec.id, "the twin before");
    file.part.clone_from(&effect.part);
    file.fitted_grip_force_n = effect.fitted_grip_force_n.map(|(low, high)| [low, high]);
    file.outside_fit = effect.outside_fit;
    file.per = effect.per;
    file.reference_area_mm2 = effect.reference_area_m2.map(|m2| m2 * 1e6);
    for (p, value) in effect.spec.parameters.iter().zip(&effect.values) {
        file.parameters.insert(p.name.into(), toml::Value::Float(*value));
    }
    file
}

fn effect_file(spec: &EffectSpec, values: &[f64], named: Option<&NamedEffect>, sha256: &str) -> EffectFile {
    let mut file = effect_entry(spec.id, "gripgen diagnose of imprints");
    for (p, value) in spec.parameters.iter().zip(values) {
        file.parameters.insert(p.name.into(), toml::Value::Float(*value));
        if let Some((e, estimate)) = named.and_then(|e| Some((e, e.parameters.get(p.name)?))) {
            let evidence = format!("weight {:.2} among {}", e.weight, e.class.join(", "));
            file.calibration.insert(p.name.into(), calibration_entry(estimate, &evidence, sha256));
        }
    }
    file
}
