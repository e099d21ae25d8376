//! The model that a fit is, the labels that it predicts, for held-out pulls too, and which of two predictions is better.

use super::process::Process;
use super::search::Fit;
use super::settings::Setting;
use super::sizes::{amplitude_of, scaled, shape_of};
use super::terms::Kind;
use crate::pulls::candidates::Candidate;
use crate::pulls::data::PullData;
use gripgen_twin::predict::{ModelEffect, PredictPulls, PullModel};
use gripgen_twin::values::median;

/// Nodes and weights over which scatter is averaged: Gauss-Hermite of five points for a standard normal variable.
const NODES: [(f64, f64); 5] = [
    (-2.856_970_013_872_8, 0.011_257_411_327_72),
    (-1.355_626_179_974_3, 0.222_075_922_005_61),
    (0.0, 0.533_333_333_333_33),
    (1.355_626_179_974_3, 0.222_075_922_005_61),
    (2.856_970_013_872_8, 0.011_257_411_327_72),
];

/// Significance level of the sign test between two predictions, and the probability that nothing acts below which a process may replace names.
pub(super) const BY_CHANCE: f64 = 0.05;

/// Scatter that a twin holds.
const MOST_SCATTER: f64 = 0.3;

/// The model of a fit: friction of the parts, effects, scatter.
pub(super) fn model_of(
    data: &PullData<'_>,
    candidates: &[Candidate],
    setting: &Setting,
    fit: &Fit,
) -> PullModel {
    let search = &setting.search;
    let mut model = PullModel { factor: vec![], ..setting.curves.model.clone() };
    for (part, mu) in model.mu.iter_mut().enumerate() {
        *mu *= libm::exp(fit.gaussian.mean[part]);
    }
    // A twin has no noise of labels but that of its readings: what is beyond it scatters with the friction.
    let wider = &search.measured.wider;
    let variances = fit.gaussian.weight.iter().zip(wider).map(|(w, wider)| 1.0 / (w * wider));
    model.scatter = median(variances.collect()).unwrap_or(0.0).sqrt().min(MOST_SCATTER);
    for (place, chosen) in fit.chosen.iter().enumerate() {
        let (kind, at) = (&search.terms[chosen.term].kind, shape_of(search, chosen).at.as_ref());
        let (Kind::Effect(e) | Kind::EffectOfParts(e), Some(at)) = (kind, at) else { continue };
        let candidate = &candidates[*e];
        let one = matches!(kind, Kind::Effect(_));
        for p in 0..data.parts.len() {
            let Some((share, _)) = amplitude_of(search, fit, place, if one { 0 } else { p }) else {
                continue;
            };
            // A column is without its mean in each part: what the effect does there is taken off the friction.
            model.mu[p] *= libm::exp(-share * at.means[p]);
            if !one || p == 0 {
                let part = (!one).then_some(p);
                let values = scaled(candidate, &at.values, share);
                model.effects.push(ModelEffect { part, ..ModelEffect::new(candidate.spec, values) });
            }
        }
    }
    model
}

/// Root mean square of the errors of a prediction, of those pulls that it predicts. Outliers count too.
pub fn rms_error_n(label_n: &[f64], predicted_n: &[f64]) -> f64 {
    let known = label_n.iter().zip(predicted_n).filter(|(_, p)| p.is_finite());
    let (sum, count) =
        known.fold((0.0, 0.0_f64), |(sum, count), (y, p)| (sum + (y - p) * (y - p), count + 1.0));
    (sum / count.max(1.0)).sqrt()
}

/// Whether the second of two predictions of held-out pulls is better: its error is smaller in the root mean square, and a one-sided sign
/// test over the pulls is significant. Every pull counts, outliers too.
pub(super) fn predicts_better(label_n: &[f64], first_n: &[f64], second_n: &[f64]) -> bool {
    let pairs = label_n.iter().zip(first_n.iter().zip(second_n));
    let known = pairs.filter(|(_, (a, b))| a.is_finite() && b.is_finite());
    let errors: Vec<(f64, f64)> = known.map(|(y, (a, b))| ((y - a).abs(), (y - b).abs())).collect();
    let sum = |own: fn(&(f64, f64)) -> f64| errors.iter().map(|e| own(e) * own(e)).sum::<f64>();
    let nearer = errors.iter().filter(|(a, b)| b < a).count();
    let by_chance = at_least_by_chance(nearer, errors.iter().filter(|(a, b)| a != b).count());
    sum(|e| e.1) < sum(|e| e.0) && by_chance <= BY_CHANCE
}

/// Chance of `hits` heads or more in `tosses` of a fair coin.
fn at_least_by_chance(hits: usize, tosses: usize) -> f64 {
    let half = libm::log(0.5) * tosses as f64;
    let (mut log_choose, mut sum) = (0.0, 0.0);
    for k in 0..=tosses {
        if k >= hits {
            sum += libm::exp(log_choose + half);
        }
        log_choose += libm::log((tosses - k) as f64 / (k + 1) as f64);
    }
    sum
}

/// Expected labels of held-out pulls, from the others: the coefficients with the deviations of the whole fit, or the constants of a
/// process too. Sessions and memory of the others say nothing of a pull that a twin makes.
pub(super) fn heldout_n(
    data: &PullData<'_>,
    setting: &Setting,
    fit: &Fit,
    process: Option<&Process>,
    sets: &[Vec<usize>],
) -> Vec<f64> {
    let mut found = vec![f64::NAN; data.len()];
    let scatter = libm::exp(fit.gaussian.log_noise[0]);
    let search = &setting.search;
    let first = search.block_of(0);
    let own = |block: usize| block == 0 || block >= first;
    for set in sets {
        let z = match process {
            None => fit.gaussian.predicted_without(&search.measured, set, &own),
            Some(process) => {
                let rest = search.without_rows(set);
                let again = process.again(data, &rest, fit).map(|again| rest.explained(&again));
                again.map(|z| set.iter().map(|&row| z[row]).collect())
            }
        };
        for (&row, z) in set.iter().zip(z.unwrap_or_default()) {
            found[row] = expected_n(setting, row, z, scatter);
        }
    }
    found
}

/// Expected label of a pull whose friction has this logarithm and scatter.
pub(super) fn expected_n(setting: &Setting, row: usize, z: f64, scatter: f64) -> f64 {
    let at = |x: f64| setting.curves.label_n(row, z + libm::log((1.0 + scatter * x).max(0.01)));
    let mean: f64 = NODES.iter().map(|(x, w)| w * at(*x)).sum();
    mean + setting.above_n[row]
}

/// What labels of the simulator lie above those of the curves at a fit: what its twin will be judged by.
pub(super) fn above_fast_n(
    data: &PullData<'_>,
    predictor: &dyn PredictPulls,
    candidates: &[Candidate],
    setting: &Setting,
    fit: &Fit,
) -> Vec<f64> {
    let rows: Vec<usize> = (0..data.len()).collect();
    let mut model = model_of(data, candidates, setting, fit);
    let mut log_factor = vec![0.0; data.len()];
    let unnamed =
        |place: &usize| fit.chosen.get(*place).is_none_or(|c| !setting.search.terms[c.term].is_effect());
    for place in (0..fit.chosen.len() + fit.process.len()).filter(unnamed) {
        let own = fit.gaussian.part(setting.search.block_of(place));
        log_factor.iter_mut().zip(own.iter()).for_each(|(sum, x)| *sum += x);
    }
    model.factor = log_factor.iter().map(|x| libm::exp(*x)).collect();
    let z = setting.search.explained(fit);
    let simulated = predictor.labels_n(&model, &rows);
    let fast = rows.iter().map(|&i| expected_n(setting, i, z[i], model.scatter) - setting.above_n[i]);
    simulated.iter().zip(fast).map(|(s, f)| s - f).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_better_prediction_is_nearer_in_most_pulls_and_in_the_root_mean_square() {
        // Exact: 8 or more heads of 10 have 56 of 1024 chances.
        assert!((at_least_by_chance(8, 10) - 56.0 / 1024.0).abs() < 1e-12);
        assert!((at_least_by_chance(0, 7) - 1.0).abs() < 1e-12);
        let label_n = [10.0; 12];
        let off = |by: f64| vec![10.0 + by; 12];
        assert_eq!(rms_error_n(&[1.0, 2.0, 4.0], &[1.5, f64::NAN, 3.5]), 0.5);
        assert!(predicts_better(&label_n, &off(0.5), &off(-0.2)));
        assert!(!predicts_better(&label_n, &off(0.2), &off(0.2)), "alike");
        let mut once = off(0.1);
        once[3] = 25.0;
        assert!(!predicts_better(&label_n, &off(0.2), &once), "one pull far off counts");
        let mut few = off(0.5);
        (0..3).for_each(|i| few[i] = 10.1);
        assert!(!predicts_better(&label_n, &off(0.5), &few), "nearer in 3 of 3 that differ");
    }
}
