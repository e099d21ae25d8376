//! Where the interval of an effect's size ends towards nothing, by the likelihood itself.
//!
//! Around a fit the likelihood is normal as far as slopes tell. Depth and pull count of a wear that has hardly bent yet say the same
//! product: their slopes leave a depth of nothing open, which the labels exclude. There the size is held at values towards nothing, all
//! else is fitted again, and the interval ends where the likelihood has fallen as far as it does at the ends of any other (profile
//! likelihood, Venzon and Moolgavkar 1988). Only where the effect's own other parameters leave its size open: what is open because
//! another effect says the same is a matter of that competition.

use super::candidates::Candidate;
use super::context::Context;
use super::estimates::HALF90;
use super::fitting::Fitted;
use super::terms::Terms;
use gripgen_twin::effects::EffectSpec;
use nalgebra::{DMatrix, DVector};

/// What stands for nothing: so much of the size.
const NOTHING: f64 = 0.02;

/// Halvings of the interval.
const HALVINGS: usize = 6;

/// The fit with the end of the interval of the size of `spec`, where that end is not nothing; `None` where nothing is inside.
pub(super) fn ended(
    context: &Context<'_>,
    fitted: &Fitted,
    spec: &'static EffectSpec,
    rows: &[usize],
) -> Option<Fitted> {
    let place = fitted.terms.effects.iter().position(|(c, _)| c.spec == spec && c.part.is_none())?;
    let (candidate, values) = &fitted.terms.effects[place];
    let size = candidate.size();
    let (value, neutral) = (values[size], spec.parameters[size].neutral);
    if sd_with_own_held(fitted, candidate)? * HALF90 >= (value - neutral).abs() {
        return None;
    }
    let most = likely(fitted) - 0.5 * HALF90 * HALF90;
    let excluded = |x: f64| -> Option<bool> {
        let others = candidate.free.iter().copied().filter(|f| f.0 != size).collect();
        let held = Candidate { free: others, ..candidate.clone() };
        let starts = std::iter::once(values).chain(&candidate.starts);
        let fits = starts.filter_map(|start| {
            let mut start = start.clone();
            start[size] = x;
            let mut terms: Terms = fitted.terms.clone();
            terms.effects[place] = (held.clone(), start);
            context.fit(&fitted.model, &terms, rows)
        });
        let best = fits.map(|f| likely(&f)).fold(f64::NEG_INFINITY, f64::max);
        best.is_finite().then_some(best < most)
    };
    let mut out = neutral + NOTHING * (value - neutral);
    if !excluded(out)? {
        return None;
    }
    let mut inside = value;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (out + inside);
        if excluded(middle)? {
            out = middle;
        } else {
            inside = middle;
        }
    }
    let mut found = fitted.clone();
    found.terms.effects[place].0.end = Some(out);
    Some(found)
}

/// Standard deviation of an effect's size with its own other parameters held where they are; `None` where it has no others.
fn sd_with_own_held(fitted: &Fitted, candidate: &Candidate) -> Option<f64> {
    let at = |k: usize| {
        let name = candidate.name_of(candidate.spec.parameters[k].name);
        fitted.names.iter().position(|n| *n == name)
    };
    let size = at(candidate.size())?;
    let free = candidate.free.iter().map(|f| f.0).filter(|&k| k != candidate.size());
    let others: Vec<usize> = free.filter_map(at).collect();
    if others.is_empty() {
        return None;
    }
    let all = &fitted.covariance;
    let together = DVector::from_iterator(others.len(), others.iter().map(|&o| all[(size, o)]));
    let of_others = DMatrix::from_fn(others.len(), others.len(), |i, k| all[(others[i], others[k])]);
    let told = together.dot(&of_others.cholesky()?.solve(&together));
    Some((all[(size, size)] - told).max(0.0).sqrt())
}

fn likely(fitted: &Fitted) -> f64 {
    fitted.likelihood.log - fitted.trace_cost
}
