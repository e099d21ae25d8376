//! What a diagnosis says to people.

use crate::effect_search::separating;
use gripgen_twin::effects::Measured;

/// What tells effects apart, for people.
pub(super) fn separation(name: &str, rivals: &[&str]) -> String {
    let suspects: Vec<&str> = std::iter::once(name).chain(rivals.iter().copied()).collect();
    let steps = separating(Measured::Pulls, &suspects);
    if steps.is_empty() {
        return "repeat the campaign with every covariate varied in random order".into();
    }
    steps.iter().map(|step| step.text()).collect::<Vec<_>>().join("; ")
}
