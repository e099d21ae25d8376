//! Which pulls are shown with their images.

use super::expected::ExpectedLabels;
use super::rows::Rows;
use crate::text::spread;
use std::collections::{BTreeMap, BTreeSet};

/// At most `most` rows, in their order: a quarter for those farthest from what is expected, as many for those that did not slip,
/// the rest for all parts in turn, and of each part labels from small to large.
pub(super) fn chosen(rows: &Rows<'_>, expected: &ExpectedLabels, most: usize) -> Vec<usize> {
    if rows.len() <= most {
        return (0..rows.len()).collect();
    }
    let mut far: Vec<(f64, usize)> =
        (0..rows.len()).filter_map(|row| Some((expected.of_row(row)?.deviations.abs(), row))).collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut taken: BTreeSet<usize> = far.iter().take(most / 4).map(|(_, row)| *row).collect();
    let mut others: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut slipped: BTreeMap<&str, Vec<(f64, usize)>> = BTreeMap::new();
    for row in 0..rows.len() {
        match rows.status(row) {
            "slipped" => slipped.entry(rows.part(row)).or_default().push((rows.label_n(row), row)),
            status => others.entry(status).or_default().push(row),
        }
    }
    let of_status = (most / 4).div_ceil(others.len().max(1));
    others.values().for_each(|rows| taken.extend(spread(rows, of_status)));
    let per_part = most.saturating_sub(taken.len()).div_ceil(slipped.len().max(1));
    for of_part in slipped.values_mut() {
        of_part.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(_, row) in spread(of_part, per_part) {
            if taken.len() < most {
                taken.insert(row);
            }
        }
    }
    // Some were taken twice.
    let left: Vec<usize> = (0..rows.len()).filter(|row| !taken.contains(row)).collect();
    taken.extend(spread(&left, most.saturating_sub(taken.len())));
    taken.into_iter().take(most).collect()
}
