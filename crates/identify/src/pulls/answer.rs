//! From a campaign to an answer.

use super::candidates::{Candidate, candidates};
use super::confirmed::{confirmed, label_sd_n};
use super::context::Context;
use super::data::PullData;
use super::error_interval::{Judged, errors};
use super::estimates::baseline;
use super::fitting::Fitted;
use super::heldout::{HeldOutScore, by_value, folds, held_out_score, noise_floor_n, predicted, scatter};
use super::instead::tied_instead;
use super::label_noise::log_noise_prior;
use super::naming::named;
use super::not_described::not_described;
use super::one_level::of_one_level;
use super::paying::{by_chance, paying};
use super::posterior::of_diagnosis;
use super::power::ScoreTest;
use super::recalibrated::recalibrated;
use super::residual::{in_place_of_curves, kept};
use super::ridge::{AHEAD_BY_CHANCE, ahead};
use super::scatter::scatter as stated_scatter;
use super::search::{Accepted, Search};
use super::simulate::{recalibrate, trusted};
use super::terms::Terms;
use super::units::other_unit;
use super::unknown::unknown;
use super::worth::{HeldOut, hints, worse};
use super::zero_screen::{said, zeros_that_depend};
use crate::diagnosis::{
    Channel, DataSummary, Diagnosis, ErrorReport, ErrorsBy, ParameterEstimate, Residual, UnknownCovariate,
};
use gripgen_twin::columns::covariates;
use gripgen_twin::predict::{PredictPulls, PullModel};
use gripgen_twin::{MeasuredPulls, Posterior};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Fewest pulls that are diagnosed.
pub(crate) const MIN_PULLS: usize = 8;

/// Standard deviations beyond which a pull is named as an outlier.
const OUTLIER: f64 = 4.5;

/// Rivals of the first place that are scored on held-out repetitions.
const SCORED: usize = 8;

/// How many times the noise that a twin states labels have to show before it is said.
const NOISIER: f64 = 1.6;

/// An answer, with what a report and a twin need beside it.
#[derive(Debug, Clone)]
pub struct PullAnswer {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// What was fitted; not there if the data are insufficient.
    pub fits: Option<PullFits>,
}

/// The fits behind an answer.
#[derive(Debug, Clone)]
pub struct PullFits {
    /// Plain baseline.
    pub before: Fitted,
    /// With what was accepted.
    pub after: Fitted,
    /// What was accepted and what competed.
    pub accepted: Accepted,
    /// The effects that competed.
    pub candidates: Vec<Candidate>,
    /// Names of the curves that competed.
    pub curve_names: Vec<String>,
    /// How the first of the entries predict held-out repetitions, in their order.
    pub scores: Vec<Option<HeldOutScore>>,
    /// Labels predicted for held-out repetitions, before and after.
    pub heldout_label_n: [Vec<f64>; 2],
    /// Labels predicted by the fits to all pulls, before and after.
    pub label_n: [Vec<f64>; 2],
    /// Draws of cause and parameters.
    pub posterior: Posterior,
}

/// What may be asked of a diagnosis.
#[derive(Default)]
pub struct PullOptions<'a> {
    /// Effects that must not compete.
    pub without: &'a [&'a str],
}

/// Diagnoses a campaign from a baseline. `progress` is told the share that is done.
///
/// Without traces, much noise of the readings explains what a law of the load would: noisy readings raise small labels. The noise is fitted
/// before effects compete, so where labels say that there is more of it than the twin does, they compete with the noise of the twin, too.
/// The answer is the one with the higher score: log-likelihood plus log prior of the noise, minus half the logarithm of the number of pulls per
/// parameter, minus the logarithm of the number of candidates per name.
pub fn diagnose_pulls(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    options: &PullOptions<'_>,
    progress: &(dyn Fn(f64) + Sync),
) -> PullAnswer {
    let (noisy, noise90_n) =
        diagnose_with(measured, predictor, given, options, false, &|x| progress(0.5 * x));
    if noise90_n.is_none_or(|(low_n, _)| low_n <= given.noise_n) {
        progress(1.0);
        return noisy;
    }
    let (quiet, _) = diagnose_with(measured, predictor, given, options, true, &|x| progress(0.5 + 0.5 * x));
    let score = |answer: &PullAnswer| {
        let fits = answer.fits.as_ref()?;
        let away = libm::log(fits.after.model.noise_n / given.noise_n);
        let named = (answer.diagnosis.effects.len() + answer.diagnosis.unknown.len()) as f64;
        let of_names = named * libm::log((fits.candidates.len() + fits.curve_names.len()) as f64);
        Some(fits.after.score(measured.pulls.len()) + log_noise_prior(away) - of_names)
    };
    if score(&quiet) > score(&noisy) { quiet } else { noisy }
}

/// A diagnosis, and the 90 % interval of the noise where labels alone say it; `knows_noise`: the noise is that of the twin.
fn diagnose_with(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    options: &PullOptions<'_>,
    knows_noise: bool,
    progress: &(dyn Fn(f64) + Sync),
) -> (PullAnswer, Option<(f64, f64)>) {
    let data = PullData::new(measured);
    let mut diagnosis = blank(&data);
    if let Some(missing) = insufficient(&data) {
        diagnosis.notes.push(missing);
        return (PullAnswer { diagnosis, fits: None }, None);
    }
    let mut context = Context::new(&data, predictor, given);
    context.knows_noise = knows_noise;
    let rows: Vec<usize> = (0..data.len()).collect();
    context.see_tails(&rows);
    context.learn_lag(&rows);
    let seen = context.clone();
    context.share_lag(&rows);
    context.base.bent_at_s = (context.base.lag_s, context.base.dead_time_s);
    if let Some(plain) = context.fit(&context.base, &Terms::default(), &rows) {
        context.correct_at(&plain.model);
    }
    let max_n = data.label_n.iter().copied().fold(0.0, f64::max);
    let search = Search::new(&context, candidates(&data, max_n, context.creep_m_per_n_s(), options.without));
    if search.candidates.is_empty() && search.curves.is_empty() {
        diagnosis
            .notes
            .push("nothing was varied: there is no covariate that the force could depend on".into());
        return (PullAnswer { diagnosis, fits: None }, None);
    }
    let Some((before, accepted)) = search.run(&|share| progress(0.8 * share)) else {
        diagnosis
            .notes
            .push("the labels cannot be predicted at all: is the unit of the forces newton?".into());
        return (PullAnswer { diagnosis, fits: None }, None);
    };
    let repetitions = folds(data.len());
    let fast_before = predicted(&context, &before, &repetitions, false);
    let accepted = confirmed(&search, &before, accepted, &fast_before, &repetitions);
    let near = without(&rows, &outliers(&accepted.fitted));
    let (mut accepted, unpaid) = paying(&search, &before, accepted, &repetitions, &near);
    diagnosis.hints = unpaid;
    if let Some(found) = &accepted.by_chance {
        diagnosis.hints.push(by_chance(&search, &before, found, &repetitions, &near));
    }
    let mut left = None;
    if !accepted.curves.is_empty() {
        left = in_place_of_curves(&search, &accepted.fitted, &repetitions, &near);
        let now = left.as_ref().map_or(&accepted.fitted, |l| &l.fitted);
        if let Some(instead) = tied_instead(&search, &before, &accepted, now, &repetitions, &near) {
            (accepted, left) = (instead.accepted, instead.left);
        }
        if left.is_some() {
            accepted.curves.clear();
        }
    }
    let replaced = left.is_some();
    let mut left = left.or_else(|| kept(&search, &accepted.fitted, &repetitions, &near));
    if let Some(left) = &left {
        accepted.fitted = left.fitted.clone();
    }
    // What is stated from here on is what a twin of these models says.
    let again = recalibrated(seen, &rows);
    let scattered = again.as_ref().map(|(.., scattered)| *scattered);
    let (before_context, stated_before) =
        again.map_or_else(|| context.stated(&before), |(context, fitted, _)| (context, fitted));
    let heldout_before = predicted(&before_context, &stated_before, &repetitions, false);
    // Where nothing was found, or nothing that predicts better, that is the baseline as a calibration writes it.
    let mut found = !accepted.effects.is_empty() || !accepted.curves.is_empty() || left.is_some();
    let mut written = None;
    if found {
        let (after_context, after) = search.stated(&accepted.fitted);
        let after_n = predicted(&after_context, &after, &repetitions, false);
        let sd_n = label_sd_n(&before, &predictor.pulls(&before.model, &rows));
        let held = HeldOut { before_n: &heldout_before, after_n: &after_n, sd_n: &sd_n };
        // The pulls that the report counts, too: they are those of the twin that is written.
        let counted = without(&rows, &outliers(&after));
        if let Some(reason) =
            [&near, &counted].into_iter().find_map(|rows| worse(&search, &accepted, &held, rows))
        {
            diagnosis.hints.extend(hints(&search, &accepted, &reason));
            accepted.effects.clear();
            accepted.curves.clear();
            (left, found) = (None, false);
        } else {
            written = Some((after_context, after, after_n));
        }
    }
    let (after_context, after, heldout_after) =
        written.unwrap_or_else(|| (before_context.clone(), stated_before.clone(), heldout_before.clone()));
    accepted.fitted = after.clone();
    diagnosis.effects = named(&search, &before, &accepted);
    diagnosis.unknown = unknown(&search, &before, &accepted, &data);
    for curve in accepted.curves.iter().map(|&i| &search.curves[i]) {
        if let Some((column, word)) = &curve.only {
            let name = &curve.name;
            diagnosis.decides(format!("{name}: it was seen where {column} is {word}, and only there"));
        }
    }
    if let Some(left) = left {
        diagnosis.notes.push(learnt_text(&left.report));
        if replaced || (diagnosis.effects.is_empty() && diagnosis.unknown.is_empty()) {
            diagnosis.unknown = left.unknown;
        }
        diagnosis.residual = Some(left.report);
    }
    if let Some(rival) = ahead(&data, &heldout_after, &repetitions, &near) {
        let names: Vec<&str> = rival.columns.iter().map(|c| c.0.as_str()).collect();
        diagnosis.notes.push(format!(
            "structure is left: a quadratic ridge on the table predicts held-out pulls better by {:.0} %, by {}",
            100.0 * rival.share,
            if names.is_empty() { "the grip force".into() } else { names.join(", ") },
        ));
        for (covariate, strength) in rival.columns {
            if diagnosis.unknown.iter().all(|u| u.covariate != covariate) {
                diagnosis.unknown.push(UnknownCovariate { covariate, strength, p_value: AHEAD_BY_CHANCE });
            }
        }
    }
    for zero in zeros_that_depend(&after_context, &after.model) {
        diagnosis.notes.push(said(&zero));
        if diagnosis.unknown.iter().all(|u| u.covariate != zero.covariate) {
            diagnosis.unknown.push(zero);
        }
    }
    if let Some((low_n, _)) = context.noise90_n.filter(|(low_n, _)| *low_n > NOISIER * given.noise_n) {
        diagnosis.decides(format!(
            "the labels are those of a force sensor with {low_n:.2} N of noise or more, the twin says {:.2} N: an offset of sensor, friction or grip force would look \
             alike; a single trace shows the noise",
            given.noise_n
        ));
    }
    diagnosis.conclude();
    diagnosis.baseline = baseline(&after, &after_context);
    // Of what was found, too: the scale of the fits is that of Student's t, which is less than the deviation that a twin draws.
    let scattered = if found { Some(stated_scatter(&after_context, &after, &rows)) } else { scattered };
    if let Some((value, low90, high90)) = scattered {
        diagnosis.baseline.insert("scatter".into(), ParameterEstimate::new(value, (low90, high90), "1"));
    }
    let named_rows = outliers(&after);
    diagnosis.data.outliers = named_rows.iter().map(|&i| measured.pulls[i].id.clone()).collect();
    let counted = without(&rows, &named_rows);
    if !named_rows.is_empty() {
        diagnosis.notes.push(format!(
            "{} of {} pulls lie far off ({}): they are named, hardly weigh in the fit, and are not in the errors before and after",
            named_rows.len(),
            rows.len(),
            diagnosis.data.outliers.join(", "),
        ));
    }
    let heldout = [heldout_before, heldout_after];
    progress(0.9);
    let labels = [(&before_context, &stated_before), (&after_context, &after)].map(|(context, fitted)| {
        let mut model = fitted.model.clone();
        model.scatter = scatter(&model, fitted.likelihood.scale);
        context.labels_n(&model, &rows)
    });
    let own: Vec<f64> = counted.iter().map(|&i| data.label_n[i] - labels[1][i]).collect();
    let groups: Vec<usize> = counted.iter().map(|&i| data.group_of[i]).collect();
    diagnosis.noise_floor_n = Some(noise_floor_n(&own, &groups, after.names.len()));
    let sd_n = label_sd_n(&before, &predictor.pulls(&before.model, &rows));
    let pulls = Judged { label_n: &data.label_n, sd_n: &sd_n, groups: &data.group_of, rows: &counted };
    diagnosis.error = errors(&pulls, &heldout[0], &heldout[1]).map(|pair| {
        let by = |sets: Vec<Vec<usize>>| {
            if sets.len() < 3 || sets.len() > 20 {
                return None;
            }
            let b = predicted(&before_context, &stated_before, &sets, true);
            let a = if found { predicted(&after_context, &after, &sets, true) } else { b.clone() };
            errors(&pulls, &b, &a)
        };
        let force: Vec<u64> = measured.pulls.iter().map(|p| p.grip_force_n.to_bits()).collect();
        let session: Vec<u64> = data.session_of.iter().map(|&s| s as u64).collect();
        ErrorReport {
            heldout: "repetitions".into(),
            before: pair.before,
            after: pair.after,
            by: ErrorsBy { levels: by(by_value(&force)), sessions: by(by_value(&session)) },
        }
    });
    let rmse_n = diagnosis.error.as_ref().and_then(|error| error.after.rmse_n);
    if let Some(beyond) = rmse_n.and_then(|rmse_n| not_described(&data, &counted, rmse_n)) {
        diagnosis.is_not_described(beyond.to_string());
    }
    if let Some(note) = of_one_level(&diagnosis, &after_context, &after) {
        diagnosis.decides(note);
    }
    recalibrate(&mut diagnosis, &trusted(&search, &accepted));
    progress(0.92);
    let scores = accepted.entries.iter().take(SCORED).map(|entry| {
        let held = predicted(&context, &entry.fitted, &repetitions, true);
        held_out_score(&data.label_n, &sd_n, &fast_before, &held, &counted)
    });
    let scores = scores.collect();
    progress(0.96);
    diagnosis.would_have_seen = would_have_seen(&context, &after, &search.candidates);
    progress(1.0);
    let size = (rows.len(), &data.parts[..]);
    let posterior =
        of_diagnosis(&stated_before, &after, &accepted, &diagnosis, size, context.assumed_ratio());
    let fits = PullFits {
        posterior,
        before: stated_before,
        after,
        candidates: search.candidates.clone(),
        curve_names: search.curves.iter().map(|c| c.name.clone()).collect(),
        accepted,
        scores,
        heldout_label_n: heldout,
        label_n: labels,
    };
    (PullAnswer { diagnosis, fits: Some(fits) }, context.noise90_n)
}

/// What is said of a residual that was learnt.
fn learnt_text(residual: &Residual) -> String {
    format!(
        "beside what has a name, the error on held-out pulls falls by {:.0} % with what was learnt of {}: it stands in the twin as tables that are not physical",
        100.0 * residual.gain,
        residual.covariates.join(", ")
    )
}

pub(crate) fn blank(data: &PullData<'_>) -> Diagnosis {
    let known = covariates().filter(|c| !c.holds_words()).map(|c| c.name);
    let data_summary = DataSummary {
        pulls: Some(data.len()),
        traces: Some(data.measured.pulls.iter().filter(|p| p.trace.is_some()).count()),
        sha256: data.measured.sha256.clone(),
        ..DataSummary::default()
    };
    let mut diagnosis = Diagnosis::blank(Channel::Pulls, data_summary);
    diagnosis.other_unit = other_unit(&data.measured.pulls).is_some();
    for name in known {
        match data.columns.contains_key(name) {
            true if data.varies(name) => {}
            true => diagnosis.not_excited.push(name.into()),
            false => diagnosis.not_recorded.push(name.into()),
        }
    }
    diagnosis
}

/// What the data lack, if they cannot be diagnosed at all.
pub fn insufficient(data: &PullData<'_>) -> Option<String> {
    let n = data.len();
    if n < MIN_PULLS {
        return Some(format!("{n} pulls are too few, a diagnosis needs {MIN_PULLS} at least"));
    }
    if data.label_n.iter().all(|x| *x == data.label_n[0]) {
        return Some(format!("all {n} labels are {} N", data.label_n[0]));
    }
    if data.parts.len() * 3 > n {
        return Some(format!("{n} pulls of {} parts are too few", data.parts.len()));
    }
    other_unit(&data.measured.pulls)
}

/// Pulls that lie far off, the farthest first.
pub(super) fn outliers(fitted: &Fitted) -> Vec<usize> {
    let s = fitted.likelihood.scale;
    let mut far: Vec<(f64, usize)> = fitted
        .residuals
        .iter()
        .enumerate()
        .map(|(i, r)| (r.abs() / s, i))
        .filter(|(r, _)| *r > OUTLIER)
        .collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    far.into_iter().map(|(_, i)| i).collect()
}

/// The rows that are not among those far off.
pub(super) fn without(rows: &[usize], far: &[usize]) -> Vec<usize> {
    rows.iter().copied().filter(|i| !far.contains(i)).collect()
}

fn would_have_seen(
    context: &Context<'_>,
    after: &Fitted,
    all: &[Candidate],
) -> BTreeMap<String, crate::diagnosis::Detectable> {
    let others: Vec<&Candidate> =
        all.iter().filter(|c| !after.model.effects.iter().any(|e| e.spec == c.spec)).collect();
    let found = Mutex::new(BTreeMap::new());
    let rows: Vec<usize> = (0..context.data.len()).collect();
    let traces = !context.observations.is_empty();
    let test = ScoreTest::new(context, &after.model, &after.terms, &rows, traces);
    context.predictor.for_each(others.len(), &|i| {
        if let (Some(seen), Ok(mut found)) = (test.detectable(others[i]), found.lock()) {
            found.insert(others[i].spec.id.to_string(), seen);
        }
    });
    found.into_inner().unwrap_or_default()
}
