//! Calibration from a few pulls: posterior means and intervals, with beliefs that are stated.
//!
//! What the rig is (lag, noise, scatter) and the kinetic ratio are points with weights (`few/nodes.rs`); on each of them the parts
//! stand for themselves, and coefficient and offset of a part are drawn from their posterior (`few/part.rs`). The evidence of all
//! parts weighs the points. One pull is enough: what it does not say comes from the belief, and the interval shows it.

mod density;
mod nodes;
mod part;

use super::context::Context;
use super::data::PullData;
use super::estimates::plain_baseline;
use super::law::{OffsetLaw, largest_relative_sigma};
use super::priors::PullPriors;
use super::units::other_unit;
use crate::diagnosis::ParameterEstimate;
use crate::draws::Draws;
pub use density::FewDensity;
use gripgen_twin::effects::OFFSET_LAW;
use gripgen_twin::predict::{ModelEffect, PredictPulls, PullModel};
use gripgen_twin::{Posterior, PosteriorDraw};
use nodes::{Rig, ratios, rigs};
use part::{PartAnswer, PartDraw, PartOnRig};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Campaigns of so many pulls or fewer are few pulls.
pub const FEW_PULLS: usize = 12;

/// Draws that are handed on.
const HANDED_ON: usize = 400;

/// Ratio of the largest to the smallest of three grip forces from which on they show a law of the grip force.
const SPAN: f64 = 4.0;

/// What a few pulls say.
#[derive(Debug, Clone)]
pub struct FewPulls {
    /// The model of the posterior means.
    pub model: PullModel,
    /// Baseline values by key, with 90 % intervals.
    pub baseline: BTreeMap<String, ParameterEstimate>,
    /// The law of each part, where it was asked for.
    pub laws: Vec<OffsetLaw>,
    /// Draws of cause and parameters.
    pub posterior: Posterior,
    /// Logarithm of the evidence, up to what all models of these pulls share.
    pub log_evidence: f64,
    /// What each label differs from its prediction by, in standard deviations of both.
    pub deviations: Vec<f64>,
    /// What is to be known beside it.
    pub notes: Vec<String>,
}

/// A rig with a kinetic ratio, its weight, and what the parts say on it.
struct Place {
    rig: Rig,
    kinetic_ratio: f64,
    weight: f64,
    parts: Vec<PartAnswer>,
}

/// Whether the law of the grip force cannot be fitted to the pulls of some part without a belief: fewer than three forces.
pub fn lacks_forces(data: &PullData<'_>) -> bool {
    (0..data.parts.len()).any(|part| forces_n(data, part).len() < 3)
}

/// Different grip forces of a part, in order.
fn forces_n(data: &PullData<'_>, part: usize) -> Vec<f64> {
    let own = data.measured.pulls.iter().zip(&data.part_of).filter(|(_, p)| **p == part);
    let mut forces: Vec<f64> = own.map(|(pull, _)| pull.grip_force_n).collect();
    forces.sort_by(f64::total_cmp);
    forces.dedup();
    forces
}

/// Calibrates the baseline, and the law of each part where `law` stands. `None` where nothing can be predicted.
pub fn calibrate_few(
    data: &PullData<'_>,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    priors: &PullPriors,
    law: bool,
) -> Option<FewPulls> {
    let context = prepared(data, predictor, given, priors, law)?;
    let (all, log_evidence) = places(&context, priors, &rigs(&context, priors), law)?;
    let model = means(&context, &all, law);
    let rows: Vec<usize> = (0..data.len()).collect();
    let deviations = context.compared(&model, &rows).into_iter().map(|(d, sd)| d / sd).collect();
    Some(FewPulls {
        baseline: baseline(&context, &model, &all),
        laws: if law { laws(data, given, &all) } else { vec![] },
        posterior: posterior(data, given, &all, law),
        log_evidence,
        deviations,
        notes: notes(data, law),
        model,
    })
}

/// What is compared with the pulls, corrected by the simulator at what they say on the rig of the twin.
fn prepared<'a>(
    data: &'a PullData<'a>,
    predictor: &'a dyn PredictPulls,
    given: &PullModel,
    priors: &PullPriors,
    law: bool,
) -> Option<Context<'a>> {
    let mut context = Context::new(data, predictor, given);
    context.see_few_slips();
    let middle =
        Rig { lag_s: context.base.lag_s, noise_n: context.base.noise_n, scatter: priors.scatter.at(0.0) };
    let (first, _) = places(&context, priors, &[middle], law)?;
    context.correct_at(&means(&context, &first, law));
    Some(context)
}

/// The points, weighed, and the logarithm of the evidence.
fn places(context: &Context<'_>, priors: &PullPriors, rigs: &[Rig], law: bool) -> Option<(Vec<Place>, f64)> {
    let ratios = ratios(context, priors);
    let asked: Vec<(Rig, f64, f64)> =
        rigs.iter().flat_map(|rig| ratios.iter().map(move |&(k, weight)| (*rig, k, weight))).collect();
    let found: Mutex<Vec<Option<Vec<PartAnswer>>>> = Mutex::new(vec![None; asked.len()]);
    let parts = context.data.parts.len();
    let of_part: Vec<Vec<usize>> = (0..parts)
        .map(|part| (0..context.data.len()).filter(|&i| context.data.part_of[i] == part).collect())
        .collect();
    context.predictor.for_each(asked.len(), &|at| {
        let (rig, kinetic_ratio, _) = asked[at];
        let model = PullModel {
            kinetic_ratio,
            lag_s: rig.lag_s,
            noise_n: rig.noise_n,
            scatter: rig.scatter,
            misread_n: 0.0,
            ..context.base.clone()
        };
        let answers = (0..parts).map(|part| {
            let rows = &of_part[part];
            PartOnRig { context, priors, rig: &model, part, rows, law }.answer((at * parts + part) as u64)
        });
        let answers: Option<Vec<PartAnswer>> = answers.collect();
        if let Ok(mut found) = found.lock() {
            found[at] = answers;
        }
    });
    let found = found.into_inner().ok()?;
    let mut all: Vec<Place> = asked
        .into_iter()
        .zip(found)
        .filter_map(|((rig, kinetic_ratio, weight), parts)| {
            Some(Place { rig, kinetic_ratio, weight, parts: parts? })
        })
        .collect();
    let log = |p: &Place| p.parts.iter().map(|a| a.log_evidence).sum::<f64>() + libm::log(p.weight);
    let logs: Vec<f64> = all.iter().map(log).collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.iter().map(|l| libm::exp(l - most)).sum();
    all.iter_mut().zip(&logs).for_each(|(p, log)| p.weight = libm::exp(log - most) / sum);
    all.retain(|p| p.weight > 1e-9);
    let log_evidence = most + libm::log(sum / rigs.len() as f64);
    (!all.is_empty() && log_evidence.is_finite()).then_some((all, log_evidence))
}

/// Values of a quantity of the points, with weights.
fn of_places(all: &[Place], value: impl Fn(&Place) -> f64) -> Vec<(f64, f64)> {
    all.iter().map(|p| (value(p), p.weight)).collect()
}

/// Values of a quantity of a part, with weights.
fn of_part(all: &[Place], part: usize, value: impl Fn(&PartDraw) -> f64) -> Vec<(f64, f64)> {
    let draws =
        |p: &Place| p.parts[part].draws.iter().map(|d| (value(d), p.weight * d.weight)).collect::<Vec<_>>();
    all.iter().flat_map(draws).collect()
}

fn mean(values: &[(f64, f64)]) -> f64 {
    let sums = values.iter().fold((0.0, 0.0), |(s, w), (x, weight)| (s + x * weight, w + weight));
    sums.0 / sums.1
}

/// Mean and 90 % interval of weighted values. Of points that are the middles of equal shares the outer ones stand for more than
/// themselves: quantiles are taken between the middles of weights.
fn estimate(values: &[(f64, f64)], unit: &str) -> ParameterEstimate {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|(_, w)| w).sum();
    let mut sum = 0.0;
    let middles: Vec<(f64, f64)> = sorted
        .iter()
        .map(|(x, w)| {
            sum += w;
            ((sum - 0.5 * w) / total, *x)
        })
        .collect();
    let at = |share: f64| {
        let next = middles.partition_point(|(s, _)| *s < share);
        match (next.checked_sub(1).map(|k| middles[k]), middles.get(next)) {
            (Some((s0, x0)), Some(&(s1, x1))) => x0 + (x1 - x0) * (share - s0) / (s1 - s0).max(1e-300),
            (Some((_, x)), None) => x,
            (None, Some(&(_, x))) => x,
            (None, None) => f64::NAN,
        }
    };
    ParameterEstimate::new(mean(values), (at(0.05), at(0.95)), unit)
}

/// The model of the posterior means.
fn means(context: &Context<'_>, all: &[Place], law: bool) -> PullModel {
    let mut model = context.base.clone();
    model.misread_n = 0.0;
    model.kinetic_ratio = mean(&of_places(all, |p| p.kinetic_ratio));
    model.lag_s = mean(&of_places(all, |p| p.rig.lag_s));
    model.noise_n = mean(&of_places(all, |p| p.rig.noise_n));
    model.scatter = mean(&of_places(all, |p| p.rig.scatter));
    model.bent_at_s = (model.lag_s, model.dead_time_s);
    for part in 0..model.mu.len() {
        model.mu[part] = mean(&of_part(all, part, |d| d.mu));
        if law {
            let offset_n = mean(&of_part(all, part, |d| d.mu * d.offset_n)) / model.mu[part];
            let values = OFFSET_LAW.values(&[("b_n", offset_n)]);
            model.effects.push(ModelEffect { part: Some(part), ..ModelEffect::new(OFFSET_LAW, values) });
        }
    }
    model
}

fn baseline(context: &Context<'_>, model: &PullModel, all: &[Place]) -> BTreeMap<String, ParameterEstimate> {
    let mut values = plain_baseline(model, context);
    for (part, name) in context.data.parts.iter().enumerate() {
        values.insert(format!("parts.{name}.mu"), estimate(&of_part(all, part, |d| d.mu), "1"));
    }
    let mut put = |key: &str, unit: &str, value: &dyn Fn(&Place) -> f64| {
        values.insert(key.into(), estimate(&of_places(all, value), unit));
    };
    put("kinetic_ratio", "1", &|p| p.kinetic_ratio);
    put("scatter", "1", &|p| p.rig.scatter);
    if context.observations.is_empty() {
        put("robot.lag_s", "s", &|p| p.rig.lag_s);
        put("wrist.noise_n", "N", &|p| p.rig.noise_n);
    }
    values
}

/// From mu' (1 + b' / F) to mu (a + b / F) with the mu of the twin.
fn law_of(d: &PartDraw, mu_given: f64) -> (f64, f64) {
    (d.mu / mu_given, d.mu * d.offset_n / mu_given)
}

fn laws(data: &PullData<'_>, given: &PullModel, all: &[Place]) -> Vec<OffsetLaw> {
    let force =
        |f: fn(f64, f64) -> f64, from: f64| data.measured.pulls.iter().map(|p| p.grip_force_n).fold(from, f);
    let range = (force(f64::min, f64::INFINITY), force(f64::max, 0.0));
    let each = |(part, name): (usize, &String)| {
        let of = |value: &dyn Fn(f64, f64) -> f64| {
            of_part(all, part, |d| {
                let (a, b) = law_of(d, given.mu[part]);
                value(a, b)
            })
        };
        let (a, b_n) = (estimate(&of(&|a, _| a), "1"), estimate(&of(&|_, b| b), "N"));
        let (ma, mb) = (a.value, b_n.value);
        let covariance = [
            mean(&of(&|a, _| (a - ma) * (a - ma))),
            mean(&of(&|a, b| (a - ma) * (b - mb))),
            mean(&of(&|_, b| (b - mb) * (b - mb))),
        ];
        let largest_relative_sigma = largest_relative_sigma((ma, mb), covariance, range);
        OffsetLaw { part: name.clone(), a, b_n, covariance, largest_relative_sigma, of_three_levels: None }
    };
    data.parts.iter().enumerate().map(each).collect()
}

/// The draws as they are handed on: points by their weight, a draw of each part on it.
fn posterior(data: &PullData<'_>, given: &PullModel, all: &[Place], law: bool) -> Posterior {
    let mut keys: Vec<String> = vec!["robot.lag_s".into(), "wrist.noise_n".into()];
    for name in &data.parts {
        let own = match law {
            true => vec![format!("effects.load_offset.{name}.a"), format!("effects.load_offset.{name}.b_n")],
            false => vec![format!("parts.{name}.mu")],
        };
        keys.extend(own);
        keys.extend(["kinetic_ratio", "scatter"].map(|leaf| format!("parts.{name}.{leaf}")));
    }
    let mut random = Draws::new(41, 0);
    let (mut at, mut sum) = (0, all[0].weight);
    let draws = (0..HANDED_ON).map(|i| {
        let share = (i as f64 + 0.5) / HANDED_ON as f64;
        while sum < share && at + 1 < all.len() {
            at += 1;
            sum += all[at].weight;
        }
        let place = &all[at];
        let mut values = vec![Some(place.rig.lag_s), Some(place.rig.noise_n)];
        for (part, answer) in place.parts.iter().enumerate() {
            let draw = picked(&answer.draws, random.uniform());
            let (a, b) = law_of(draw, given.mu[part]);
            let own = if law { vec![a, b] } else { vec![draw.mu] };
            values.extend(own.into_iter().chain([place.kinetic_ratio, place.rig.scatter]).map(Some));
        }
        let cause = if law { OFFSET_LAW.id } else { "none" };
        PosteriorDraw { weight: 1.0 / HANDED_ON as f64, cause: cause.into(), values }
    });
    Posterior { draws: draws.collect(), keys }
}

fn picked(draws: &[PartDraw], u: f64) -> &PartDraw {
    let mut sum = 0.0;
    let found = draws.iter().find(|d| {
        sum += d.weight;
        u < sum
    });
    found.unwrap_or(&draws[draws.len() - 1])
}

fn notes(data: &PullData<'_>, law: bool) -> Vec<String> {
    let mut notes = Vec::new();
    for (part, name) in data.parts.iter().enumerate().filter(|_| law) {
        let forces = forces_n(data, part);
        let span = forces.last().copied().unwrap_or_default() / forces.first().copied().unwrap_or(1.0);
        if forces.len() < 3 || span < SPAN {
            notes.push(format!(
                "{name}: {} grip forces, the largest {span:.1} times the smallest: its offset rests on what is believed of parts in general; three forces, the \
                 largest {SPAN} times the smallest, show it",
                forces.len()
            ));
        }
    }
    notes.extend(other_unit(&data.measured.pulls));
    notes
}

impl Context<'_> {
    /// Takes the kinetic ratio from the slips of one or two traces, which a search leaves alone.
    fn see_few_slips(&mut self) {
        if let (None, Some(slips)) = (self.kinetic, &self.slips) {
            self.kinetic = Some((slips.ratio, libm::hypot(slips.ratio_sd, slips.model_sd)));
            self.base.kinetic_ratio = slips.ratio;
        }
    }

    /// What was measured less what is predicted, and its standard deviation, of the pulls at `rows`: slips where there are traces,
    /// labels otherwise.
    fn compared(&self, model: &PullModel, rows: &[usize]) -> Vec<(f64, f64)> {
        let predicted = self.predicted(model, rows);
        let each = |(&row, p)| (self.difference_n(model, row, p), self.deviation_n(row, p));
        rows.iter().zip(&predicted).map(each).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_middles_of_weights() {
        let even: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i) * 1e-3, 1.0)).collect();
        let found = estimate(&even, "1");
        assert!((found.low90 - 0.0495).abs() < 1e-9 && (found.high90 - 0.9495).abs() < 1e-9, "{found:?}");
        assert!((found.value - 0.4995).abs() < 1e-9);
        // A weight of two is two points.
        let heavy = estimate(&[(1.0, 2.0), (2.0, 1.0), (3.0, 1.0)], "1");
        assert!((heavy.value - 1.75).abs() < 1e-12 && heavy.low90 == 1.0 && heavy.high90 == 3.0, "{heavy:?}");
        assert_eq!(estimate(&[(4.0, 0.2)], "1").low90, 4.0);
    }
}
