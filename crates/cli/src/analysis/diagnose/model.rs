//! Diagnosis of pulls by one Gaussian model of the labels.

use super::diagnosed::Diagnosed;
use super::pull_values::pull_values;
use crate::analysis::twin_edits::{TwinEdits, calibration_entry, effect_entry};
use gripgen_identify::pulls::answer::PullFits;
use gripgen_identify::{Diagnosis, LearntTable, ModelAnswer, ModelFit, diagnose_by_model, rms_error_n};
use gripgen_physics::PullPredictor;
use gripgen_report::{Predictions, ReportData, prediction_report};
use gripgen_twin::config::EffectFile;
use gripgen_twin::draw::Drawn;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{MeasuredPulls, SURFACE_EFFECT, Surface, TABLE_EFFECT, Values, rounded};

/// Diagnoses a campaign.
pub(super) fn diagnose_pulls_by_model(
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
    given: &PullModel,
    without: &[&str],
    progress: &(dyn Fn(f64) + Sync),
) -> Diagnosed {
    let answer = diagnose_by_model(measured, predictor, given, without, progress);
    let Some(fit) = answer.fit else {
        return Diagnosed::new(answer.diagnosis, TwinEdits::default(), ReportData::default());
    };
    let edits = edits(&fit, &answer.diagnosis, measured, predictor);
    let report = report(&fit, &answer.diagnosis, measured);
    Diagnosed::new(answer.diagnosis, edits, report)
}

/// The answer of the model in the place of that of the search, where it predicts held-out pulls better.
pub(super) fn model_instead(
    model: ModelAnswer,
    search: &Diagnosis,
    fits: &PullFits,
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
) -> Option<Diagnosed> {
    let fit = model.fit?;
    let label_n: Vec<f64> = measured.pulls.iter().map(|pull| pull.max_pull_force_n).collect();
    let error_n = rms_error_n(&label_n, &fits.heldout_label_n[1]);
    let names = search.effects.iter().map(|e| e.name.clone());
    let unknown = search.unknown.iter().map(|u| u.covariate.clone());
    let names: Vec<String> = names.chain(unknown).collect();
    let mut diagnosis = model.diagnosis;
    diagnosis.notes.push(format!(
        "effects of the library describe these pulls less well than one smooth model: {} N on held-out pulls, outliers among them{}",
        rounded(error_n, &[]),
        if names.is_empty() { String::new() } else { format!(" (they would be {})", names.join(", ")) },
    ));
    diagnosis.would_have_seen.clone_from(&search.would_have_seen);
    let edits = edits(&fit, &diagnosis, measured, predictor);
    let report = report(&fit, &diagnosis, measured);
    Some(Diagnosed::new(diagnosis, edits, report))
}

/// What the report of a fit shows.
fn report(fit: &ModelFit, diagnosis: &Diagnosis, measured: &MeasuredPulls) -> ReportData {
    let predictions = Predictions {
        heldout_label_n: [&fit.heldout_label_n[0], &fit.heldout_label_n[1]],
        label_n: [&fit.label_n[0], &fit.label_n[1]],
        deviations: &fit.deviations,
    };
    let columns = diagnosis.unknown.iter().flat_map(|u| u.covariate.split('*')).map(String::from);
    prediction_report(measured, predictions, &columns.collect::<Vec<_>>())
}

/// The answer to a few pulls, with the twin of the model where it has more than plain friction and errs less on held-out pulls. Nothing
/// is named, so the evidence of the model is enough.
pub(super) fn few_with_model(
    mut few: Diagnosed,
    model: ModelAnswer,
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
) -> Diagnosed {
    let Some(fit) = model.fit else { return few };
    let errors = model.diagnosis.error.as_ref().map(|error| (error.before.rmse_n, error.after.rmse_n));
    let Some((Some(before_n), Some(after_n))) = errors else { return few };
    let plain = fit.model.effects.is_empty() && fit.tables.is_empty() && fit.surface.is_none();
    if plain || after_n >= before_n {
        return few;
    }
    few.diagnosis.notes.push(format!(
        "the twin has tables of what the columns do, which are not physical: they predict held-out pulls with an error of {} N, plain friction with {} N",
        rounded(after_n, &[]),
        rounded(before_n, &[]),
    ));
    few.edits = edits(&fit, &model.diagnosis, measured, predictor);
    few.report = report(&fit, &model.diagnosis, measured);
    few.posterior = None;
    few
}

/// The twin that the answer describes.
fn edits(
    fit: &ModelFit,
    diagnosis: &Diagnosis,
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
) -> TwinEdits {
    let parts = predictor.part_names();
    let evidence = format!("gripgen diagnose of {} pulls", measured.pulls.len());
    let values = pull_values(&fit.model, &diagnosis.baseline, predictor, &evidence, &measured.sha256);
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
    let effects = effects.chain(fit.surface.iter().map(|surface| entry_of_surface(surface, &evidence)));
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

/// A surface as an entry of a twin.
fn entry_of_surface(surface: &Surface, evidence: &str) -> EffectFile {
    let text = |s: &str| toml::Value::String(s.into());
    let floats = |x: &mut dyn Iterator<Item = f64>| toml::Value::Array(x.map(toml::Value::Float).collect());
    let place = |value: &Drawn| match value {
        Drawn::Number(x) => toml::Value::Float(*x),
        Drawn::Text(word) => text(word),
    };
    let logarithm = surface.axes.iter().filter(|axis| axis.logarithm).map(|axis| text(&axis.column));
    let points = surface.points.iter().map(|point| toml::Value::Array(point.iter().map(place).collect()));
    let mut entry = effect_entry(SURFACE_EFFECT, evidence);
    entry.parameters.extend([
        ("physical".into(), toml::Value::Boolean(false)),
        ("columns".into(), toml::Value::Array(surface.columns().map(text).collect())),
        ("lengths".into(), floats(&mut surface.axes.iter().map(|axis| axis.length))),
        ("logarithm".into(), toml::Value::Array(logarithm.collect())),
        ("points".into(), toml::Value::Array(points.collect())),
        ("weights".into(), floats(&mut surface.weights.iter().copied())),
    ]);
    entry
}
