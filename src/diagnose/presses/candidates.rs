//! The optics effects of the library as candidates: where their fits start and what a small change of them is.

use gripgen_identify::FreeParameter;
use gripgen_tactile::presses::PressScene;
use gripgen_twin::effects::{EffectSpec, LIBRARY};

/// The parameter whose place is found by trying, not by slopes.
pub(super) const STEP_PARAMETER: &str = "at_pull_index";

/// Ids of the optics effects.
pub(super) fn optics_effects() -> impl Iterator<Item = &'static EffectSpec> {
    LIBRARY.iter().copied().filter(|spec| spec.optics.is_some())
}

/// Whether an effect changes the picture of the contact, which has to be drawn, and not only light and camera.
pub(super) fn is_drawn(spec: &EffectSpec) -> bool {
    !matches!(spec.id, "light_drift" | "background_change" | "exposure" | "rest_offset")
}

/// Positions of the parameters that are fitted.
pub(super) fn fitted(spec: &EffectSpec) -> Vec<usize> {
    (0..spec.parameters.len()).filter(|&j| spec.parameters[j].name != STEP_PARAMETER).collect()
}

/// A fitted parameter with its start. Where the derivative vanishes at the neutral value (the width of a blur, the
/// strength of a shadow) the fit starts beside it.
pub(super) fn free_parameter(spec: &EffectSpec, j: usize, scene: &PressScene) -> FreeParameter {
    let p = &spec.parameters[j];
    let px_mm = scene.sensor().grid.metres_per_px * 1e3;
    let (start, scale) = match (spec.id, p.name) {
        ("light_drift", _) => (0.0, 0.05),
        ("background_change" | "rest_offset", _) => (0.0, 2.0),
        ("exposure", _) => (1.0, 0.05),
        ("misregistration", "shift_x_mm" | "shift_y_mm") => (0.0, px_mm),
        ("misregistration", "rotation_deg") => (0.0, 1.0),
        ("misregistration", _) => (p.neutral, 0.02),
        ("defocus", _) => (1.5 * px_mm, px_mm),
        ("gel_kernel", _) => (1.0, 0.1),
        ("cad_mismatch", "offset_mm") => (0.0, px_mm),
        ("cad_mismatch", _) => (2.0 * px_mm, px_mm),
        ("cast_shadow", "strength") => (0.03, 0.05),
        ("cast_shadow", _) => (20.0, 5.0),
        ("gel_dome", _) => (0.0, 0.3),
        _ => (p.neutral, 0.1 * (p.bounds.1 - p.bounds.0)),
    };
    FreeParameter { name: p.name.into(), start, bounds: p.bounds, scale }
}

/// The parameter that says how large an effect is, of those with several.
pub(super) fn main_parameter(spec: &EffectSpec) -> usize {
    match spec.id {
        "light_drift" | "rest_offset" => 1,
        "background_change" => 5,
        "cad_mismatch" => 1,
        _ => 0,
    }
}
