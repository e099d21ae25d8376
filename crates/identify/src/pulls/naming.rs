//! Accepted effects as they are reported, with what looks like them.

use super::estimates::parameters;
use super::fitting::Fitted;
use super::search::{Accepted, Search, TIED_WITHIN};
use super::words::separation;
use crate::diagnosis::{NamedEffect, Rival, SeparateBy};
use std::collections::BTreeMap;

/// Odds are taken to this power, because no model here is exactly right.
const TEMPER: f64 = 0.6;

/// The accepted effects with their rivals.
pub(super) fn named(search: &Search<'_>, before: &Fitted, accepted: &Accepted) -> Vec<NamedEffect> {
    let mut effects: Vec<NamedEffect> = accepted
        .effects
        .iter()
        .flat_map(|(i, tied)| {
            let candidate = &search.candidates[*i];
            let odds: Vec<f64> = tied.iter().map(|t| libm::exp(TEMPER * t.less)).collect();
            let total = 1.0 + odds.iter().sum::<f64>();
            // What is left for "none" and for everything else.
            let alone = accepted.entries.iter().find(|e| e.rival.effect() == Some(*i));
            let rest = alone.map_or(0.05, |e| libm::exp(-TEMPER * e.gain.max(0.0)).min(0.5)).max(0.02);
            let share = (1.0 - rest) / total;
            let rivals: Vec<Rival> = tied
                .iter()
                .zip(&odds)
                .map(|(t, odds)| Rival {
                    name: search.candidates[t.effect].spec.id.into(),
                    weight: share * odds,
                })
                .collect();
            let mut class: Vec<String> = vec![candidate.spec.id.into()];
            class.extend(tied.iter().map(|t| search.candidates[t.effect].spec.id.to_string()));
            class.extend(
                alike(search, before, accepted, *i)
                    .into_iter()
                    .filter(|c| !class.contains(c))
                    .collect::<Vec<_>>(),
            );
            let names: Vec<&str> = tied.iter().map(|t| search.candidates[t.effect].spec.id).collect();
            let named = NamedEffect {
                named_again: None,
                name: candidate.spec.id.into(),
                part: None,
                class,
                weight: share,
                parameters: BTreeMap::new(),
                indistinguishable_from: rivals,
                separate_by: (!names.is_empty())
                    .then(|| SeparateBy { text: separation(candidate.spec.id, &names), campaign: None }),
            };
            // One entry, or one for each part that shows it.
            let own =
                accepted.fitted.terms.effects.iter().map(|(c, _)| c).filter(|c| c.spec == candidate.spec);
            let each = own.filter_map(|c| {
                let parameters = parameters(&accepted.fitted, c);
                let size = &c.spec.parameters[c.size()];
                let seen = c.part.is_none()
                    || parameters
                        .get(size.name)
                        .is_some_and(|p| p.low90 > size.neutral || p.high90 < size.neutral);
                let part = c.part.as_ref().map(|(_, name)| name.clone());
                seen.then(|| NamedEffect { part, parameters, ..named.clone() })
            });
            each.collect::<Vec<_>>()
        })
        .collect();
    effects.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    effects
}

/// Effects that explain nearly as much as effect `i` does alone: its class in this campaign.
fn alike(search: &Search<'_>, before: &Fitted, accepted: &Accepted, i: usize) -> Vec<String> {
    let gained = |f: &Fitted| (f.likelihood.log - f.trace_cost) - (before.likelihood.log - before.trace_cost);
    let own = accepted.entries.iter().find(|e| e.rival.effect() == Some(i));
    let Some(own) = own.map(|e| gained(&e.fitted)) else { return vec![] };
    // What was found beside another effect was not seen alone: these entries say nothing of it.
    let best = accepted.entries.iter().filter(|e| e.rival.effect().is_some()).map(|e| gained(&e.fitted));
    if own < best.fold(f64::NEG_INFINITY, f64::max) - 3.0 * TIED_WITHIN {
        return vec![];
    }
    let wide = (0.1 * own).clamp(TIED_WITHIN, 3.0 * TIED_WITHIN);
    let near = |e: &super::search::Entry| match e.rival.effect() {
        Some(k) if k != i && gained(&e.fitted) > own - wide => Some(search.candidates[k].spec.id.to_string()),
        _ => None,
    };
    let mut found: Vec<String> = accepted.entries.iter().filter_map(near).collect();
    found.sort();
    found.dedup();
    found
}
