//! What a recorded reason says, without the evidence that it came from.

use super::{Finding, OF_THE_RIG};

/// Whether a reason that was recorded ([`Judgement::reason`](super::Judgement::reason), perhaps with others behind it, joined by semicolons)
/// holds nothing but findings that an effect of sensor or robot may be behind. A camera that fell silent is none.
pub fn recorded_may_be_the_rig(reason: &str) -> bool {
    let known = OF_THE_RIG.map(|kind| {
        let finding = Finding { kind, found: 0.0, wanted: 0.0, allowed: 0.0, time_s: None };
        plain(&finding.to_string())
    });
    let mut reasons = reasons_of(reason).peekable();
    reasons.peek().is_some() && reasons.all(|reason| known.contains(&plain(reason)))
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
