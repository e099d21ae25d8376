//! The effects of the library that presses can show, as candidates.

use crate::FreeParameter;
use gripgen_twin::effects::{EffectSpec, LIBRARY, PressFit, PressNeeds};

/// Effects that presses can show, with how they are fitted.
pub(super) fn press_effects() -> impl Iterator<Item = (&'static EffectSpec, PressFit)> {
    LIBRARY.iter().filter_map(|&spec| Some((spec, spec.presses?)))
}

/// Whether an effect changes the picture of the contact, which has to be drawn, and not only light and camera.
pub(super) fn is_drawn(spec: &EffectSpec) -> bool {
    spec.presses.is_none_or(|fit| fit.drawn)
}

/// Position of the parameter whose place is found by trying, not by slopes, if there is one.
pub(super) fn tried(spec: &EffectSpec) -> Option<usize> {
    spec.position(spec.presses?.tried?)
}

/// Positions of the parameters that are fitted.
pub(super) fn fitted(spec: &EffectSpec) -> Vec<usize> {
    let scatters = spec.presses.map_or(0, |fit| fit.scatters);
    (0..spec.parameters.len() - scatters).filter(|&j| tried(spec) != Some(j)).collect()
}

/// A fitted parameter with its start; `px_mm`: side of a pixel on the gel.
pub(super) fn free_parameter(spec: &EffectSpec, j: usize, px_mm: f64) -> FreeParameter {
    let p = &spec.parameters[j];
    let (start, scale) = spec.presses.map_or((p.neutral, 1.0), |fit| (fit.start)(p.name, px_mm));
    FreeParameter { name: p.name.into(), start, bounds: p.bounds, scale }
}

/// The candidates that are fitted, of those that presses can speak of.
pub(super) fn candidates(known: &[PressNeeds]) -> Vec<&'static EffectSpec> {
    let speaks = |fit: &PressFit| fit.needs == PressNeeds::Nothing || known.contains(&fit.needs);
    press_effects().filter(|(_, fit)| speaks(fit)).map(|(spec, _)| spec).collect()
}
