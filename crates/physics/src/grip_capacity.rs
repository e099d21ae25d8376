//! How much the jaws hold: the friction law on the cells of the contact, and what their rotation takes of it.

use crate::scenario::{grip_point, pull_direction};
use crate::{
    FrictionCell, JawFriction, LimitCell, TwistCell, compliant_twist_capacity_n, free_twist_capacity_n,
};
use gripgen_twin::config::Twist;
use gripgen_twin::frames::world_from_gel;
use gripgen_twin::{ContactPatch, FrictionError, GripFriction, Jaw, PerJaw, Scenario, Twin, cell_friction};
use nalgebra::{Point3, Vector3};

/// The friction laws of a twin on the patches of a grip.
pub struct PatchFriction {
    cell_mu: PerJaw<Vec<f64>>,
    /// The law of each jaw on its whole patch.
    pub law: PerJaw<GripFriction>,
}

impl PatchFriction {
    /// The laws on the cells of both patches.
    ///
    /// # Errors
    ///
    /// A law that refuses this grip.
    pub fn new(
        twin: &Twin,
        scenario: &Scenario,
        patches: &PerJaw<&ContactPatch>,
    ) -> Result<Self, FrictionError> {
        let part = &twin.parts[&scenario.part];
        let laws = PerJaw::try_from_fn(|jaw| {
            let at = grip_point(scenario, jaw, patches[jaw].area_m2());
            let (mut cells, mut law) = cell_friction(twin, &scenario.part, part, &at, patches[jaw])?;
            let (slopes, share) = (patches[jaw].slopes, twin.gel[jaw].interlock);
            if share > 0.0 {
                cells.iter_mut().for_each(|mu| *mu = slopes.coefficient(*mu, share));
                law.mu = slopes.coefficient(law.mu, share);
            }
            Ok((cells, law))
        })?;
        Ok(Self { law: laws.map(|_, (_, law)| *law), cell_mu: laws.map(|_, (cells, _)| cells.clone()) })
    }

    /// What the jaws hold when every coefficient is multiplied by `factor`.
    pub fn held(
        &self,
        twin: &Twin,
        scenario: &Scenario,
        patches: &PerJaw<&ContactPatch>,
        factor: f64,
    ) -> PerJaw<JawFriction> {
        let mu = self.cell_mu.map(|_, cells| cells.iter().map(|mu| mu * factor).collect());
        hold(twin, scenario, patches, &mu, self.law.left.kinetic_ratio)
    }
}

/// The friction of both jaws. `mu` has a coefficient for each cell of each patch.
///
/// The pull acts through the grip centre, between the middles of the gels, as the robot's program pulls its tool centre
/// point. Where the contact lies beside that line it also turns the grip about the jaw axis. A twist that is held
/// (`twist = "stiff"`) makes every cell slide along the pull: the jaws hold the sum over their cells. One that is not
/// (`"free"`) leaves what the limit surface of both patches says, and all cells are scaled to it; a spring
/// (`"compliant"`) leaves what is reached within the way at which the pull stops.
fn hold(
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
        JawFriction {
            cells: cells.collect(),
            kinetic_ratio,
            kinetic_fall_s,
            shear_by_area: twin.gel[jaw].shear_by_area,
        }
    });
    let straight: f64 = friction.iter().map(|(_, f)| f.limit_n()).sum();
    if twin.robot.twist == Twist::Stiff || straight == 0.0 {
        return friction;
    }
    let cells = cells(twin, scenario, patches, &friction);
    let held_n = match (twin.robot.twist, twin.robot.twist_stiffness_n_m_per_rad) {
        (Twist::Compliant, Some(stiffness)) => {
            compliant_twist_capacity_n(&cells, stiffness, scenario.pull.stop_m, kinetic_ratio)
        }
        _ => {
            let limits = cells.iter().map(|c| LimitCell {
                across_m: c.across_m,
                along_m: c.along_m,
                limit_n: c.limit_n,
            });
            free_twist_capacity_n(&limits.collect::<Vec<_>>(), 0.0)
        }
    };
    if held_n < straight {
        for jaw in Jaw::BOTH {
            friction[jaw].cells.iter_mut().for_each(|cell| cell.limit_n *= held_n / straight);
        }
    }
    friction
}

/// The cells of both jaws in the plane of the gels, seen from the line of the pull.
fn cells(
    twin: &Twin,
    scenario: &Scenario,
    patches: &PerJaw<&ContactPatch>,
    friction: &PerJaw<JawFriction>,
) -> Vec<TwistCell> {
    let along = Vector3::from(pull_direction(scenario));
    // The jaws turn about y, so across is what is left in the plane of the gels.
    let across = Vector3::y().cross(&along);
    let mut cells = Vec::new();
    for (jaw, patch) in patches.iter() {
        let world_from_gel = world_from_gel(jaw, 0.0);
        let shares = friction[jaw].stiffness_shares();
        for ((cell, held), share) in patch.cells.iter().zip(&friction[jaw].cells).zip(shares) {
            let at = (world_from_gel * Point3::new(cell.x_m, cell.y_m, 0.0)).coords;
            cells.push(TwistCell {
                across_m: at.dot(&across),
                along_m: at.dot(&along),
                limit_n: held.limit_n,
                stiffness_n_per_m: twin.gel[jaw].shear_stiffness_n_per_m * share,
            });
        }
    }
    cells
}
