//! Forces that are in another unit.

use gripgen_twin::{MeasuredPull, POSSIBLE_LABEL_RATIO, median_label_ratio, rounded};

/// What is asked where labels are what no gel gives.
pub(super) fn other_unit(pulls: &[MeasuredPull]) -> Option<String> {
    let (low, high) = POSSIBLE_LABEL_RATIO;
    let ratio = median_label_ratio(pulls).filter(|ratio| !(low..=high).contains(ratio))?;
    Some(format!(
        "the labels are {} times twice the grip force, which no gel does ({low} to {high}): are all forces in newtons, per jaw?",
        rounded(ratio, &[low, high])
    ))
}
