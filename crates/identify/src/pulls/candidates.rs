//! Which effects of the library compete for a campaign, and where their fits start.

use super::data::{Column, PullData};
use crate::least_squares::FreeParameter;
use gripgen_twin::PULLS_SINCE_REST;
use gripgen_twin::effects::{EffectSpec, Fit, LIBRARY, PullSpan, Seen};
use gripgen_twin::predict::ModelEffect;

/// An effect that competes.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Which.
    pub spec: &'static EffectSpec,
    /// Values from which its fit starts: the best of these fits counts.
    pub starts: Vec<Vec<f64>>,
    /// Which parameters are fitted, with their scales.
    pub free: Vec<(usize, f64)>,
    /// The only part it acts on, by position and name, or all.
    pub part: Option<(usize, String)>,
    /// Parameters that are tried at the starts only, like the pull at which something happened.
    pub searched: usize,
    /// End of the interval of its size towards nothing, where the likelihood was followed there (`profiled.rs`).
    pub end: Option<f64>,
}

impl Candidate {
    /// The effect with some values.
    pub fn with(&self, values: &[f64]) -> ModelEffect {
        ModelEffect { part: self.part.as_ref().map(|p| p.0), ..ModelEffect::new(self.spec, values.to_vec()) }
    }

    /// The same effect once for each part.
    pub fn by_part(&self, parts: &[String]) -> Vec<Self> {
        let own = |(k, name): (usize, &String)| Self { part: Some((k, name.clone())), ..self.clone() };
        parts.iter().enumerate().map(own).collect()
    }

    /// Its free parameters from a start.
    pub fn parameters(&self, start: &[f64]) -> Vec<FreeParameter> {
        self.free
            .iter()
            .map(|&(i, scale)| {
                let p = &self.spec.parameters[i];
                let bounds = self.spec.pulls.map_or(p.bounds, |fit| (fit.bounds)(p.name, start, p.bounds));
                FreeParameter { name: self.name_of(p.name), start: start[i], bounds, scale }
            })
            .collect()
    }

    /// Name of a parameter in a fit.
    pub fn name_of(&self, parameter: &str) -> String {
        match &self.part {
            Some((_, part)) => format!("{}@{part}.{parameter}", self.spec.id),
            None => format!("{}.{parameter}", self.spec.id),
        }
    }

    /// Parameters that the data have to pay for.
    pub fn cost(&self) -> usize {
        self.free.len() + self.searched
    }

    /// Whether it changes readings or commands.
    pub fn acts_on_signals(&self) -> bool {
        self.spec.acts_on_signals()
    }

    /// Whether traces show it beside what labels say: in readings, commands or displacements.
    pub fn shows_in_traces(&self) -> bool {
        self.acts_on_signals() || self.shows_in_displacements()
    }

    /// Whether displacements show it, whatever labels say.
    pub fn shows_in_displacements(&self) -> bool {
        self.spec.pulls.is_ok_and(|fit| fit.seen == Seen::InDisplacements)
    }

    /// Whether it does nothing up to a force and acts beyond, on all parts alike.
    pub fn is_end_of_a_range(&self) -> bool {
        self.part.is_none() && self.spec.pulls.is_ok_and(|fit| fit.flat_at_neutral)
    }

    /// Position of the parameter that says how large the effect is.
    pub fn size(&self) -> usize {
        self.free.first().map_or(0, |f| f.0)
    }
}

/// The effects of the library that can show in these pulls: those whose covariates vary. `creep_m_per_n_s` is the speed per newton at which
/// displacements show tools to creep, `without` are ids that must not compete.
pub fn candidates(
    data: &PullData<'_>,
    largest_reading_n: f64,
    creep_m_per_n_s: Option<f64>,
    without: &[&str],
) -> Vec<Candidate> {
    let seen = |spec: &EffectSpec| match spec.pulls {
        Ok(fit) if fit.seen == Seen::InDisplacements => creep_m_per_n_s.is_some(),
        _ => true,
    };
    LIBRARY
        .iter()
        .filter(|s| !without.contains(&s.id) && seen(s))
        .filter_map(|spec| candidate(spec, data, largest_reading_n, creep_m_per_n_s))
        .collect()
}

/// An effect as it competes in these pulls; `None` if its covariates do not vary or no pull can show it.
pub(super) fn candidate(
    spec: &'static EffectSpec,
    data: &PullData<'_>,
    largest_reading_n: f64,
    creep_m_per_n_s: Option<f64>,
) -> Option<Candidate> {
    let fit = spec.pulls.ok()?;
    let varies = |name: &str| data.varies(name);
    let has_range = spec.covariates.is_empty() || spec.covariates.iter().any(|c| varies(c));
    if !has_range || !fit.spans.iter().all(|c| varies(c)) {
        return None;
    }
    let Fit { starts, free, searched } = (fit.fit)(&PullSpan {
        varies: &varies,
        largest_reading_n,
        last_pull_index: numbers(data, "pull_index").into_iter().fold(0.0, f64::max).max(4.0),
        splits: splits(data),
        creep_mm_per_n_s: creep_m_per_n_s.map(|rate| 1e3 * rate),
        rests: data.measured.pulls.iter().any(|p| p.covariates.extra.contains_key(PULLS_SINCE_REST)),
    });
    let starts = starts.iter().map(|s| spec.values(s)).collect();
    let free = free.iter().filter_map(|(name, scale)| Some((spec.position(name)?, *scale))).collect();
    Some(Candidate { spec, starts, free, part: None, searched, end: None })
}

fn numbers(data: &PullData<'_>, name: &str) -> Vec<f64> {
    match data.columns.get(name) {
        Some(Column::Number(x)) => x.clone(),
        _ => vec![],
    }
}

/// Pull indices at which something may have happened: between any two of about thirty parts of the campaign.
fn splits(data: &PullData<'_>) -> Vec<f64> {
    let mut at = numbers(data, "pull_index");
    at.sort_by(f64::total_cmp);
    at.dedup();
    let n = at.len();
    let margin = (n / 20).max(3);
    let count = 36.min(n);
    let mut found: Vec<f64> = (0..count)
        .map(|i| margin + i * n.saturating_sub(2 * margin) / count.max(1))
        .filter_map(|i| at.get(i).copied())
        .collect();
    found.dedup();
    found
}
