//! A part that is not the one of the mesh.

use super::{EffectSpec, Experiment, GripPoint, Group, PressFit, parameter, values};
use crate::OpticsState;

/// `cad_mismatch`: the real part's outlines (of teeth, rings, ends) lie outside those of its mesh, and its convex edges
/// are blunt. The image shows the real part; forces and friction stay those of the mesh, as all optics effects leave
/// them.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "cad_mismatch",
    group: Group::Optics,
    about: "part with wider outlines and blunter edges than its mesh",
    formula: "z' = max of min(z, z * N(0, blunting_mm)) within offset_mm, at one volume; z = gel surface",
    source: "reworked edges, other teeth and rings, 0.05 to 0.5 mm (Wucherer et al. 2023); dilation: Serra 1982",
    parameters: &[
        parameter("offset_mm", "mm", 0.0, (-0.6, 0.6))
            .about("how far outlines lie outside those of the mesh"),
        parameter("blunting_mm", "mm", 0.0, (0.0, 1.0))
            .about("standard deviation of the smoothing of convex edges"),
    ],
    optics: Some(optics),
    sizes: 2,
    plainly: "The part is not its drawing: outlines stand elsewhere, edges are blunter.",
    number_means: "blunting_mm = 0.1: convex edges are rounded over about 0.1 mm; offset_mm = 0.1: outlines lie 0.1 mm further out.",
    remedy: "Measure the part, and correct its mesh.",
    typical: &[("offset_mm", 0.1), ("blunting_mm", 0.1)],
    presses: Some(PressFit {
        main: "blunting_mm",
        start: |name, px_mm| if name == "offset_mm" { (0.0, px_mm) } else { (2.0 * px_mm, px_mm) },
        ..PressFit::DRAWN
    }),
    not_shown_by: &[Experiment::AnotherShape],
    ..EffectSpec::BARE
};

fn optics(parameters: &[f64], state: &mut OpticsState, _: &GripPoint<'_>) {
    let [offset_mm, blunting_mm] = values(parameters);
    state.part_offset_m += offset_mm * 1e-3;
    if blunting_mm != 0.0 {
        state.edge_blunting_m = libm::hypot(state.edge_blunting_m, blunting_mm * 1e-3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::grip;
    use crate::{Covariates, Jaw};

    #[test]
    fn both_jaws_and_all_forces_see_the_same_part() {
        let c = Covariates { pull_index: 300, time_s: 5e3, ..Default::default() };
        for jaw in Jaw::BOTH {
            for force_n in [5.0, 80.0] {
                let mut state = OpticsState::default();
                optics(&[-0.1, 0.3], &mut state, &GripPoint { jaw, ..grip(&c, force_n) });
                assert_eq!((state.part_offset_m, state.edge_blunting_m), (-0.1e-3, 0.3e-3));
            }
        }
    }
}
