//! Calibration of the baseline, with the effects that were asked for and no search.

use super::answer::{insufficient, outliers, without};
use super::candidates::{Candidate, candidate};
use super::context::Context;
use super::data::PullData;
use super::dynamics::Dynamics;
use super::error_interval::{Judged, errors};
use super::estimates::{baseline, parameters};
use super::few::{FEW_PULLS, calibrate_few, lacks_forces};
use super::few_diagnosis::FAR;
use super::fitting::Fitted;
use super::heldout::{folds, predicted};
use super::intervals::NormalFit;
use super::label_noise::{TRIED_FROM_N, TRIED_TO_N};
use super::law::largest_relative_sigma;
use super::posterior::of_calibration;
use super::priors::PullPriors;
use super::recalibrated::corrected;
use super::slip::Slips;
use super::terms::Terms;
use crate::diagnosis::{HeldOutError, ParameterEstimate};
use gripgen_twin::effects::{EffectSpec, OFFSET_LAW, find};
use gripgen_twin::predict::{PredictPulls, PullModel};
use gripgen_twin::{MeasuredPulls, Posterior};
use std::collections::BTreeMap;

pub use super::law::OffsetLaw;

/// a, b, their covariance, and their intervals.
type Law = (f64, f64, [f64; 3], [(f64, f64); 2]);

/// What a calibration fits beside the baseline.
#[derive(Debug, Clone, Default)]
pub struct CalibrateRequest {
    /// The law mu (a + b / F_G) of Wucherer et al. 2023 for each part; mu stays that of the twin.
    pub offset_law: bool,
    /// Effects of the library, by id.
    pub effects: Vec<String>,
    /// What is believed before the first pull, which counts where there are few. Without it few pulls are refused.
    pub priors: Option<PullPriors>,
}

/// A calibrated baseline.
#[derive(Debug, Clone)]
pub struct PullCalibration {
    /// The model.
    pub model: PullModel,
    /// Baseline values by key.
    pub baseline: BTreeMap<String, ParameterEstimate>,
    /// Effects by id, with their parameters.
    pub effects: Vec<(String, BTreeMap<String, ParameterEstimate>)>,
    /// The law of each part.
    pub laws: Vec<OffsetLaw>,
    /// Error on held-out repetitions, without pulls that lie far off.
    pub error: Option<HeldOutError>,
    /// Grip forces of the pulls.
    pub grip_force_n: (f64, f64),
    /// Draws of cause and parameters.
    pub posterior: Posterior,
    /// Pulls that lie far off, the farthest first; they hardly weigh in the fit.
    pub outliers: Vec<String>,
    /// Whether the pulls were so few, or so alike, that they were weighed with what is believed before the first one.
    pub leans_on_beliefs: bool,
    /// What is to be known beside it.
    pub notes: Vec<String>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The data do not suffice.
    #[error("{0}")]
    Insufficient(String),
    /// No such effect.
    #[error("there is no effect `{0}`")]
    UnknownEffect(String),
    /// An effect that no pull can show.
    #[error("pulls cannot show `{effect}`: {reason}")]
    NotInPulls {
        /// The effect.
        effect: String,
        /// Why.
        reason: &'static str,
    },
    /// An effect that these pulls cannot show.
    #[error("these pulls cannot show `{effect}`: it acts on nothing that was varied (it needs {needs})")]
    NotExcited {
        /// The effect.
        effect: String,
        /// The columns it needs.
        needs: String,
    },
    /// The labels cannot be predicted.
    #[error("the labels cannot be predicted at all: is the unit of the forces newton?")]
    NoFit,
}

/// Fits the baseline of a campaign and what is asked for.
///
/// # Errors
///
/// Too few pulls, an effect that is unknown or that these pulls cannot show, or labels that no fit predicts.
pub fn calibrate_pulls(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    request: &CalibrateRequest,
) -> Result<PullCalibration, CalibrateError> {
    let data = PullData::new(measured);
    let forces = || measured.pulls.iter().map(|p| p.grip_force_n);
    let range = forces().fold((f64::INFINITY, 0.0_f64), |(low, high), f| (low.min(f), high.max(f)));
    let missing = insufficient(&data);
    let few = data.len() <= FEW_PULLS || missing.is_some() || (request.offset_law && lacks_forces(&data));
    if let Some(priors) = request.priors.as_ref().filter(|_| few && request.effects.is_empty()) {
        let found = calibrate_few(&data, predictor, given, priors, request.offset_law)
            .ok_or(CalibrateError::NoFit)?;
        let mut far: Vec<usize> = (0..data.len()).filter(|&i| found.deviations[i].abs() > FAR).collect();
        far.sort_by(|&a, &b| found.deviations[b].abs().total_cmp(&found.deviations[a].abs()));
        return Ok(PullCalibration {
            model: found.model,
            baseline: found.baseline,
            effects: vec![],
            laws: found.laws,
            error: None,
            grip_force_n: range,
            posterior: found.posterior,
            notes: far_off(measured, &far).into_iter().chain(found.notes).collect(),
            outliers: names(measured, &far),
            leans_on_beliefs: true,
        });
    }
    if let Some(missing) = missing {
        return Err(CalibrateError::Insufficient(missing));
    }
    let max_n = data.label_n.iter().copied().fold(0.0, f64::max);
    let mut context = Context::new(&data, predictor, given);
    let creep_m_per_n_s = context.creep_m_per_n_s();
    let mut terms = Terms::default();
    let asked = |spec: &'static EffectSpec| -> Result<Candidate, CalibrateError> {
        if let Err(reason) = spec.pulls {
            return Err(CalibrateError::NotInPulls { effect: spec.id.into(), reason });
        }
        let spans = spec.pulls.map_or(&[][..], |fit| fit.spans);
        let needs = || [spec.covariates, spans].concat().join(", ");
        candidate(spec, &data, max_n, creep_m_per_n_s)
            .ok_or_else(|| CalibrateError::NotExcited { effect: spec.id.into(), needs: needs() })
    };
    if request.offset_law {
        let law = asked(OFFSET_LAW)?;
        for part in 0..data.parts.len() {
            let own = Candidate { part: Some((part, data.parts[part].clone())), ..law.clone() };
            let start = own.starts[0].clone();
            terms.effects.push((own, start));
        }
    }
    for id in &request.effects {
        let spec = find(id).ok_or_else(|| CalibrateError::UnknownEffect(id.clone()))?;
        let candidate = asked(spec)?;
        let start = candidate.starts[candidate.starts.len() / 2].clone();
        terms.effects.push((candidate, start));
    }
    let rows: Vec<usize> = (0..data.len()).collect();
    context.see_tails(&rows);
    context.learn_lag(&rows);
    let dynamics = context.settle_dynamics();
    // Without traces lag and dead time stay free, so that mu knows what they are not known to.
    context.free_lag = context.observations.is_empty();
    let (found, scattered) = corrected(&mut context, &terms, &rows).ok_or(CalibrateError::NoFit)?;
    context.free_lag = false;
    let normal = NormalFit::new(&found, data.len(), data.parts.len(), context.assumed_ratio());
    // What is stated and written has no nuisance; how well it is known is that of the fit with it.
    let (stated, fitted) = context.stated(&found);
    let held = predicted(&stated, &fitted, &folds(data.len()), false);
    let law_of = request.offset_law.then_some(&given.mu[..]);
    let far = outliers(&fitted);
    // As a diagnosis counts: one bad label would be all of a mean of squares.
    let counted = without(&rows, &far);
    let noise = at_bound(fitted.model.noise_n).filter(|_| context.noise90_n.is_some());
    let sd_n: Vec<f64> =
        predictor.pulls(&fitted.model, &rows).iter().map(|p| p.label_sd_n.max(0.03)).collect();
    let pulls = Judged { label_n: &data.label_n, sd_n: &sd_n, groups: &data.group_of, rows: &counted };
    let drawn = of_calibration(&found, &normal, &fitted, &data.parts, law_of);
    let laws =
        if request.offset_law { laws(&context, &found, &normal, &terms, given, range) } else { vec![] };
    let effects = terms
        .effects
        .iter()
        .filter(|(c, _)| c.part.is_none())
        .map(|(c, _)| (c.spec.id.to_string(), parameters(&fitted, c)))
        .collect();
    Ok(PullCalibration {
        baseline: intervals(
            baseline(&fitted, &stated),
            &found,
            &normal,
            context.slips.as_ref().filter(|_| context.kinetic.is_some()),
            dynamics,
            scattered,
        ),
        effects,
        laws,
        error: errors(&pulls, &held, &held).map(|pair| pair.after),
        grip_force_n: range,
        posterior: drawn,
        notes: far_off(measured, &far).into_iter().chain(noise).collect(),
        outliers: names(measured, &far),
        leans_on_beliefs: false,
        model: fitted.model,
    })
}

fn names(measured: &MeasuredPulls, rows: &[usize]) -> Vec<String> {
    rows.iter().map(|&i| measured.pulls[i].id.clone()).collect()
}

/// Pulls named in a sentence.
const NAMED: usize = 8;

/// What is said of pulls that lie far off, the farthest first.
fn far_off(measured: &MeasuredPulls, rows: &[usize]) -> Option<String> {
    let first = &measured.pulls[*rows.first()?];
    let all = names(measured, &rows[..rows.len().min(NAMED)]).join(", ");
    let more = if rows.len() > NAMED { ", ..." } else { "" };
    Some(format!(
        "{} of {} pulls lie far off ({all}{more}) and hardly weigh in the fit or in an error; pull {} has {} N at a grip force of {} N",
        rows.len(),
        measured.pulls.len(),
        first.id,
        first.max_pull_force_n,
        first.grip_force_n
    ))
}

/// What is said of a noise that labels alone would have beyond what is tried.
fn at_bound(noise_n: f64) -> Option<String> {
    let near = |end: f64| (noise_n / end - 1.0).abs() < 1e-6;
    let (end, beyond) = if near(TRIED_TO_N) {
        let beyond =
            "a force sensor with a wrong zero may look like it, or something that was not written down";
        ("upper", beyond)
    } else if near(TRIED_FROM_N) {
        ("lower", "it may be smaller")
    } else {
        return None;
    };
    Some(format!(
        "the noise of a reading, {noise_n:.2} N, is the {end} end of what was tried ({TRIED_FROM_N} to {TRIED_TO_N} N): {beyond}; traces with \
         readings without a load show it"
    ))
}

/// The baseline with its intervals.
fn intervals(
    mut baseline: BTreeMap<String, ParameterEstimate>,
    fitted: &Fitted,
    normal: &NormalFit,
    slips: Option<&Slips>,
    dynamics: Option<Dynamics>,
    scattered: (f64, f64, f64),
) -> BTreeMap<String, ParameterEstimate> {
    for (k, name) in fitted.names.iter().enumerate() {
        if let Some(estimate) = baseline.get_mut(name) {
            let (low, high) = normal.of_parameter(k);
            // About the value that is stated.
            let moved = estimate.value - fitted.values[k];
            *estimate = ParameterEstimate::new(estimate.value, (low + moved, high + moved), &estimate.unit);
        }
    }
    if let (Some(slips), Some(estimate)) = (slips, baseline.get_mut("kinetic_ratio")) {
        // The fit may have moved the value a little.
        *estimate = ParameterEstimate::new(estimate.value, slips.ratio90(), &estimate.unit);
    }
    let known = dynamics.into_iter().flatten().zip(["robot.lag_s", "robot.dead_time_s"]);
    for ((value, low, high), name) in known.chain([(scattered, "scatter")]) {
        if let Some(estimate) = baseline.get_mut(name) {
            *estimate = ParameterEstimate::new(value, (low, high), &estimate.unit);
        }
    }
    baseline
}

/// From (mu', b') of a fit with the coefficient mu' (1 + b' / F) to (a, b) of mu (a + b / F).
fn laws(
    context: &Context<'_>,
    fitted: &Fitted,
    normal: &NormalFit,
    terms: &Terms,
    given: &PullModel,
    range: (f64, f64),
) -> Vec<OffsetLaw> {
    let mut levels: Vec<f64> = context.data.measured.pulls.iter().map(|p| p.grip_force_n).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let three = [levels[0], levels[levels.len() / 2], levels[levels.len() - 1]];
    let rows: Vec<usize> = (0..context.data.len())
        .filter(|&i| three.contains(&context.data.measured.pulls[i].grip_force_n))
        .collect();
    let few = if levels.len() > 3 { context.fit(&fitted.model, terms, &rows) } else { None };
    let few = few.map(|few| {
        let normal = NormalFit::new(&few, rows.len(), 2 * context.data.parts.len(), context.assumed_ratio());
        (few, normal)
    });
    let of = |fitted: &Fitted, normal: &NormalFit, part: usize| {
        let name = &context.data.parts[part];
        let at = |wanted: &str| fitted.names.iter().position(|n| n == wanted);
        let (m, b) = (at(&format!("parts.{name}.mu"))?, at(&format!("load_offset@{name}.b_n"))?);
        let (mu, b_n) = (fitted.values[m], fitted.values[b]);
        let mu_given = given.mu[part];
        // a = mu' / mu, b = mu' b' / mu.
        let mut slopes = [vec![0.0; fitted.values.len()], vec![0.0; fitted.values.len()]];
        slopes[0][m] = 1.0 / mu_given;
        (slopes[1][m], slopes[1][b]) = (b_n / mu_given, mu / mu_given);
        let both = [(mu / mu_given, &slopes[0]), (mu * b_n / mu_given, &slopes[1])];
        let shared = |i: usize, j: usize| {
            let (u, v) = (&slopes[i], &slopes[j]);
            let c = normal.covariance();
            [m, b].iter().flat_map(|&p| [m, b].map(|q| u[p] * v[q] * c[(p, q)])).sum::<f64>()
        };
        let ends = both.map(|(value, slope)| normal.of(value, slope));
        Some((both[0].0, both[1].0, [shared(0, 0), shared(0, 1), shared(1, 1)], ends))
    };
    let largest = |(a, b, covariance, _): Law| largest_relative_sigma((a, b), covariance, range);
    (0..context.data.parts.len())
        .filter_map(|part| {
            let law = of(fitted, normal, part)?;
            let (a, b, covariance, ends) = law;
            Some(OffsetLaw {
                part: context.data.parts[part].clone(),
                a: ParameterEstimate::new(a, ends[0], "1"),
                b_n: ParameterEstimate::new(b, ends[1], "N"),
                covariance,
                largest_relative_sigma: largest(law),
                of_three_levels: few.as_ref().and_then(|(few, normal)| of(few, normal, part)).map(largest),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noise_at_an_end_of_what_was_tried_is_said_with_both_numbers() {
        let upper = at_bound(libm::exp(libm::log(TRIED_TO_N))).unwrap();
        assert!(upper.contains("0.90 N, is the upper end of what was tried (0.03 to 0.9 N)"), "{upper}");
        assert!(at_bound(TRIED_FROM_N).unwrap().contains("0.03 N, is the lower end"));
        assert_eq!(at_bound(0.15), None);
    }
}
