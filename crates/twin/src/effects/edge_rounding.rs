//! A part whose edges are round where its mesh has sharp ones.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, PressNeeds, parameter, values};
use crate::OpticsState;

/// `edge_rounding`: the convex edges of the real part have a radius. The image shows the rounded part; forces and friction
/// stay those of the mesh, as all optics effects leave them.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "edge_rounding",
    group: Group::Optics,
    about: "radius of the part's convex edges",
    formula: "z' = opening of z by a ball of radius_mm; z = surface of the part before it is pressed in",
    source: "rims of printed parts lie 0.15 to 0.25 mm inside their mesh in GelSight images (Chen et al. 2022, its published presses); opening: Serra 1982",
    parameters: &[parameter("radius_mm", "mm", 0.0, (0.0, 1.0))
        .about("radius of the ball that just fits into each edge from inside")],
    optics: Some(optics),
    plainly: "The part's edges are rounder than in its drawing.",
    number_means: "radius_mm = 0.2: edges have a radius of 0.2 mm.",
    remedy: "Measure an edge under a microscope, and round it in the mesh.",
    typical: &[("radius_mm", 0.2)],
    presses: Some(PressFit {
        main: "radius_mm",
        start: |_, px_mm| (3.0 * px_mm, px_mm),
        needs: PressNeeds::Edges,
        ..PressFit::DRAWN
    }),
    not_shown_by: &[Experiment::AnotherShape],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [radius_mm] = values(parameters);
    // What a larger ball has opened a smaller one leaves as it is.
    state.edge_rounding_m = state.edge_rounding_m.max(radius_mm * 1e-3);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::optics_after;

    #[test]
    fn the_larger_radius_counts() {
        assert_eq!(optics_after(optics, &[&[0.1], &[0.3], &[0.2]]).edge_rounding_m, 0.3e-3);
    }
}
