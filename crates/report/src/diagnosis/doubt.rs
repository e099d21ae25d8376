//! What is said of a name that is not sure.

use super::EvidenceRow;
use gripgen_identify::{Diagnosis, NamedEffect};
use gripgen_twin::effects::{EffectSpec, find};

/// Weight from which on a name is sure.
const SURE: f64 = 0.5;

/// Share of redrawn campaigns that name it again, from which on it is.
const AGAIN: f64 = 0.8;

/// A sentence on the first name that is not sure, with the nearest other one in the words of the catalogue.
pub fn doubt(d: &Diagnosis, evidence: &[EvidenceRow]) -> Option<String> {
    let again = |effect: &NamedEffect| effect.named_again.is_some_and(|share| share < AGAIN);
    let effect = d.effects.iter().find(|effect| effect.weight < SURE || again(effect))?;
    let again = effect.named_again.map_or(String::new(), |share| {
        format!("; of campaigns drawn anew, {:.0} % name it or what is tied with it", 100.0 * share)
    });
    let name = format!("The name {} is not sure (weight {:.2}{again})", effect.name, effect.weight);
    Some(match nearest(d, effect, evidence) {
        Some(other) => format!("{name}. Nearest to it is {}: {}", other.id, other.plainly),
        None => format!("{name}."),
    })
}

/// The effect that predicts held-out data best among those that were not named, or the heaviest of what is tied with it.
fn nearest(d: &Diagnosis, effect: &NamedEffect, evidence: &[EvidenceRow]) -> Option<&'static EffectSpec> {
    let other =
        |name: &str| find(one_for_all(name)).filter(|spec| d.effects.iter().all(|e| e.name != spec.id));
    let rows = evidence.iter().filter(|row| row.heldout_gain.is_finite());
    let tried = rows.filter_map(|row| Some((row.heldout_gain, other(&row.name)?)));
    let tied = effect.indistinguishable_from.iter().filter_map(|r| Some((r.weight, other(&r.name)?)));
    let best = |all: Vec<(f64, &'static EffectSpec)>| {
        all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, spec)| spec)
    };
    best(tried.collect()).or_else(|| best(tied.collect()))
}

/// The name of an effect that was tried with a value for each part.
pub(crate) fn one_for_all(name: &str) -> &str {
    name.strip_suffix(", by part").unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_identify::{Channel, DataSummary, Rival};
    use std::collections::BTreeMap;

    fn row(name: &str, heldout_gain: f64) -> EvidenceRow {
        let (standard_error, heldout_error) = (5.0, 0.14);
        let (values, fate) = Default::default();
        EvidenceRow { name: name.into(), heldout_gain, standard_error, heldout_error, values, fate }
    }

    fn said(weight: f64, share: f64, evidence: &[EvidenceRow]) -> String {
        let mut d = Diagnosis::blank(Channel::Pulls, DataSummary::default());
        d.effects.push(NamedEffect {
            name: "area_saturation".into(),
            part: None,
            class: vec!["area_saturation".into()],
            weight,
            parameters: BTreeMap::new(),
            indistinguishable_from: vec![Rival { name: "regime_transition".into(), weight: 0.09 }],
            separate_by: None,
            named_again: Some(share),
        });
        doubt(&d, evidence).unwrap_or_default()
    }

    /// The true law is in the table of evidence, ahead of what was named.
    #[test]
    fn an_uncertain_name_comes_with_its_nearest_alternative() {
        let evidence =
            [row("curve in grip_force_n", 14.0), row("area_saturation", 10.4), row("load_power_law", 13.0)];
        let light = said(0.12, 0.22, &evidence);
        let doubted = "area_saturation is not sure (weight 0.12; of campaigns drawn anew, 22 % name it or what is tied with it). \
                       Nearest to it is load_power_law: The friction coefficient changes smoothly";
        assert!(light.contains(doubted), "{light}");
        assert!(said(0.7, 0.75, &evidence).contains("not sure"), "a quarter of them names something else");
        assert!(said(0.45, 0.99, &[]).contains("Nearest to it is regime_transition"));
        assert_eq!(said(0.7, 0.95, &evidence), "");
    }
}
