//! How far the search can be trusted in this campaign: the accepted model and the plain baseline are simulated many times at
//! the same pulls, and the competition is run again on each.
//!
//! What a rival would gain is taken from its slope at nothing (a score test), so a repetition costs some dot products and no
//! fit. Noise is Gaussian with the memory of the fitted residuals. Traces are left out: this is about labels and slips.

use super::power::ScoreTest;
use super::search::{Accepted, CURVE_GAIN, ModelTerm, NAMED_GAIN, Search, Tied};
use crate::diagnosis::Diagnosis;
use crate::draws::Draws;
use nalgebra::DVector;

/// Simulated campaigns.
const CAMPAIGNS: usize = 400;

/// What simulated campaigns say of one accepted effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trusted {
    /// Its id.
    pub effect: &'static str,
    /// Share of campaigns with it in which it, or what is tied with it here, is named first.
    pub recovered: f64,
    /// Share of campaigns without it in which something is named.
    pub false_alarms: f64,
}

/// Directions in which a rival moves the residuals, orthonormal.
struct Direction {
    rival: ModelTerm,
    cost: f64,
    vectors: Vec<DVector<f64>>,
}

/// Simulates the campaign of `search` with and without each accepted effect on friction, beside the other accepted ones. What
/// shows in traces, in readings or displacements, is not simulated.
pub fn trusted(search: &Search<'_>, accepted: &Accepted) -> Vec<Trusted> {
    let acting = accepted.effects.iter().filter(|(i, _)| !search.candidates[*i].shows_in_traces());
    let of = |(i, tied): &(usize, Vec<Tied>)| {
        let set: Vec<usize> = tied.iter().map(|t| t.effect).chain([*i]).collect();
        of_effect(search, accepted, *i, &set)
    };
    acting.map(of).collect()
}

/// Puts what simulated campaigns say into an answer: weights are multiplied by the share of them in which the effect, or what is
/// tied with it, is found again.
pub fn recalibrate(diagnosis: &mut Diagnosis, trusted: &[Trusted]) {
    for t in trusted {
        let entries = diagnosis.effects.iter_mut().filter(|e| e.name == t.effect);
        entries.for_each(|e| {
            e.named_again = Some(t.recovered);
            e.weight *= t.recovered.max(0.02);
            e.indistinguishable_from.iter_mut().for_each(|r| r.weight *= t.recovered.max(0.02));
        });
        diagnosis.notes.push(format!(
            "of simulated campaigns with these pulls and this {}, {:.0} % name it, or what is tied with it, first; of those without it, {:.0} % name something",
            t.effect,
            100.0 * t.recovered,
            100.0 * t.false_alarms
        ));
    }
}

/// Of one effect; `set` is it and what is tied with it.
fn of_effect(search: &Search<'_>, accepted: &Accepted, effect: usize, set: &[usize]) -> Trusted {
    let spec = search.candidates[effect].spec;
    let fitted = &accepted.fitted;
    let mut terms = fitted.terms.clone();
    terms.effects.retain(|(c, _)| c.spec != spec);
    let mut without = fitted.model.clone();
    without.effects.retain(|e| e.spec != spec);
    let mut test = ScoreTest::new(search.context, &without, &terms, &search.rows, false);
    test.scale = fitted.likelihood.scale.max(0.1);
    let each = 0.5 * libm::log(search.rows.len().max(2) as f64);
    let mut directions = Vec::new();
    let mut add = |rival: ModelTerm, cost: usize, columns: Vec<DVector<f64>>| {
        directions.push(Direction { rival, cost: each * cost as f64, vectors: orthonormal(columns) });
    };
    for (i, candidate) in search.candidates.iter().enumerate().filter(|(_, c)| !c.acts_on_signals()) {
        if terms.effects.iter().any(|(c, _)| c.spec == candidate.spec) {
            continue;
        }
        for from in &candidate.starts {
            add(ModelTerm::Effect(i), candidate.cost(), vec![test.direction(candidate, from)]);
        }
    }
    // Effects that are bent in their parameters, as they were fitted.
    for (candidate, values) in fitted.terms.effects.iter().filter(|(c, _)| c.spec == spec) {
        add(ModelTerm::Effect(effect), candidate.cost(), vec![test.direction(candidate, values)]);
    }
    for entry in &accepted.entries {
        let Some(i) = entry.rival.effect().filter(|&i| !search.candidates[i].acts_on_signals()) else {
            continue;
        };
        if terms.effects.iter().any(|(c, _)| c.spec == search.candidates[i].spec) {
            continue;
        }
        let own: Vec<_> =
            entry.fitted.terms.effects.iter().filter(|(c, _)| c.spec == search.candidates[i].spec).collect();
        let cost = own.iter().map(|(c, _)| c.cost()).sum();
        add(entry.rival.clone(), cost, own.iter().map(|(c, values)| test.direction(c, values)).collect());
    }
    for (k, curve) in search.curves.iter().enumerate() {
        if search.stands_beside(&ModelTerm::Curve(k), &[effect], &[]) {
            add(ModelTerm::Curve(k), curve.cost, test.directions_of(curve));
        }
    }
    let signal = test.free(&test.own(&(test.residuals_of(&without) - test.residuals_of(&fitted.model))));
    let mut draws = Draws::new(23, 4);
    let (mut alarms, mut again) = (0, 0);
    for _ in 0..CAMPAIGNS {
        let noise = test.free(&noise(search, fitted.likelihood.memory, &mut draws));
        alarms += usize::from(best(&directions, &noise).is_some());
        let found = best(&directions, &(&signal + noise));
        let named = found.and_then(|d| directions[d].rival.effect());
        again += usize::from(named.is_some_and(|i| set.contains(&i)));
    }
    let share = |n: usize| n as f64 / CAMPAIGNS as f64;
    Trusted { effect: spec.id, recovered: share(again), false_alarms: share(alarms) }
}

/// The direction that would be named, if one would.
fn best(directions: &[Direction], residuals: &DVector<f64>) -> Option<usize> {
    let score = |d: &Direction| {
        let gain: f64 = d.vectors.iter().map(|v| v.dot(residuals).powi(2)).sum();
        let least = if d.rival.effect().is_some() { NAMED_GAIN } else { CURVE_GAIN };
        (0.5 * gain - d.cost, least)
    };
    let all = directions.iter().map(score).enumerate();
    let passed = all.filter(|(_, (gain, least))| gain >= least);
    passed.max_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(d, _)| d)
}

/// Gaussian noise whose neighbours within a session remember each other.
fn noise(search: &Search<'_>, memory: f64, draws: &mut Draws) -> DVector<f64> {
    let sessions = &search.context.data.session_of;
    let fresh = (1.0 - memory * memory).sqrt();
    let mut last = 0.0;
    DVector::from_iterator(
        search.rows.len(),
        search.rows.iter().map(|&i| {
            let starts = i == 0 || sessions[i] != sessions[i - 1];
            let z = draws.normal();
            last = if starts { z } else { memory * last + fresh * z };
            last
        }),
    )
}

/// Gram and Schmidt, what depends on others left out.
pub(super) fn orthonormal(columns: Vec<DVector<f64>>) -> Vec<DVector<f64>> {
    let mut found: Vec<DVector<f64>> = Vec::new();
    for mut column in columns {
        let length = column.norm();
        for other in &found {
            column -= other * other.dot(&column);
        }
        if column.norm() > 1e-6 * length && length > 1e-9 {
            column /= column.norm();
            found.push(column);
        }
    }
    found
}
