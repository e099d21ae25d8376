//! Diagnosis of pulls by one Gaussian model of the labels.

use super::diagnosed::Diagnosed;
use super::pull_values::pull_values;
use crate::analysis::twin_edits::{TwinEdits, calibration_entry, effect_entry};
use gripgen_identify::{Diagnosis, LearntTable, ModelFit, diagnose_by_model};
use gripgen_physics::PullPredictor;
use gripgen_report::ReportData;
use gripgen_twin::config::EffectFile;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{MeasuredPulls, TABLE_EFFECT, Values};

/// Diagnoses a campaign.
pub(super) fn diagnose_pulls_by_model(
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
    given: &PullModel,
    without: &[&str],
    progress: &(dyn Fn(f64) + Sync),
) -> Diagnosed {
    let answer = diagnose_by_model(measured, predictor, given, without, progress);
    let edits = answer.fit.map(|fit| edits(&fit, &answer.diagnosis, measured, predictor.part_names()));
    let report = ReportData { error_unit: "N".into(), ..ReportData::default() };
    Diagnosed::new(answer.diagnosis, edits.unwrap_or_default(), report)
}

/// The twin that the answer describes.
fn edits(fit: &ModelFit, diagnosis: &Diagnosis, measured: &MeasuredPulls, parts: &[String]) -> TwinEdits {
    let evidence = format!("gripgen diagnose of {} pulls", measured.pulls.len());
    let values = pull_values(&fit.model, &diagnosis.baseline, parts, &evidence, &measured.sha256);
    let effects = fit.model.effects.iter().map(|effect| {
        let part = effect.part.map(|p| parts[p].clone());
        let named = diagnosis.effects.iter().find(|e| e.name == effect.spec.id && e.part == part);
        let mut entry = effect_entry(effect.spec.id, &evidence);
        entry.part = part;
        for (p, value) in effect.spec.parameters.iter().zip(&effect.values) {
            entry.parameters.insert(p.name.into(), toml::Value::Float(*value));
            if let Some(known) = named.and_then(|n| n.parameters.get(p.name)) {
                entry
                    .calibration
                    .insert(p.name.into(), calibration_entry(known, &evidence, &measured.sha256));
            }
        }
        entry
    });
    let effects = effects.chain(fit.tables.iter().map(|table| entry_of(table, &evidence)));
    TwinEdits { values, effects: Some(effects.collect()) }
}

/// A table as it stands in a twin, marked as not physical.
fn entry_of(table: &LearntTable, evidence: &str) -> EffectFile {
    let numbers = |x: &[f64]| toml::Value::Array(x.iter().copied().map(toml::Value::Float).collect());
    let text = |s: &String| toml::Value::String(s.clone());
    let mut entry = effect_entry(TABLE_EFFECT, evidence);
    entry.part.clone_from(&table.part);
    let mut put = |key: &str, value: toml::Value| drop(entry.parameters.insert(key.into(), value));
    put("covariate", text(&table.covariate));
    put("physical", toml::Value::Boolean(false));
    put("factor", numbers(&table.factor));
    match &table.places {
        Values::Numbers(x) => put("x", numbers(x)),
        Values::Words(words) => put("words", toml::Value::Array(words.iter().map(text).collect())),
    }
    if let Some(centre) = &table.centre {
        put("centre", numbers(centre));
    }
    if let Some((column, word)) = &table.only {
        put("where", toml::Table::from_iter([(column.clone(), text(word))]).into());
    }
    entry
}
