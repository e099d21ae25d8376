//! How much the jaws hold: the friction law on the cells of the contact, and the limit surface.

use crate::gripped::{pull_direction, world_from_part};
use gripgen_physics::{FrictionCell, JawFriction, LimitCell, free_twist_capacity_n};
use gripgen_twin::config::Twist;
use gripgen_twin::frames::world_from_gel;
use gripgen_twin::{ContactPatch, PerJaw, Scenario, Twin};
use nalgebra::{Point3, Vector3};

/// The friction of both jaws. `mu` has a coefficient for each cell of each patch.
///
/// An arm that holds the grip's rotation (`twist = "stiff"`) makes every cell slide along the pull: the jaws hold the
/// sum over their cells. One that does not (`"free"`) lets the grip turn about the jaw axis; the jaws then hold what
/// the limit surface of both patches says for the pull line at `grip_offset_mm`, and all cells are scaled to it.
pub(crate) fn hold(
    twin: &Twin,
    scenario: &Scenario,
    patches: &PerJaw<&ContactPatch>,
    mu: &PerJaw<Vec<f64>>,
    kinetic_ratio: f64,
) -> PerJaw<JawFriction> {
    let mut friction = patches.map(|jaw, patch| {
        let cells = patch.cells.iter().zip(&mu[jaw]);
        let cells = cells.map(|(c, mu)| FrictionCell { limit_n: mu * c.force_n, area_m2: c.area_m2 });
        let kinetic_fall_s = twin.parts[&scenario.part].kinetic_fall_s;
        JawFriction { cells: cells.collect(), kinetic_ratio, kinetic_fall_s }
    });
    if twin.robot.twist == Twist::Free {
        let share = free_share(scenario, patches, &friction);
        for jaw in gripgen_twin::Jaw::BOTH {
            friction[jaw].cells.iter_mut().for_each(|cell| cell.limit_n *= share);
        }
    }
    friction
}

/// What the jaws hold with a free twist, as a share of what they hold with a stiff one.
fn free_share(scenario: &Scenario, patches: &PerJaw<&ContactPatch>, friction: &PerJaw<JawFriction>) -> f64 {
    let along = Vector3::from(pull_direction(scenario));
    // The jaws turn about y, so across is what is left in the plane of the gels.
    let across = Vector3::y().cross(&along);
    let mut cells = Vec::new();
    for (jaw, patch) in patches.iter() {
        let world_from_gel = world_from_gel(jaw, 0.0);
        for (cell, held) in patch.cells.iter().zip(&friction[jaw].cells) {
            let at = (world_from_gel * Point3::new(cell.x_m, cell.y_m, 0.0)).coords;
            cells.push(LimitCell {
                across_m: at.dot(&across),
                along_m: at.dot(&along),
                limit_n: held.limit_n,
            });
        }
    }
    // The pull line passes through the origin of the part, which the offset moved off the grip centre.
    let lever_m = world_from_part(scenario).translation.vector.dot(&across);
    let straight: f64 = cells.iter().map(|c| c.limit_n).sum();
    if straight == 0.0 { 1.0 } else { free_twist_capacity_n(&cells, lever_m) / straight }
}
