//! Contact forces. The only place where impulses become newtons.

use crate::world::{SOLVER_ITERATIONS, World};
use rapier3d_f64::prelude::*;

/// What the contacts of one collider carry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ContactForce {
    /// Sum of the magnitudes of all normal forces.
    pub(crate) normal_n: f64,
    /// Vector sum of the friction forces, in `world`, up to sign.
    pub(crate) friction_n: Vector,
    /// Deepest penetration, positive.
    pub(crate) penetration_m: f64,
}

/// Sums the contact forces between two colliders over the last step.
///
/// Three traps of Rapier are avoided here: only points that the solver worked on count (`points` keeps impulses of
/// points long gone), clustered manifolds are read where there are clusters, and with one friction constraint per
/// manifold the friction impulse stands on every point but acts once. Normal impulses are those of the whole step,
/// friction impulses those of the last solver iteration.
pub(crate) fn contact_force(world: &World, pad: ColliderHandle, part: ColliderHandle) -> ContactForce {
    let step_s = world.step_s();
    let mut sum = ContactForce::default();
    let Some(pair) = world.narrow_phase.contact_pair(pad, part) else { return sum };
    for manifold in pair.solver_manifolds() {
        let mut friction = Vector::ZERO;
        for contact in &manifold.data.solver_contacts {
            let point = &manifold.points[(contact.contact_id[0] & !NEW_CONTACT_BIT) as usize];
            sum.normal_n += point.data.impulse / step_s;
            sum.penetration_m = sum.penetration_m.max(-point.dist);
            friction = point.data.warmstart_tangent_world;
        }
        sum.friction_n += friction * (SOLVER_ITERATIONS as f64 / step_s);
    }
    sum
}
