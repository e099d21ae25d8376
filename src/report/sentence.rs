//! The verdict in one sentence.

use super::bars::number;
use gripgen_identify::{
    Channel, Diagnosis, HeldOutError, MIN_REPORTABLE_WEIGHT, NamedEffect, Verdict, summary_sentence,
};

/// The unit of errors of a channel.
pub(super) fn error_unit(channel: Channel) -> &'static str {
    match channel {
        Channel::Pulls | Channel::Sensor => "N",
        Channel::Presses => "grey levels\u{b2}",
        Channel::Imprints => "mm\u{b3}",
    }
}

/// What a diagnosis says, for somebody who reads one sentence only.
pub(super) fn sentence(d: &Diagnosis) -> String {
    match d.verdict {
        Verdict::Insufficient => summary_sentence(d),
        Verdict::None => {
            let end = after(d).map(|e| format!(": the held-out error is {e}")).unwrap_or_default();
            format!("Nothing beyond the baseline was found{end}{}.", floor(d))
        }
        Verdict::Unknown => {
            let names: Vec<&str> = d.unknown.iter().map(|u| u.covariate.as_str()).collect();
            format!(
                "The residual depends on {} in a way that no known effect explains{}{}.",
                list(&names),
                change(d, "a table over it"),
                floor(d)
            )
        }
        Verdict::Effect => {
            let names: Vec<String> = d.effects.iter().map(named).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let (subject, it) = match names.len() {
                1 => (format!("The twin lacks {}", names[0]), "adding it"),
                n => (format!("The twin lacks {n} effects: {}", list(&names)), "adding them"),
            };
            let beside: Vec<&str> = d.unknown.iter().map(|u| u.covariate.as_str()).collect();
            let beside = match beside.is_empty() {
                true => String::new(),
                false => format!(", and something unknown that goes with {}", list(&beside)),
            };
            format!("{subject}{beside}{}{}.", change(d, it), floor(d))
        }
    }
}

/// An effect with what it cannot be told from.
fn named(effect: &NamedEffect) -> String {
    let rivals: Vec<&str> = effect.indistinguishable_from.iter().map(|r| r.name.as_str()).collect();
    let part = effect.part.as_ref().map(|p| format!(" on {p}")).unwrap_or_default();
    let name = match effect.weight < MIN_REPORTABLE_WEIGHT {
        true => format!("perhaps {}{part} (weight {:.2})", effect.name, effect.weight),
        false => format!("{}{part}", effect.name),
    };
    match rivals.is_empty() {
        true => name,
        false => format!("{name} (which these data do not tell from {})", list(&rivals)),
    }
}

fn list(names: &[&str]) -> String {
    match names {
        [] => "nothing".into(),
        [one] => (*one).into(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

fn value(e: &HeldOutError, channel: Channel) -> Option<String> {
    let value = e.rmse_n.or(e.mse).or(e.rmse_mm3).filter(|v| v.is_finite())?;
    Some(format!("{} {}", number(value), error_unit(channel)))
}

fn after(d: &Diagnosis) -> Option<String> {
    value(&d.error.as_ref()?.after, d.channel)
}

fn change(d: &Diagnosis, what: &str) -> String {
    let both =
        d.error.as_ref().and_then(|e| Some((value(&e.before, d.channel)?, value(&e.after, d.channel)?)));
    both.map(|(before, after)| format!("; {what} takes the held-out error from {before} to {after}"))
        .unwrap_or_default()
}

fn floor(d: &Diagnosis) -> String {
    let floor = d.noise_floor_n.or(d.noise_floor_mse).or(d.noise_floor_mm3).filter(|v| v.is_finite());
    floor.map(|v| format!(" (noise floor {} {})", number(v), error_unit(d.channel))).unwrap_or_default()
}
