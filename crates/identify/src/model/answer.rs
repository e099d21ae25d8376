//! From a campaign to an answer: what is said, the twin that follows, and its error on pulls that the fit has not seen.

use super::gaussian::Gaussian;
use super::heldout::{BY_CHANCE, above_fast_n, expected_n, heldout_n, model_of, predicts_better};
use super::naming::{said, sure, tied, together};
use super::process::{Added, Process};
use super::search::{Fit, Search};
use super::settings::{Setting, settings};
use super::sizes::{amplitude_of, shape_of, values_of};
use super::tables::{LearntTable, tables};
use super::terms::{Kind, all_terms, effect_shape};
use crate::diagnosis::{Diagnosis, ErrorReport, ErrorsBy, ParameterEstimate};
use crate::pulls::answer::{MIN_PULLS, blank, insufficient};
use crate::pulls::candidates::{Candidate, candidates};
use crate::pulls::context::Context;
use crate::pulls::data::PullData;
use crate::pulls::error_interval::{Judged, errors};
use crate::pulls::heldout::{folds, noise_floor_n};
use gripgen_twin::predict::{PredictPulls, PullModel};
use gripgen_twin::{MeasuredPulls, Surface};
use std::collections::BTreeMap;

/// Times that labels are corrected for what the simulator says of the fitted model.
const CORRECTED: usize = 2;
/// Searches at most, each from the refined model of the one before.
const SEARCHES: usize = 3;
/// Rounds in which values of effects are refined.
const REFINED: usize = 3;

/// An answer, and what a twin needs in addition to it.
#[derive(Debug, Clone)]
pub struct ModelAnswer {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// What was fitted; not there if the data are insufficient.
    pub fit: Option<ModelFit>,
}

/// What was fitted.
#[derive(Debug, Clone)]
pub struct ModelFit {
    /// Friction, effects, scatter.
    pub model: PullModel,
    /// Curves without a name.
    pub tables: Vec<LearntTable>,
    /// What columns do together without a name.
    pub surface: Option<Surface>,
    /// Labels predicted for held-out pulls by friction of the parts alone, and by this model.
    pub heldout_label_n: [Vec<f64>; 2],
    /// The same of the fits to all pulls.
    pub label_n: [Vec<f64>; 2],
    /// How far each pull is from what the others say of it, in standard deviations.
    pub deviations: Vec<f64>,
}

/// Diagnoses a campaign from a baseline. `progress` is told the share that is done.
pub fn diagnose_by_model(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    without: &[&str],
    progress: &(dyn Fn(f64) + Sync),
) -> ModelAnswer {
    diagnose(measured, predictor, given, Some(without), None, progress)
}

/// Describes a campaign from a baseline by a smooth process over its columns, in which nothing has a name. There is no fit where `other_n`,
/// labels that something else predicts for held-out pulls before and after what it found was added, are not worse after it. Its error before is then that
/// of the same predictions.
pub fn describe_by_process(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    other_n: Option<[&[f64]; 2]>,
) -> ModelAnswer {
    diagnose(measured, predictor, given, None, other_n, &|_| {})
}

/// `without` are effects that must not be named; nothing is named where it is missing.
fn diagnose(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    without: Option<&[&str]>,
    other_n: Option<[&[f64]; 2]>,
    progress: &(dyn Fn(f64) + Sync),
) -> ModelAnswer {
    let data = PullData::new(measured);
    let mut diagnosis = blank(&data);
    // Fewer pulls than the other engine takes are the same model, with more of the priors in it.
    if let Some(missing) = insufficient(&data).filter(|_| data.len() >= MIN_PULLS) {
        diagnosis.notes.push(missing);
        return ModelAnswer { diagnosis, fit: None };
    }
    let max_n = data.label_n.iter().copied().fold(0.0, f64::max);
    let candidates = without.map_or(vec![], |without| candidates(&data, max_n, None, without));
    // Force loop, stiffness and the fall after the slip are what traces show, where there are some.
    let context = Context::new(&data, predictor, given);
    let seen = !context.observations.is_empty();
    let given = if seen { &PullModel { noise_n: given.noise_n, ..context.base.clone() } } else { given };
    let ratio = context.kinetic.map(|(ratio, _)| ratio);
    let settings = settings(&data, predictor, given, seen, ratio);
    progress(0.3);
    let found = settings.into_iter().filter_map(|mut setting| {
        let z = setting.search.explained(&setting.plain);
        setting.search.terms = all_terms(&data, &setting.curves, predictor, &candidates, &z);
        let near = setting.search.widen_outliers()?;
        setting.look_near(&data.label_n, &near);
        setting.plain = setting.search.plain()?;
        if without.is_none() {
            return Some((setting.plain.score + setting.log_prior, setting.plain.clone(), setting));
        }
        let mut fit = setting.search.run(setting.plain.clone());
        for _ in 0..SEARCHES {
            let refined = refined(&data, predictor, &candidates, &mut setting, fit);
            let before = refined.chosen.clone();
            fit = setting.search.run(refined);
            if fit.chosen == before {
                break;
            }
        }
        let fit = refined(&data, predictor, &candidates, &mut setting, fit);
        progress(0.6);
        Some((fit.score + setting.log_prior, fit, setting))
    });
    let Some((_, fit, mut setting)) = found.reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
        diagnosis
            .notes
            .push("the labels cannot be predicted at all: is the unit of the forces newton?".into());
        return ModelAnswer { diagnosis, fit: None };
    };
    let fit = sure(&setting.search, fit);
    let Added { process, mut fit, instead, nothing } =
        Process::added(&data, &candidates, &setting.search, &fit, without.is_none());
    if instead {
        diagnosis.unknown.push(together(&setting.search, &fit, &process.columns(), nothing));
        diagnosis.notes.extend(tied(&data, &process.columns()));
    }
    said(&data, &candidates, &setting.search, &fit, &mut diagnosis);
    let repetitions = folds(data.len());
    // Like with like: the other prediction keeps what it chose with all pulls, too.
    let better = |setting: &Setting, fit: &Fit| {
        let own_n = || heldout_n(&data, setting, fit, None, &repetitions);
        other_n.is_none_or(|other_n| predicts_better(&data.label_n, other_n[1], &own_n()))
    };
    if other_n.is_some() && (!instead || nothing > BY_CHANCE || !better(&setting, &fit)) {
        return ModelAnswer { diagnosis, fit: None };
    }
    for _ in 0..CORRECTED {
        let above_n = above_fast_n(&data, predictor, &candidates, &setting, &fit);
        setting.above_n = above_n;
        let z = setting.search.explained(&fit);
        setting.look_near(&data.label_n, &z);
        let again = setting.search.refitted(&fit).zip(setting.search.plain());
        let Some((next, plain)) = again else { break };
        (fit, setting.plain) = (next, plain);
    }
    if !better(&setting, &fit) {
        return ModelAnswer { diagnosis, fit: None };
    }
    let mut after = model_of(&data, &candidates, &setting, &fit);
    let mut learnt = learnt(&data, &setting.search, &fit);
    let (tables, surface, added) = process.written(&data, &setting.search, &fit);
    learnt.extend(tables);
    after.mu.iter_mut().zip(&added).for_each(|(mu, added)| *mu *= libm::exp(-added));
    diagnosis.conclude();
    let wider = &setting.search.measured.wider;
    diagnosis.data.outliers =
        (0..data.len()).filter(|&i| wider[i] > 1.0).map(|i| measured.pulls[i].id.clone()).collect();
    let heldout = [(&setting.plain, None), (&fit, Some(&process).filter(|_| !fit.process.is_empty()))]
        .map(|(fit, process)| heldout_n(&data, &setting, fit, process, &repetitions));
    let [before, after_n] = heldout;
    let heldout = [other_n.map_or(before, |other_n| other_n[0].to_vec()), after_n];
    let all: Vec<usize> = (0..data.len()).collect();
    let scatter = libm::exp(fit.gaussian.log_noise[0]);
    let sd_n: Vec<f64> = all.iter().map(|&i| libm::hypot(scatter * data.label_n[i], given.noise_n)).collect();
    let judged = Judged { label_n: &data.label_n, sd_n: &sd_n, groups: &data.group_of, rows: &all };
    diagnosis.error = errors(&judged, &heldout[0], &heldout[1]).map(|pair| ErrorReport {
        heldout: "repetitions".into(),
        before: pair.before,
        after: pair.after,
        by: ErrorsBy::default(),
    });
    let own: Vec<f64> = all.iter().map(|&i| data.label_n[i] - heldout[1][i]).collect();
    diagnosis.noise_floor_n = Some(noise_floor_n(&own, &data.group_of, data.parts.len() + fit.chosen.len()));
    diagnosis.baseline = parts_estimates(&data, &after, &fit.gaussian);
    if seen {
        // Damping, stiffness and mass go into the twin with it.
        let damping = after.damping_n_s_per_m;
        let estimate = ParameterEstimate::new(damping, (damping, damping), "N s/m");
        diagnosis.baseline.insert("robot.damping_n_s_per_m".into(), estimate);
    }
    let label_n = [&setting.plain, &fit].map(|fit| {
        let z = setting.search.explained(fit);
        all.iter().map(|&i| expected_n(&setting, i, z[i], scatter)).collect()
    });
    let deviations = fit.gaussian.left_out();
    progress(1.0);
    let fit =
        ModelFit { model: after, tables: learnt, surface, heldout_label_n: heldout, label_n, deviations };
    ModelAnswer { diagnosis, fit: Some(fit) }
}

/// A fit with the values of its effects where the evidence is highest: sizes from their coefficients, other values by trying.
fn refined(
    data: &PullData<'_>,
    predictor: &dyn PredictPulls,
    candidates: &[Candidate],
    setting: &mut Setting,
    mut fit: Fit,
) -> Fit {
    for _ in 0..REFINED {
        for place in 0..fit.chosen.len() {
            let z = friction(data, candidates, &setting.search, &fit);
            let Kind::Effect(e) = setting.search.terms[fit.chosen[place].term].kind else { continue };
            let candidate = &candidates[e];
            let Some(values) = values_of(candidate, &setting.search, &fit, place) else { continue };
            let mut tried = vec![values.clone()];
            for &(k, scale) in candidate.free.iter().skip(1) {
                let p = &candidate.spec.parameters[k];
                let bounds = candidate.spec.pulls.map_or(p.bounds, |f| (f.bounds)(p.name, &values, p.bounds));
                for step in [-2.0, -1.0, 1.0, 2.0] {
                    let mut moved = values.clone();
                    moved[k] = (values[k] + step * scale).clamp(bounds.0, bounds.1);
                    tried.push(moved);
                }
            }
            // The column of the values as they are is right whether or not its score is higher, and the one that promised more was not.
            let term = fit.chosen[place].term;
            let mut own = setting.search.terms[term].shapes.clone();
            for (k, values) in tried.into_iter().enumerate() {
                let Some(shape) = effect_shape(data, &setting.curves, predictor, candidate, values, &z)
                else {
                    continue;
                };
                let mut next = fit.clone();
                next.chosen[place].shape = 0;
                setting.search.terms[term].shapes = vec![shape];
                match setting.search.refitted(&next).filter(|next| k == 0 || next.score > fit.score) {
                    Some(next) => {
                        fit = next;
                        own.clone_from(&setting.search.terms[term].shapes);
                    }
                    None => setting.search.terms[term].shapes.clone_from(&own),
                }
            }
        }
    }
    fit
}

/// Logarithms of the friction itself: what labels show, less what the effects on signals add to it.
fn friction(data: &PullData<'_>, candidates: &[Candidate], search: &Search, fit: &Fit) -> Vec<f64> {
    let mut z = search.explained(fit);
    for (place, chosen) in fit.chosen.iter().enumerate() {
        let (kind, at) = (&search.terms[chosen.term].kind, shape_of(search, chosen).at.as_ref());
        let (Kind::Effect(e) | Kind::EffectOfParts(e), Some(at)) = (kind, at) else { continue };
        if !candidates[*e].acts_on_signals() {
            continue;
        }
        let column = fit.gaussian.part(search.block_of(place));
        let one = matches!(kind, Kind::Effect(_));
        for (i, z) in z.iter_mut().enumerate() {
            let part = data.part_of[i];
            let share = amplitude_of(search, fit, place, if one { 0 } else { part }).map_or(0.0, |a| a.0);
            *z -= column[i] + share * at.means[part];
        }
    }
    z
}

fn learnt(data: &PullData<'_>, search: &Search, fit: &Fit) -> Vec<LearntTable> {
    let each = fit.chosen.iter().enumerate().flat_map(|(place, chosen)| {
        let log_factor: Vec<f64> = fit.gaussian.part(search.block_of(place)).iter().copied().collect();
        tables(data, &search.terms[chosen.term], shape_of(search, chosen), &log_factor)
    });
    each.collect()
}

fn parts_estimates(
    data: &PullData<'_>,
    model: &PullModel,
    gaussian: &Gaussian,
) -> BTreeMap<String, ParameterEstimate> {
    let each = data.parts.iter().enumerate().map(|(k, part)| {
        let (mu, sd) = (model.mu[k], gaussian.sd(k));
        let interval = (mu * libm::exp(-1.645 * sd), mu * libm::exp(1.645 * sd));
        (format!("parts.{part}.mu"), ParameterEstimate::new(mu, interval, "1"))
    });
    let ratio = model.kinetic_ratio;
    each.chain([("kinetic_ratio".into(), ParameterEstimate::new(ratio, (ratio, ratio), "1"))]).collect()
}
