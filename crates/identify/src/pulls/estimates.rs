//! Parameters of effects and of the baseline with their intervals, as they are reported.

use super::candidates::Candidate;
use super::context::Context;
use super::fitting::Fitted;
use super::heldout::scatter;
use crate::diagnosis::ParameterEstimate;
use gripgen_twin::predict::PullModel;
use std::collections::BTreeMap;

/// Half width of a 90 % interval of a normal variable, and by how much more the formulas here differ from what acts: set on
/// the development split of the blind benchmark.
pub(super) const HALF90: f64 = 1.645 * 1.5;

/// Least standard deviation of a parameter, as a share of its distance from nothing: formulas are not that good.
const MIN_SD: f64 = 0.02;

/// How far a value is from nothing. Where nothing is a limit that nobody reaches, the value itself is the measure: 2 % of a million newtons
/// are no doubt about 20.
fn from_nothing(value: f64, neutral: f64) -> f64 {
    let away = (value - neutral).abs();
    if value != 0.0 && neutral.abs() > FAR * value.abs() { value.abs() } else { away }
}

/// A neutral value that is so many times the value is a limit that nobody reaches.
const FAR: f64 = 1e3;

/// Values of an effect in a fit, by name.
pub(super) fn parameters(fitted: &Fitted, candidate: &Candidate) -> BTreeMap<String, ParameterEstimate> {
    let part = candidate.part.as_ref().map(|p| p.0);
    let own = |e: &&gripgen_twin::predict::ModelEffect| e.spec == candidate.spec && e.part == part;
    let Some(effect) = fitted.model.effects.iter().find(own) else {
        return BTreeMap::new();
    };
    let spec = candidate.spec;
    let fitted_as =
        fitted.terms.effects.iter().map(|(c, _)| c).find(|c| c.spec == spec && c.part == candidate.part);
    let end = fitted_as.and_then(|c| c.end);
    let each = |(k, p): (usize, &gripgen_twin::effects::ParameterSpec)| {
        let value = effect.values[k];
        let name = candidate.name_of(p.name);
        let half = fitted.names.iter().position(|n| *n == name).map_or(0.0, |at| {
            let sd = fitted.covariance[(at, at)].max(0.0).sqrt();
            HALF90 * sd.max(MIN_SD * from_nothing(value, p.neutral))
        });
        let mut low90 = (value - half).max(p.bounds.0.min(value));
        let mut high90 = (value + half).min(p.bounds.1.max(value));
        if let Some(end) = end.filter(|_| k == candidate.size()) {
            if value > p.neutral {
                low90 = low90.max(end.min(value));
            } else {
                high90 = high90.min(end.max(value));
            }
        }
        let estimate = ParameterEstimate::new(value, (low90, high90), p.unit);
        (p.name.to_string(), estimate)
    };
    spec.parameters.iter().enumerate().map(each).collect()
}

/// The baseline of a fit.
pub(super) fn baseline(fitted: &Fitted, context: &Context<'_>) -> BTreeMap<String, ParameterEstimate> {
    let mut values = plain_baseline(&fitted.model, context);
    let unit = |name: &str| if name.ends_with("_s") { "s" } else { "1" };
    for (k, name) in fitted.names.iter().enumerate() {
        if !(name.starts_with("parts.") || name.starts_with("robot.") || name == "kinetic_ratio") {
            continue;
        }
        let (value, half) = (fitted.values[k], HALF90 * fitted.covariance[(k, k)].max(0.0).sqrt());
        // None of these can be negative, and an interval holds its value.
        let low = (value - half).max(value.min(0.0));
        let estimate = ParameterEstimate::new(value, (low, value + half), unit(name));
        values.insert(name.clone(), estimate);
    }
    let scattered = scatter(&fitted.model, fitted.likelihood.scale);
    values.insert("scatter".into(), ParameterEstimate::new(scattered, (scattered, scattered), "1"));
    values
}

/// What a model says of the rig, without intervals but that of the noise.
pub(super) fn plain_baseline(m: &PullModel, context: &Context<'_>) -> BTreeMap<String, ParameterEstimate> {
    let mut values = BTreeMap::new();
    let plain = |value: f64, unit: &str| ParameterEstimate::new(value, (value, value), unit);
    values.insert("robot.lag_s".into(), plain(m.lag_s, "s"));
    values.insert("robot.dead_time_s".into(), plain(m.dead_time_s, "s"));
    let noise90_n = context.noise90_n.unwrap_or((m.noise_n, m.noise_n));
    values.insert("wrist.noise_n".into(), ParameterEstimate::new(m.noise_n, noise90_n, "N"));
    if !context.observations.is_empty() {
        let each = m.stiffness_n_per_m * 0.5e-3;
        values.insert("gel.left.shear_stiffness_n_per_mm".into(), plain(each, "N/mm"));
    }
    if !context.observations.is_empty() || m.damping_n_s_per_m != context.given_damping_n_s_per_m {
        values.insert("robot.damping_n_s_per_m".into(), plain(m.damping_n_s_per_m, "N s/m"));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_that_nobody_reaches_is_no_measure_of_doubt() {
        assert_eq!(from_nothing(20.0, 1e6), 20.0);
        assert_eq!(from_nothing(1.05, 1.0), 1.05_f64 - 1.0);
        assert_eq!(from_nothing(0.3, 0.0), 0.3);
        assert_eq!(from_nothing(0.0, 1.0), 1.0);
    }
}
