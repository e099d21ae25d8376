//! What is said of a fit: names with sizes and what cannot be told from them, columns of unknown meaning.

use super::search::{Fit, Pool, Search};
use super::sizes::{amplitude_of, scaled, shape_of};
use super::terms::Kind;
use crate::diagnosis::{Diagnosis, NamedEffect, ParameterEstimate, Rival, UnknownCovariate};
use crate::pulls::candidates::Candidate;
use crate::pulls::data::{Column, PullData};
use gripgen_twin::effects::Measured as MeasuredIn;
use std::collections::BTreeMap;

/// A term is said unless nothing in its place is more likely than this.
const NOTHING: f64 = 0.35;
/// What a set that cannot be told apart has together.
const CREDIBLE: f64 = 0.9;
/// Share of the variance of a column from which on another one, whose values come back this often, fixes it.
const TIED: f64 = 0.9;
const REPEATED: usize = 3;
/// Deviation of session factors from which on sessions are said to differ.
const SESSIONS: f64 = 0.02;

/// Takes out of a fit what is not sure enough to be said. The weakest goes first: what others lean on may become clear without it.
pub(super) fn sure(search: &Search, mut fit: Fit) -> Fit {
    loop {
        let nothing =
            |place: usize| search.pool(&fit, place).iter().find(|(c, ..)| c.is_none()).map_or(0.0, |p| p.2);
        let doubtful = (0..fit.chosen.len()).map(|place| (nothing(place), place));
        let worst = doubtful.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(nothing, _)| *nothing > NOTHING);
        match worst.and_then(|(_, place)| search.without(&fit, place)) {
            Some(fewer) => fit = fewer,
            None => return fit,
        }
    }
}

/// Columns that act together in a way which no term describes; `nothing` is the probability that they do not.
pub(super) fn together(search: &Search, fit: &Fit, columns: &[&str], nothing: f64) -> UnknownCovariate {
    let place = fit.chosen.len() + fit.process.len() - 1;
    UnknownCovariate {
        covariate: columns.join("*"),
        strength: strength(search, fit, place),
        p_value: nothing,
    }
}

/// Columns of numbers that hardly vary where another one has the same value: what belongs to which cannot be told.
pub(super) fn tied(data: &PullData<'_>, columns: &[&str]) -> Vec<String> {
    let numbers = |name: &str| match data.columns.get(name) {
        Some(Column::Number(x)) => Some(x),
        _ => None,
    };
    let mut found = vec![];
    for (a, b) in columns.iter().flat_map(|a| columns.iter().map(move |b| (*a, *b))).filter(|(a, b)| a != b) {
        let (Some(x), Some(y)) = (numbers(a), numbers(b)) else { continue };
        let mut groups: BTreeMap<(usize, u64), Vec<f64>> = BTreeMap::new();
        for (i, (x, y)) in x.iter().zip(y).enumerate() {
            groups.entry((data.part_of[i], x.to_bits())).or_default().push(*y);
        }
        if groups.len() * REPEATED > x.len() {
            continue;
        }
        let square = |y: &[f64]| {
            let mean = y.iter().sum::<f64>() / y.len() as f64;
            y.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>()
        };
        let share = 1.0 - groups.values().map(|own| square(own)).sum::<f64>() / square(y).max(1e-300);
        if share > TIED {
            found.push(format!(
                "{b} and {a} are tied in these pulls: where {a} is the same, {b} varies by {:.0} % of its variance. What belongs to which cannot be told",
                100.0 * (1.0 - share)
            ));
        }
    }
    found
}

/// Puts what was found into words; what else fits is asked of the terms alone, without a process.
pub(super) fn said(
    data: &PullData<'_>,
    candidates: &[Candidate],
    search: &Search,
    fit: &Fit,
    diagnosis: &mut Diagnosis,
) {
    let alone = search.only(fit, &vec![true; fit.chosen.len()]);
    for place in 0..fit.chosen.len() {
        let pool = search.pool(alone.as_ref().unwrap_or(fit), place);
        name(data, candidates, search, (fit, place), &pool, diagnosis);
    }
    diagnosis.effects.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    if let Some(block) = search.session {
        let sd = libm::exp(fit.gaussian.log_sd[block]);
        if sd > SESSIONS {
            let strength = sd * sd / (sd * sd + libm::exp(2.0 * fit.gaussian.log_noise[0]));
            diagnosis.unknown.push(UnknownCovariate { covariate: "session".into(), strength, p_value: 0.0 });
        }
    }
}

fn name(
    data: &PullData<'_>,
    candidates: &[Candidate],
    search: &Search,
    (fit, place): (&Fit, usize),
    pool: &Pool,
    diagnosis: &mut Diagnosis,
) {
    let weight = pool[0].2;
    let none = pool.iter().find(|(c, ..)| c.is_none()).map_or(0.0, |p| p.2);
    let unnamed = |covariate: String| UnknownCovariate {
        covariate,
        strength: strength(search, fit, place),
        p_value: none,
    };
    match &search.terms[fit.chosen[place].term].kind {
        Kind::Column(name) => diagnosis.unknown.push(unnamed(name.clone())),
        Kind::ColumnOfParts(name) => diagnosis.unknown.push(unnamed(format!("{name}*part"))),
        Kind::Pair(a, b) => diagnosis.unknown.push(unnamed(format!("{a}*{b}"))),
        Kind::Effect(e) | Kind::EffectOfParts(e) => {
            let candidate = &candidates[*e];
            let mut alternatives: Vec<Rival> = Vec::new();
            let mut sum = weight;
            let mut others: Vec<(f64, usize)> = pool[1..]
                .iter()
                .filter_map(|(c, _, w)| match search.terms[(*c)?.term].kind {
                    Kind::Effect(k) | Kind::EffectOfParts(k) if k != *e => Some((*w, k)),
                    _ => None,
                })
                .collect();
            others.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (w, k) in others {
                let id = candidates[k].spec.id;
                if sum >= CREDIBLE || alternatives.iter().any(|r| r.name == id) {
                    continue;
                }
                sum += w;
                alternatives.push(Rival { name: id.into(), weight: w });
            }
            let entry = |part: Option<usize>, share: (f64, f64)| {
                let at = shape_of(search, &fit.chosen[place])
                    .at
                    .as_ref()
                    .map(|a| a.values.clone())
                    .unwrap_or_default();
                let mut named = NamedEffect::new(
                    candidate.spec.id,
                    weight,
                    estimates(candidate, &at, share),
                    alternatives.clone(),
                    (MeasuredIn::Pulls, None),
                );
                named.part = part.map(|p| data.parts[p].clone());
                named
            };
            if matches!(search.terms[fit.chosen[place].term].kind, Kind::Effect(_)) {
                diagnosis.effects.extend(amplitude_of(search, fit, place, 0).map(|share| entry(None, share)));
            } else {
                let each =
                    (0..data.parts.len()).filter_map(|p| Some((p, amplitude_of(search, fit, place, p)?)));
                let seen = each.filter(|(_, (share, sd))| share.abs() > 1.645 * sd);
                diagnosis.effects.extend(seen.map(|(p, share)| entry(Some(p), share)));
            }
        }
    }
}

/// Share of the residual variance without a term that the term explains.
fn strength(search: &Search, fit: &Fit, place: usize) -> f64 {
    let own = fit.gaussian.part(search.block_of(place)).norm_squared();
    own / (own + fit.gaussian.residual.norm_squared()).max(1e-300)
}

/// The parameters of an effect; the interval is that of its size.
fn estimates(
    candidate: &Candidate,
    at: &[f64],
    (share, sd): (f64, f64),
) -> BTreeMap<String, ParameterEstimate> {
    let values = scaled(candidate, at, share);
    let size = candidate.size();
    let free = candidate.free.iter().map(|&(k, _)| {
        let p = &candidate.spec.parameters[k];
        let ends = |share: f64| scaled(candidate, at, share)[k];
        let (a, b) = (ends(share - 1.645 * sd), ends(share + 1.645 * sd));
        let interval = if k == size { (a.min(b), a.max(b)) } else { (values[k], values[k]) };
        (p.name.to_string(), ParameterEstimate::new(values[k], interval, p.unit))
    });
    free.collect()
}
