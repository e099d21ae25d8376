//! Force-sensor tables: diagnosis, calibration, comparison.

use gripgen::report::{Diagnosed, EvidenceRow, Mark, Plot, PlotGroup, ReportData, Series, WorstRow};
use crate::analysis::twin_edits::{TwinEdits, calibration_entry, effect_entry, put_estimate};
use gripgen_identify::{
    Covariate, NamedEffect, ParameterEstimate, SensorCalibration, SensorComparison, SensorData,
    SensorDiagnosis, SensorOptions, Verdict, calibrate_sensor, compare_sensor, diagnose_sensor,
};
use gripgen_measured::{SensorTable, TableError, read_sensor_table};
use gripgen_twin::Twin;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::{EffectSpec, SENSOR_LINE};
use std::path::Path;

/// Most points of a plot.
const MAX_POINTS: usize = 1500;
/// Blocks in the list of the worst.
const WORST: usize = 6;

/// Whether a path looks like a force-sensor table.
pub fn is_sensor_table(path: &Path) -> bool {
    path.join(gripgen_measured::SENSOR_FILE).is_file()
}

/// Reads the table of a folder.
///
/// # Errors
///
/// A table that cannot be read.
pub fn load_sensor_table(folder: &Path) -> Result<SensorTable, TableError> {
    read_sensor_table(folder)
}

/// Diagnoses a table: what the sensor does beside gain and offset of each session.
pub fn diagnose_sensor_table(table: &SensorTable) -> Diagnosed {
    let data = data(table);
    let mut answer = diagnose_sensor(&data, &SensorOptions::default());
    answer.diagnosis.data.sha256.clone_from(&table.sha256);
    let edits = edits(&mut answer, &table.sha256);
    let report = report(&answer);
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

fn report(answer: &SensorDiagnosis) -> ReportData {
    let diagnosis = &answer.diagnosis;
    ReportData {
        title: String::new(),
        sentence: sentence(answer),
        groups: if answer.rows.is_empty() { Vec::new() } else { groups(answer) },
        evidence: answer
            .evidence
            .iter()
            .map(|e| EvidenceRow {
                name: e.name.clone(),
                heldout_gain: e.heldout_gain,
                standard_error: e.standard_error,
                heldout_error: e.heldout_rmse_n,
                values: e.values.clone(),
                fate: e.fate.clone(),
            })
            .collect(),
        worst: answer
            .blocks
            .iter()
            .take(WORST)
            .map(|b| WorstRow {
                id: format!("{} {:.1}..{:.1} s", b.session, b.from_to_s.0, b.from_to_s.1),
                about: format!("held-out error {:.4} N", b.rmse_n),
                measured: b.measured_n,
                predicted: b.predicted_n,
                deviations: b.rmse_n / diagnosis.noise_floor_n.unwrap_or(b.rmse_n).max(f64::MIN_POSITIVE),
            })
            .collect(),
        error_unit: "N".into(),
        ..ReportData::default()
    }
}

/// The verdict in a sentence.
fn sentence(answer: &SensorDiagnosis) -> String {
    let diagnosis = &answer.diagnosis;
    let errors = diagnosis.error.as_ref().and_then(|e| Some((e.before.rmse_n?, e.after.rmse_n?)));
    let unknown = diagnosis.unknown.iter().map(|u| u.covariate.as_str()).collect::<Vec<_>>().join(", ");
    match diagnosis.verdict {
        Verdict::Insufficient => format!(
            "These data cannot answer: {}.",
            diagnosis.notes.first().map_or("too little was measured", String::as_str)
        ),
        Verdict::None => "Nothing beyond gain and offset was found.".into(),
        Verdict::Unknown => {
            format!("The sensor depends on {unknown} in a way that no effect of the library explains.")
        }
        Verdict::Effect => {
            let named: Vec<String> = diagnosis
                .effects
                .iter()
                .map(|e| match e.class.len() {
                    0 | 1 => e.name.clone(),
                    _ => format!("one of {}", e.class.join(", ")),
                })
                .collect();
            let beside = if unknown.is_empty() {
                String::new()
            } else {
                format!(" Beside that it depends on {unknown} in an unknown way.")
            };
            match errors {
                Some((before, after)) => format!(
                    "The sensor shows {}: held-out error {before:.3} N before, {after:.3} N after.{beside}",
                    named.join(" and ")
                ),
                None => format!("The sensor shows {}.{beside}", named.join(" and ")),
            }
        }
    }
}

fn groups(answer: &SensorDiagnosis) -> Vec<PlotGroup> {
    let step = answer.rows.len().div_ceil(MAX_POINTS);
    let rows: Vec<_> = answer.rows.iter().step_by(step).collect();
    let residuals = |x: &dyn Fn(&gripgen_identify::SensorRow) -> f64| -> Vec<Series> {
        let series = |name: &str, predicted: &dyn Fn(&gripgen_identify::SensorRow) -> f64| Series {
            name: name.into(),
            mark: Mark::Points,
            points: rows.iter().map(|r| (x(r), r.measured_n - predicted(r))).collect(),
            errors: Vec::new(),
        };
        vec![series("gain and offset", &|r| r.before_n), series("with the effects", &|r| r.after_n)]
    };
    let plot = |title: &str, x_label: &str, series: Vec<Series>| Plot {
        title: title.into(),
        x_label: x_label.into(),
        y_label: "residual [N]".into(),
        x_words: Vec::new(),
        series,
    };
    let against = vec![
        plot("Against time", "time since the start of the table [s]", residuals(&|r| r.clock_s)),
        plot("Against the force", "reference force [N]", residuals(&|r| r.reference_n)),
        plot("Against its change", "change of the reference force [N/s]", residuals(&|r| r.rate_n_per_s)),
    ];
    let both = answer
        .sessions
        .iter()
        .enumerate()
        .map(|(s, name)| {
            let of: Vec<_> = rows.iter().filter(|r| r.session == s).collect();
            let points = |y: &dyn Fn(&gripgen_identify::SensorRow) -> f64| {
                of.iter().map(|r| (r.clock_s, y(r))).collect::<Vec<(f64, f64)>>()
            };
            let series =
                |name: &str, mark, points| Series { name: name.into(), mark, points, errors: Vec::new() };
            Plot {
                title: format!("Session {name}"),
                x_label: "time since the start of the table [s]".into(),
                y_label: "reading [N]".into(),
                x_words: Vec::new(),
                series: vec![
                    series("measured", Mark::Points, points(&|r| r.measured_n)),
                    series("gain and offset", Mark::Line, points(&|r| r.before_n)),
                    series("with the effects", Mark::Line, points(&|r| r.after_n)),
                ],
            }
        })
        .take(6)
        .collect();
    vec![
        PlotGroup {
            title: "What is left".into(),
            about: "Reading less prediction; every block was predicted from the other five of its session."
                .into(),
            plots: against,
        },
        PlotGroup {
            title: "Readings".into(),
            about: "Measured, and predicted from the other blocks.".into(),
            plots: both,
        },
    ]
}
