//! The end of a range that only one level of the grip force reaches.

use super::context::Context;
use super::fitting::Fitted;
use super::heldout::feeling;
use crate::diagnosis::Diagnosis;

/// What is said of the only effect that was named, where it is the end of a range and pulls of only one grip force feel it.
pub(super) fn of_one_level(diagnosis: &Diagnosis, context: &Context<'_>, fitted: &Fitted) -> Option<String> {
    let [only] = &diagnosis.effects[..] else { return None };
    let (candidate, _) = fitted.terms.effects.iter().find(|(c, _)| c.spec.id == only.name)?;
    if !candidate.is_end_of_a_range() {
        return None;
    }
    let pulls = &context.data.measured.pulls;
    let all: Vec<usize> = (0..pulls.len()).collect();
    let felt = feeling(context, &fitted.model, candidate, &all);
    let mut feel: Vec<u64> = felt.iter().map(|&i| pulls[i].grip_force_n.to_bits()).collect();
    let count = feel.len();
    feel.sort_unstable();
    feel.dedup();
    let [level] = feel[..] else { return None };
    Some(format!(
        "{} rests on one level of the grip force, the {count} pulls at {} N: whatever else takes from that level looks the same, and pulls at levels \
         between tell",
        only.name,
        f64::from_bits(level)
    ))
}
