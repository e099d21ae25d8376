//! Sizes at which effects that were not found would have been.

use super::candidates::press_effects;
use super::observed::Observed;
use super::predict::ActingEffect;
use super::score::{MATERIAL, SURE};
use super::search::Found;
use crate::Detectable;
use gripgen_twin::effects::EffectSpec;
use std::collections::BTreeMap;

/// For each effect that was not found the size that would have been: its signature stands as far above 0 as a
/// candidate has to, with a power of 0.8.
pub(super) fn would_have_seen(observed: &Observed<'_>, found: &Found) -> BTreeMap<String, Detectable> {
    let base = found.cost;
    let mut sizes = BTreeMap::new();
    for (spec, fit) in press_effects() {
        if found.model.acting.iter().any(|a| a.spec == spec) {
            continue;
        }
        let scatter = found.trials.iter().rev().find(|t| t.name == spec.id).map_or(0.0, |t| t.standard_error);
        let wanted = (MATERIAL * base).max(SURE * scatter) + 0.84 * scatter;
        let Some(j) = spec.position(fit.main) else { continue };
        if let Some(value) = size_of(observed, &found.model.acting, spec, j, wanted) {
            let parameter = spec.parameters[j].name.into();
            sizes.insert(spec.id.to_string(), Detectable { parameter, value, power: 0.8 });
        }
    }
    sizes
}

/// The value of a parameter whose signature has a mean square of `wanted`.
fn size_of(
    observed: &Observed<'_>,
    named: &[ActingEffect],
    spec: &'static EffectSpec,
    j: usize,
    wanted: f64,
) -> Option<f64> {
    let p = &spec.parameters[j];
    let room = p.bounds.1 - p.neutral;
    let some: Vec<usize> = (0..observed.count()).step_by(observed.count().div_ceil(6).max(1)).collect();
    let square = |size: f64| -> f64 {
        let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
        values[j] = p.neutral + size;
        let sums = observed.for_each(some.len(), |k| {
            let i = some[k];
            let mut acting = named.to_vec();
            let plain = observed.levels(i, &acting);
            acting.push(ActingEffect { spec, values: values.clone(), fitted: 0 });
            let levels = observed.levels(i, &acting);
            let weights = observed.pixel_weights(i);
            let one = |((a, b), w): ((&[f32; 3], &[f32; 3]), f64)| {
                w * (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()
            };
            levels.iter().zip(&plain).zip(weights).map(one).sum::<f64>()
        });
        sums.iter().sum::<f64>() / some.len() as f64
    };
    let mut size = 0.05 * room;
    for _ in 0..5 {
        let now = square(size);
        if now <= 0.0 {
            return None;
        }
        size = (size * libm::pow(wanted / now, 0.4)).clamp(1e-4 * room, room);
    }
    Some(p.neutral + size)
}
