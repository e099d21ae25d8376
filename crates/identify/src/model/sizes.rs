//! Sizes of effects from the coefficients of their columns.

use super::search::{Chosen, Fit, Search};
use super::terms::{Shape, bounds_of};
use crate::pulls::candidates::Candidate;

/// The shape of a chosen term.
pub(super) fn shape_of<'s>(search: &'s Search, chosen: &Chosen) -> &'s Shape {
    &search.terms[chosen.term].shapes[chosen.shape]
}

/// The values of an effect that a fit says.
pub(super) fn values_of(candidate: &Candidate, search: &Search, fit: &Fit, place: usize) -> Option<Vec<f64>> {
    let at = shape_of(search, &fit.chosen[place]).at.as_ref()?;
    let (share, _) = amplitude_of(search, fit, place, 0)?;
    Some(scaled(candidate, &at.values, share))
}

/// Values with the size multiplied by `share`.
pub(super) fn scaled(candidate: &Candidate, at: &[f64], share: f64) -> Vec<f64> {
    let mut values = at.to_vec();
    let k = candidate.size();
    let neutral = candidate.spec.parameters[k].neutral;
    let (low, high) = bounds_of(candidate, at);
    values[k] = (neutral + share * (at[k] - neutral)).clamp(low, high);
    values
}

/// Size over that at which the column of an effect was worked out, with its deviation; `part` is 0 of an effect with one size.
pub(super) fn amplitude_of(search: &Search, fit: &Fit, place: usize, part: usize) -> Option<(f64, f64)> {
    let rms = shape_of(search, &fit.chosen[place]).at.as_ref()?.rms;
    let at = fit.gaussian.begins[search.block_of(place)] + part;
    Some((fit.gaussian.mean[at] / rms, fit.gaussian.sd(at) / rms))
}
