//! Force-sensor tables: diagnosis, calibration, comparison.

use super::diagnosed::Diagnosed;
use crate::analysis::twin_edits::{TwinEdits, calibration_entry, effect_entry, put_estimate};
use gripgen_identify::{
    Covariate, NamedEffect, ParameterEstimate, SensorCalibration, SensorComparison, SensorData,
    SensorDiagnosis, SensorOptions, Verdict, calibrate_sensor, compare_sensor, diagnose_sensor,
};
use gripgen_measured::SensorTable;
use gripgen_report::sensor_report;
use gripgen_twin::Twin;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::{EffectSpec, SENSOR_LINE};
use std::path::Path;

/// Whether a path looks like a force-sensor table.
pub fn is_sensor_table(path: &Path) -> bool {
    path.join(gripgen_measured::SENSOR_FILE).is_file()
}

/// Diagnoses a table: what the sensor does beside gain and offset of each session.
pub fn diagnose_sensor_table(table: &SensorTable) -> Diagnosed {
    let data = data(table);
    let mut answer = diagnose_sensor(&data, &SensorOptions::default());
    answer.diagnosis.data.sha256.clone_from(&table.sha256);
    answer.diagnosis.data.missing_cells = table.missing.counts();
    answer.diagnosis.notes.extend(table.missing.notes());
    let edits = edits(&mut answer, &table.sha256);
    let report = sensor_report(&answer);
    Diagnosed::new(answer.diagnosis, edits, report)
}

/// Gain and offset of each session; the error says what the table lacks.
///
/// # Errors
///
/// A table from which gain and offset do not follow; the text says why.
pub fn calibrate_sensor_table(table: &SensorTable) -> Result<SensorCalibration, String> {
    calibrate_sensor(&data(table))
}

/// Error of the sensor effects of a twin on a table, gain and offset of each session refitted; the error says what the
/// table lacks. Gain and bias effects of the twin are part of what is refitted.
///
/// # Errors
///
/// A table from which gain and offset do not follow; the text says why.
pub fn compare_sensor_table(table: &SensorTable, twin: &Twin) -> Result<SensorComparison, String> {
    let acting = twin.effects.iter().filter(|e| e.spec.sensor.is_some() && e.part.is_none());
    let effects: Vec<(&EffectSpec, &[f64])> = acting.map(|e| (e.spec, e.values.as_slice())).collect();
    compare_sensor(&data(table), &effects)
}

fn data(table: &SensorTable) -> SensorData {
    SensorData {
        time_s: table.time_s.clone(),
        reference_force_n: table.reference_force_n.clone(),
        measured_force_n: table.measured_force_n.clone(),
        session: table.session.clone(),
        sessions: table.sessions.clone(),
        extra: table.extra.iter().map(|(name, values)| (name.clone(), Covariate::from(values))).collect(),
    }
}

/// The effects that were found, as they stand in a twin. A value outside the library's bounds (a drift of seconds,
/// extrapolated to an hour) cannot stand there, and a note says so.
fn edits(answer: &mut SensorDiagnosis, sha256: &str) -> TwinEdits {
    if answer.diagnosis.verdict == Verdict::Insufficient {
        return TwinEdits::default();
    }
    let mut effects = Vec::new();
    for (spec, values) in &answer.effects {
        let outside = spec.parameters.iter().zip(values).find(|(p, v)| **v < p.bounds.0 || **v > p.bounds.1);
        if let Some((p, value)) = outside {
            answer.diagnosis.notes.push(format!(
                "{}: {} = {value:.4} {} is outside {} to {}, where a twin can hold it; it is left out of the new twin",
                spec.id, p.name, p.unit, p.bounds.0, p.bounds.1
            ));
            continue;
        }
        let named = answer.diagnosis.effects.iter().find(|e| e.name == spec.id);
        effects.push(effect_file(spec, values, named, sha256));
    }
    TwinEdits { values: Vec::new(), effects: (!effects.is_empty()).then_some(effects) }
}

fn effect_file(spec: &EffectSpec, values: &[f64], named: Option<&NamedEffect>, sha256: &str) -> EffectFile {
    let mut file = effect_entry(spec.id, "gripgen diagnose of a force-sensor table");
    for (p, value) in spec.parameters.iter().zip(values) {
        file.parameters.insert(p.name.into(), toml::Value::Float(*value));
        if let Some((e, estimate)) = named.and_then(|e| Some((e, e.parameters.get(p.name)?))) {
            let evidence = format!("weight {:.2} among {}", e.weight, e.class.join(", "));
            file.calibration.insert(p.name.into(), calibration_entry(estimate, &evidence, sha256));
        }
    }
    file
}

/// Gain and offset of a table as effects of a twin. A twin holds those of one session; the error names both numbers.
///
/// # Errors
///
/// Any number of sessions but one.
pub fn sensor_calibration_edits(calibration: &SensorCalibration, sha256: &str) -> Result<TwinEdits, String> {
    let [session] = calibration.sessions.as_slice() else {
        return Err(format!(
            "{} sessions with a gain each, a twin holds 1; put the session that is meant into a folder of its own",
            calibration.sessions.len()
        ));
    };
    let (low, high) = calibration.reference_range_n;
    let evidence = format!("{} rows, reference {low:.2} to {high:.2} N", session.rows);
    let effect = |spec: &EffectSpec, value: &ParameterEstimate| {
        let mut file = effect_entry(spec.id, "gripgen calibrate sensor");
        let parameter = spec.parameters[0].name;
        put_estimate(&mut file, parameter, value, &evidence, sha256);
        file
    };
    let [gain, bias] = SENSOR_LINE;
    let effects = vec![effect(gain, &session.gain), effect(bias, &session.offset)];
    Ok(TwinEdits { values: Vec::new(), effects: Some(effects) })
}
