//! Draws of causes and parameters from fits: what is handed on to sweeps and comparisons.
//!
//! Around each fit the parameters are normal inside their bounds (`intervals.rs`), with the scale of Student's t. Causes are the
//! accepted model, the models with a tied effect in the place of an accepted one, and the baseline, by their odds.

use super::fitting::Fitted;
use super::intervals::NormalFit;
use super::search::Accepted;
use crate::diagnosis::Diagnosis;
use gripgen_twin::effects::OFFSET_LAW;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{Posterior, PosteriorDraw};
use std::collections::BTreeMap;

/// Draws that are handed on.
const DRAWS: usize = 400;

/// Odds are taken to this power, because no model here is exactly right: as in the answer.
const TEMPER: f64 = 0.6;

/// By how much more than a fit says formulas differ from what acts: as in the intervals of the answer.
const FORMULA: f64 = 1.5;

/// Least weight of a cause that is handed on.
const LEAST: f64 = 0.005;

/// A draw: its weight, its cause, its values by key.
type Draw = (f64, String, Vec<(String, f64)>);

/// Draws by key, each with its cause and weight: the keys of all become columns.
#[derive(Default)]
struct Drawn(Vec<Draw>);

impl Drawn {
    fn into_posterior(self) -> Posterior {
        let mut keys: Vec<String> = Vec::new();
        for (key, _) in self.0.iter().flat_map(|(_, _, values)| values) {
            if !keys.contains(key) && Posterior::can_hold(key) {
                keys.push(key.clone());
            }
        }
        let draws = self.0.into_iter().map(|(weight, cause, values)| {
            let values: BTreeMap<String, f64> = values.into_iter().collect();
            PosteriorDraw { weight, cause, values: keys.iter().map(|key| values.get(key).copied()).collect() }
        });
        let mut found = Posterior { draws: draws.collect(), keys };
        found.normalize();
        found
    }
}

/// Keys and values of a model in its twin. Where `law_of` has the coefficients of the twin they stay, and the offset law of a part
/// has all of its friction.
fn values_of(model: &PullModel, parts: &[String], law_of: Option<&[f64]>) -> Vec<(String, f64)> {
    let mut values = vec![
        ("robot.lag_s".to_string(), model.lag_s.max(0.0)),
        ("robot.dead_time_s".to_string(), model.dead_time_s.max(0.0)),
    ];
    for (part, name) in parts.iter().enumerate() {
        if law_of.is_none() {
            values.push((format!("parts.{name}.mu"), model.mu[part].clamp(1e-3, 3.0)));
        }
        values.push((format!("parts.{name}.kinetic_ratio"), model.kinetic_ratio.clamp(0.05, 1.0)));
    }
    for effect in &model.effects {
        let part = effect.part.map(|p| &parts[p]);
        let section = part.map_or_else(
            || format!("effects.{}", effect.spec.id),
            |part| format!("effects.{}.{part}", effect.spec.id),
        );
        let factor = match (law_of, effect.part) {
            (Some(given), Some(part)) if effect.spec == OFFSET_LAW => model.mu[part] / given[part],
            _ => 1.0,
        };
        for (p, value) in effect.spec.parameters.iter().zip(&effect.values) {
            values.push((format!("{section}.{}", p.name), (factor * value).clamp(p.bounds.0, p.bounds.1)));
        }
    }
    values
}

/// Draws of a fit. What is stated lies by `moved` beside it.
fn draws_of(
    fitted: &Fitted,
    normal: &NormalFit,
    stated: &Fitted,
    count: usize,
    (wider, lane): (f64, u64),
) -> Vec<PullModel> {
    let moved: Vec<f64> = stated.values.iter().zip(&fitted.values).map(|(s, f)| s - f).collect();
    let models = normal.draws(count, wider, lane).into_iter().map(|values| {
        let at: Vec<f64> = values.iter().zip(&moved).map(|(v, m)| v + m).collect();
        stated.with_values(&at)
    });
    models.collect()
}

/// Of a calibration: one cause.
pub(super) fn of_calibration(
    fitted: &Fitted,
    normal: &NormalFit,
    stated: &Fitted,
    parts: &[String],
    law_of: Option<&[f64]>,
) -> Posterior {
    let cause = cause_of(&stated.model, "none");
    let drawn = draws_of(fitted, normal, stated, DRAWS, (1.0, 0)).into_iter();
    let each = drawn.map(|model| (1.0, cause.clone(), values_of(&model, parts, law_of)));
    Drawn(each.collect()).into_posterior()
}

/// Ids of what acts in a model, joined by `+`.
fn cause_of(model: &PullModel, nothing: &str) -> String {
    let mut ids: Vec<&str> = model.effects.iter().map(|e| e.spec.id).collect();
    ids.sort_unstable();
    ids.dedup();
    if ids.is_empty() { nothing.into() } else { ids.join("+") }
}

/// Of a diagnosis: the accepted model `after`, its rivals, and the baseline. `assumed` is the kinetic ratio that is taken for granted
/// where no trace shows it.
pub(super) fn of_diagnosis(
    before: &Fitted,
    after: &Fitted,
    accepted: &Accepted,
    diagnosis: &Diagnosis,
    (pulls, parts): (usize, &[String]),
    assumed: Option<(f64, f64)>,
) -> Posterior {
    // A shape that goes with a column, or what was learnt of the residual.
    let unknown = !accepted.curves.is_empty() || diagnosis.residual.is_some();
    let unnamed = if unknown { "unknown" } else { "none" };
    let mut causes: Vec<(f64, String, &Fitted)> = vec![(1.0, cause_of(&after.model, unnamed), after)];
    // Entries of the diagnosis are not in the order of the terms: rivals are found by their names.
    for tied in accepted.effects.iter().flat_map(|(_, tied)| tied) {
        let cause = cause_of(&tied.fitted.model, unnamed);
        let odds =
            rival_odds(diagnosis, after, &tied.fitted).unwrap_or_else(|| libm::exp(TEMPER * tied.less));
        causes.push((odds, cause, &tied.fitted));
    }
    if !accepted.effects.is_empty() || unknown {
        let less = after.score(pulls) - before.score(pulls);
        causes.push((libm::exp(-TEMPER * less.max(0.0)), "none".into(), before));
    }
    let sum: f64 = causes.iter().map(|(odds, ..)| odds).sum();
    causes.retain(|(odds, ..)| *odds > LEAST * sum);
    let sum: f64 = causes.iter().map(|(odds, ..)| odds).sum();
    let mut drawn = Drawn::default();
    for (lane, (odds, cause, fitted)) in causes.iter().enumerate() {
        let weight = odds / sum;
        let count = ((DRAWS as f64 * weight).round() as usize).max(DRAWS / 20);
        let normal = NormalFit::new(fitted, pulls, parts.len(), assumed);
        for model in draws_of(fitted, &normal, fitted, count, (FORMULA, lane as u64)) {
            drawn.0.push((weight / count as f64, cause.clone(), values_of(&model, parts, None)));
        }
    }
    drawn.into_posterior()
}

/// Odds of a tied model against the accepted one, as the answer states them: of the effect that takes the place of another.
fn rival_odds(diagnosis: &Diagnosis, after: &Fitted, tied: &Fitted) -> Option<f64> {
    let has = |fitted: &Fitted, id: &str| fitted.model.effects.iter().any(|e| e.spec.id == id);
    let named = diagnosis.effects.iter().find(|e| !has(tied, &e.name))?;
    let rival = named.indistinguishable_from.iter().find(|r| has(tied, &r.name) && !has(after, &r.name))?;
    (named.weight > 0.0).then(|| rival.weight / named.weight)
}
