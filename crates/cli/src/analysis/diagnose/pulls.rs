//! Diagnosis of pulls through the reduced mechanics.

use super::diagnosed::Diagnosed;
use super::few::diagnose_few_pulls;
use super::model::{diagnose_pulls_by_model, few_with_model, model_instead};
use super::next::next_pulls;
use super::pull_values::pull_values;
use crate::analysis::expect::pull_predictor;
use crate::analysis::twin_edits::{TwinEdits, calibration_entry, effect_entry};
use gripgen::Library;
use gripgen_identify::pulls::answer::{PullFits, PullOptions, diagnose_pulls};
use gripgen_identify::pulls::curves::Curve;
use gripgen_identify::pulls::data::{Column, PullData};
use gripgen_identify::pulls::few_diagnosis::is_few;
use gripgen_identify::{Diagnosis, describe_by_process};
use gripgen_physics::PullPredictor;
use gripgen_report::pull_report;
use gripgen_twin::columns::value;
use gripgen_twin::config::{EffectFile, Twist};
use gripgen_twin::effects::find;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{MeasuredPull, MeasuredPulls, TABLE_EFFECT, Twin};
use std::collections::{BTreeMap, BTreeSet};

/// How causes are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Engine {
    /// The search, unless the model predicts held-out pulls better.
    #[default]
    Auto,
    /// A competition of fits.
    Search,
    /// One Gaussian model of the labels.
    Model,
}

/// How a diagnosis of pulls is made.
#[derive(Default)]
pub struct PullDiagnoseOptions<'a> {
    /// Worker threads.
    pub jobs: usize,
    /// Effects that must not compete.
    pub without: &'a [&'a str],
    /// How causes are found.
    pub engine: Engine,
}

/// A part was measured that the twin does not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the measurements have a part `{part}`, the twin has {known}")]
pub struct UnknownPartError {
    /// The part.
    pub part: String,
    /// Parts of the twin.
    pub known: String,
}

fn known_part<'a>(twin: &'a Twin, name: &str) -> Result<&'a gripgen_twin::Part, UnknownPartError> {
    let known = || twin.parts.keys().cloned().collect::<Vec<_>>().join(", ");
    twin.parts.get(name).ok_or_else(|| UnknownPartError { part: name.into(), known: known() })
}

/// Whether the twin has every part that was measured.
pub(crate) fn check_parts(measured: &MeasuredPulls, twin: &Twin) -> Result<(), UnknownPartError> {
    measured.pulls.iter().try_for_each(|pull| known_part(twin, &pull.part).map(drop))
}

/// Why pulls cannot be held against a twin.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PullTwinError {
    /// A part that the twin lacks.
    #[error(transparent)]
    Part(#[from] UnknownPartError),
    /// A twin whose grips turn: what an off-centre pull loses then is no effect that could be fitted.
    #[error("robot.twist = \"free\": fits need a grip that does not turn")]
    FreeTwist,
}

impl PullTwinError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            PullTwinError::Part(_) => {
                "name a twin that has this part with --twin, or the column `part` as the twin does"
            }
            PullTwinError::FreeTwist => {
                "set robot.twist = \"stiff\"; an effect of the grip offset then stands for what is lost"
            }
        }
    }
}

/// Whether fits can start from this twin.
pub(crate) fn check_fit(measured: &MeasuredPulls, twin: &Twin) -> Result<(), PullTwinError> {
    check_parts(measured, twin)?;
    if twin.robot.twist == Twist::Free {
        return Err(PullTwinError::FreeTwist);
    }
    Ok(())
}

/// What a twin says of pulls, without its effects: where fits start.
///
/// # Errors
///
/// A part that the twin lacks.
pub fn given_model(twin: &Twin, parts: &[String]) -> Result<PullModel, UnknownPartError> {
    let found = parts.iter().map(|name| known_part(twin, name)).collect::<Result<Vec<_>, _>>()?;
    let mean = |f: &dyn Fn(&gripgen_twin::Part) -> f64| {
        found.iter().map(|p| f(p)).sum::<f64>() / found.len().max(1) as f64
    };
    Ok(PullModel {
        mu: found.iter().map(|p| p.mu).collect(),
        kinetic_ratio: mean(&|p| p.kinetic_ratio),
        lag_s: twin.robot.lag_s,
        dead_time_s: twin.robot.dead_time_s,
        stiffness_n_per_m: twin.gel.left.shear_stiffness_n_per_m + twin.gel.right.shear_stiffness_n_per_m,
        bent_at_s: (twin.robot.lag_s, twin.robot.dead_time_s),
        shear_by_area: 0.5 * (twin.gel.left.shear_by_area + twin.gel.right.shear_by_area),
        damping_n_s_per_m: twin.robot.damping_n_s_per_m,
        apparent_mass_kg: None,
        fall_s: 0.0,
        misread_n: 0.0,
        noise_n: twin.wrist.noise_n,
        scatter: mean(&|p| p.scatter),
        effects: vec![],
        creep: None,
        factor: vec![],
    })
}

/// Pulls that are looked at most: what so many do not show is too small to matter, and a fit takes as long as it has pulls.
const MAX_PULLS: usize = 2000;

/// Diagnoses a campaign of pulls. `progress` is told the share that is done. Of a very long campaign every so many pulls are
/// looked at, and a note says so. `library` holds the files of the twin.
///
/// # Errors
///
/// A part that the twin lacks, or a twist that fits cannot follow.
pub fn diagnose_pull_table(
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    options: &PullDiagnoseOptions<'_>,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Diagnosed, PullTwinError> {
    check_fit(measured, twin)?;
    let step = measured.pulls.len().div_ceil(MAX_PULLS);
    if step > 1 {
        let mut found = diagnose_pull_table(&measured.every(step), twin, library, options, progress)?;
        let note = format!(
            "one of every {step} of {} pulls was looked at, {} of them",
            measured.pulls.len(),
            measured.pulls.len().div_ceil(step)
        );
        found.diagnosis.notes.insert(0, note);
        return Ok(found);
    }
    let predictor = pull_predictor(measured, twin, library, options.jobs);
    let given = given_model(twin, predictor.part_names())?;
    if options.engine == Engine::Model {
        let mut found = diagnose_pulls_by_model(measured, &predictor, &given, options.without, progress);
        found.diagnosis.notes.extend(without_its_effects(twin));
        return Ok(found);
    }
    if is_few(measured) {
        let mut found = diagnose_few_pulls(measured, &predictor, &given, twin);
        if options.engine == Engine::Auto {
            let model = describe_by_process(measured, &predictor, &given, None);
            found = few_with_model(found, model, measured, &predictor);
        }
        found.diagnosis.notes.extend(without_its_effects(twin));
        return Ok(found);
    }
    let asked = PullOptions { without: options.without };
    let answer = diagnose_pulls(measured, &predictor, &given, &asked, progress);
    if let Some((rest, note)) = without_gaps(measured, &answer.diagnosis) {
        let mut found = diagnose_pull_table(&rest, twin, library, options, progress)?;
        found.diagnosis.notes.push(note);
        return Ok(found);
    }
    if options.engine == Engine::Auto
        && let Some(fits) = &answer.fits
    {
        let other_n = fits.heldout_label_n.each_ref().map(Vec::as_slice);
        let model = describe_by_process(measured, &predictor, &given, Some(other_n));
        let instead = model_instead(model, &answer.diagnosis, fits, measured, &predictor);
        if let Some(mut found) = instead {
            found.diagnosis.notes.extend(without_its_effects(twin));
            return Ok(found);
        }
    }
    let edits =
        answer.fits.as_ref().map(|f| edits(f, &answer.diagnosis, measured, &predictor)).unwrap_or_default();
    let report = pull_report(
        measured,
        &|model, row, times_s| predictor.simulated_trace_n(model, row, times_s),
        &answer,
    );
    let next = match &answer.fits {
        Some(fits) => next_pulls(fits, measured, twin, library, options.jobs),
        None => None,
    };
    let mut diagnosis = answer.diagnosis;
    diagnosis.notes.extend(without_its_effects(twin));
    if let Some(next) = &next {
        let own = diagnosis.effects.iter_mut().filter(|e| next.separates(&e.name));
        for separate in own.filter_map(|e| e.separate_by.as_mut()) {
            separate.text = format!("{}; or {}", separate.text, next.text());
        }
    }
    let posterior = answer.fits.map(|fits| fits.posterior);
    Ok(Diagnosed { next, posterior, ..Diagnosed::new(diagnosis, edits, report) })
}

/// The pulls that have a value in every column that an answer depends on, where some have none: what these columns do to the others is
/// not known, and would look like something else.
fn without_gaps(measured: &MeasuredPulls, found: &Diagnosis) -> Option<(MeasuredPulls, String)> {
    let of_effects = found.effects.iter().filter_map(|e| find(&e.name)).flat_map(|spec| spec.covariates);
    let unnamed = found.unknown.iter().map(|u| &u.covariate);
    let unnamed = unnamed.chain(found.residual.iter().flat_map(|left| &left.covariates));
    let columns: BTreeSet<&str> =
        of_effects.copied().chain(unnamed.flat_map(|name| name.split('*'))).collect();
    let written = |name: &str| {
        let extra = measured.extra.iter().any(|column| column.name == name);
        extra || measured.recorded.iter().any(|column| column == name)
    };
    let columns: Vec<&str> = columns.into_iter().filter(|name| written(name)).collect();
    let lacks = |pull: &MeasuredPull, name: &str| value(name, pull.view()).is_none();
    let gaps: Vec<&str> =
        columns.iter().copied().filter(|name| measured.pulls.iter().any(|p| lacks(p, name))).collect();
    let rest = measured.kept(|i| gaps.iter().all(|name| !lacks(&measured.pulls[i], name)));
    let (all, left) = (measured.pulls.len(), rest.pulls.len());
    // Of many gaps little would be left.
    (left < all && 2 * left >= all).then(|| {
        let note = format!(
            "{} of {all} pulls were left out: they have no {}, on which the answer depends",
            all - left,
            gaps.join(" or ")
        );
        (rest, note)
    })
}

/// That a twin's own effects are looked for again: a fit starts without them, and what is written holds what was found.
fn without_its_effects(twin: &Twin) -> Option<String> {
    let effects = twin.effects.iter().map(|e| e.spec.id.to_string());
    let tables = twin.tables.iter().map(|t| format!("a table over {}", t.covariate));
    let surfaces = twin
        .surfaces
        .iter()
        .map(|s| format!("a surface over {}", s.columns().collect::<Vec<_>>().join(", ")));
    let own: BTreeSet<String> = effects.chain(tables).chain(surfaces).collect();
    (!own.is_empty()).then(|| {
        format!(
            "the effects of the twin that was given ({}) were looked for anew: \"before\" is without them, and a twin that is written has those that were found",
            own.into_iter().collect::<Vec<_>>().join(", ")
        )
    })
}

/// The twin that the answer describes.
fn edits(
    fits: &PullFits,
    diagnosis: &Diagnosis,
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
) -> TwinEdits {
    let model = &fits.after.model;
    let evidence = format!("gripgen diagnose of {} pulls", measured.pulls.len());
    let values = pull_values(model, &diagnosis.baseline, predictor, &evidence, &measured.sha256);
    let forces = measured.pulls.iter().map(|p| p.grip_force_n);
    let range = forces.fold((f64::INFINITY, 0.0_f64), |(low, high), f| (low.min(f), high.max(f)));
    let effects = model.effects.iter().map(|effect| {
        let part = effect.part.map(|p| predictor.part_names()[p].clone());
        let named = diagnosis.effects.iter().find(|e| e.name == effect.spec.id && e.part == part);
        let mut entry = effect_entry(effect.spec.id, &evidence);
        entry.part = part;
        entry.fitted_grip_force_n = effect.spec.friction.map(|_| [range.0, range.1]);
        for (p, value) in effect.spec.parameters.iter().zip(&effect.values) {
            entry.parameters.insert(p.name.into(), toml::Value::Float(*value));
            if let Some(known) = named.and_then(|n| n.parameters.get(p.name)) {
                let calibration = calibration_entry(known, &evidence, &measured.sha256);
                entry.calibration.insert(p.name.into(), calibration);
            }
        }
        entry
    });
    let mut effects: Vec<EffectFile> = effects.collect();
    effects.extend(
        fits.after
            .terms
            .curves
            .iter()
            .chain(&fits.after.terms.learnt)
            .filter_map(|(curve, values)| table(curve, values, measured, &evidence)),
    );
    TwinEdits { values, effects: Some(effects) }
}

/// Points of a table over a product of columns.
const PRODUCT_POINTS: usize = 25;

/// A curve without a name as a table of the twin, marked as not physical.
fn table(
    curve: &Curve,
    coefficients: &[f64],
    measured: &MeasuredPulls,
    evidence: &str,
) -> Option<EffectFile> {
    let data = PullData::new(measured);
    let entry = |parameters| EffectFile { parameters, ..effect_entry(TABLE_EFFECT, evidence) };
    let only = curve.only.as_ref();
    if let Some((a, b)) = curve.name.split_once('*').filter(|_| only.is_none()) {
        return Some(entry(product_table(&data, curve, coefficients, a, b)?));
    }
    let name = only.and_then(|_| curve.name.split_once('*')).map_or(curve.name.as_str(), |(own, _)| own);
    let column = data.columns.get(name)?;
    let sum = |i: usize| curve.basis[i].iter().zip(coefficients).map(|(b, c)| b * c).sum::<f64>();
    let value = |i: usize| if curve.additive { sum(i) } else { libm::exp(sum(i).clamp(-3.0, 3.0)) };
    let mut parameters = BTreeMap::from([
        ("covariate".to_string(), toml::Value::String(name.into())),
        ("physical".to_string(), toml::Value::Boolean(false)),
    ]);
    let own: Vec<usize> = match only {
        Some((other, word)) => {
            let only = toml::Table::from_iter([(other.clone(), toml::Value::String(word.clone()))]);
            parameters.insert("where".into(), toml::Value::Table(only));
            let Some(Column::Word(at, words)) = data.columns.get(other) else { return None };
            (0..at.len()).filter(|&i| words.get(at[i]) == Some(word)).collect()
        }
        None => (0..data.len()).collect(),
    };
    let gaps = data.missing.get(name);
    let own: Vec<usize> = own.into_iter().filter(|i| gaps.is_none_or(|rows| !rows.contains(i))).collect();
    let numbers = |x: Vec<f64>| toml::Value::Array(x.into_iter().map(toml::Value::Float).collect());
    let target = if curve.additive { "offset_n" } else { "factor" };
    match column {
        Column::Word(at, words) => {
            let of_word =
                |w: usize| own.iter().copied().find(|&i| at[i] == w).map_or(Some(1.0), |i| Some(value(i)));
            let values: Option<Vec<f64>> = (0..words.len()).map(of_word).collect();
            parameters.insert(
                "words".into(),
                toml::Value::Array(words.iter().cloned().map(toml::Value::String).collect()),
            );
            parameters.insert(target.into(), numbers(values?));
        }
        Column::Number(x) => {
            let mut points: Vec<(f64, f64)> = own.iter().map(|&i| (x[i], value(i))).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            points.dedup_by(|a, b| a.0 == b.0);
            // Piecewise linear, or a wave of up to one cycle in four pulls.
            let step = points.len().div_ceil(400).max(1);
            let last = points.len() - 1;
            let kept: Vec<(f64, f64)> = points
                .iter()
                .enumerate()
                .filter(|(i, _)| i % step == 0 || *i == last)
                .map(|(_, p)| *p)
                .collect();
            parameters.insert("x".into(), numbers(kept.iter().map(|p| p.0).collect()));
            parameters.insert(target.into(), numbers(kept.iter().map(|p| p.1).collect()));
        }
    }
    Some(entry(parameters))
}

/// What is taken off two columns, and the factor over their product.
fn product_table(
    data: &PullData<'_>,
    curve: &Curve,
    coefficients: &[f64],
    a: &str,
    b: &str,
) -> Option<BTreeMap<String, toml::Value>> {
    let (x, y) = (data.numbers(a)?, data.numbers(b)?);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let centre = [mean(&x), mean(&y)];
    let products: Vec<f64> = x.iter().zip(&y).map(|(x, y)| (x - centre[0]) * (y - centre[1])).collect();
    // The basis is a straight line in the product: two pulls that differ give it.
    let of = |best: fn(f64, f64) -> bool| {
        let known =
            |i: &usize| [a, b].iter().all(|name| data.missing.get(*name).is_none_or(|r| !r.contains(i)));
        (0..products.len()).filter(known).reduce(|i, j| if best(products[j], products[i]) { j } else { i })
    };
    let (low, high) = (of(|a, b| a < b)?, of(|a, b| a > b)?);
    let width = products[high] - products[low];
    if width <= 0.0 {
        return None;
    }
    let slope = (curve.basis[high][0] - curve.basis[low][0]) / width;
    let at = |k: usize| products[low] + width * k as f64 / (PRODUCT_POINTS - 1) as f64;
    let factor = |z: f64| {
        let basis = curve.basis[low][0] + slope * (z - products[low]);
        libm::exp((coefficients[0] * basis).clamp(-3.0, 3.0))
    };
    let numbers = |x: Vec<f64>| toml::Value::Array(x.into_iter().map(toml::Value::Float).collect());
    Some(BTreeMap::from([
        ("covariate".to_string(), toml::Value::String(curve.name.clone())),
        ("centre".to_string(), numbers(centre.to_vec())),
        ("x".to_string(), numbers((0..PRODUCT_POINTS).map(at).collect())),
        ("factor".to_string(), numbers((0..PRODUCT_POINTS).map(|k| factor(at(k))).collect())),
        ("physical".to_string(), toml::Value::Boolean(false)),
    ]))
}
