//! Parameters of effects with their intervals, as they are reported.

use super::candidates::Candidate;
use super::fitting::Fitted;
use crate::diagnosis::ParameterEstimate;
use std::collections::BTreeMap;

/// Half width of a 90 % interval of a normal variable, and by how much more the formulas here differ from what acts: set on
/// the development split of the blind benchmark.
pub(super) const HALF90: f64 = 1.645 * 1.5;

/// Least standard deviation of a parameter, as a share of its distance from nothing: formulas are not that good.
const MIN_SD: f64 = 0.02;

/// Values of an effect in a fit, by name.
pub(super) fn parameters(fitted: &Fitted, candidate: &Candidate) -> BTreeMap<String, ParameterEstimate> {
    let part = candidate.part.as_ref().map(|p| p.0);
    let own = |e: &&super::model::ModelEffect| e.spec == candidate.spec && e.part == part;
    let Some(effect) = fitted.model.effects.iter().find(own) else {
        return BTreeMap::new();
    };
    let spec = candidate.spec;
    let each = |(k, p): (usize, &gripgen_twin::effects::ParameterSpec)| {
        let value = effect.values[k];
        let name = candidate.name_of(p.name);
        let half = fitted.names.iter().position(|n| *n == name).map_or(0.0, |at| {
            let sd = fitted.covariance[(at, at)].max(0.0).sqrt();
            HALF90 * sd.max(MIN_SD * (value - p.neutral).abs())
        });
        let low90 = (value - half).max(p.bounds.0.min(value));
        let high90 = (value + half).min(p.bounds.1.max(value));
        let estimate = ParameterEstimate::new(value, (low90, high90), p.unit);
        (p.name.to_string(), estimate)
    };
    spec.parameters.iter().enumerate().map(each).collect()
}
