//! What a recorded reason says, without the evidence that it came from.

use super::{Behind, Finding, FindingKind};

/// What may be behind a reason that was recorded ([`Judgement::reason`](super::Judgement::reason), perhaps with others after it, joined by
/// semicolons). A camera that fell silent is an accident of its pull.
pub fn recorded_behind(reason: &str) -> Behind {
    let known = FindingKind::ALL.map(|kind| {
        let finding = Finding { kind, found: 0.0, wanted: 0.0, allowed: 0.0, time_s: None };
        (plain(&finding.to_string()), kind.behind())
    });
    let behind = |reason: &str| {
        let reason = plain(reason);
        known.iter().find(|(text, _)| *text == reason).map_or(Behind::Pull, |(_, behind)| *behind)
    };
    reasons_of(reason).map(behind).min().unwrap_or(Behind::Pull)
}

/// The reasons of a record. In the brackets of one there is a semicolon too: "(0.33 N are allowed; at 0.10 s)".
fn reasons_of(reason: &str) -> impl Iterator<Item = &str> {
    reason.split("; ").filter(|part| !part.is_empty() && !part.starts_with("at "))
}

/// A reason without its numbers and what stands in brackets.
fn plain(reason: &str) -> String {
    let before = reason.split(" (").next().unwrap_or_default();
    before.chars().filter(|c| !c.is_ascii_digit() && !matches!(c, '-' | '.')).collect()
}
