//! Contact forces. The only place where impulses become newtons.

use crate::world::{SOLVER_ITERATIONS, World};
use rapier3d_f64::prelude::*;

/// What the contacts of one collider carry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ContactForce {
    /// Sum of the magnitudes of all normal forces.
    pub(crate) normal_n: f64,
    /// Vector sum of the friction forces on the first collider, in `world`.
    pub(crate) friction_n: Vector,
    /// Deepest penetration, positive.
    pub(crate) penetration_m: f64,
}

/// Sums the contact forces between two colliders over the last step.
///
/// Four traps of Rapier are avoided here. Only points that the solver worked on count: `points` keeps impulses of
/// points long gone. Clustered manifolds are read where there are clusters. With one friction constraint per
/// manifold the friction impulse stands on every point but acts once; on links of a multibody, whose friction is per
/// point whatever the friction model says, every point has its own. Normal impulses are those of the whole step,
/// friction impulses those of the last solver iteration.
pub(crate) fn contact_force(world: &World, pad: ColliderHandle, part: ColliderHandle) -> ContactForce {
    let step_s = world.step_s();
    let mut sum = ContactForce::default();
    let Some(pair) = world.narrow_phase.contact_pair(pad, part) else { return sum };
    let per_point = is_link(world, pad) || is_link(world, part);
    for manifold in pair.solver_manifolds() {
        let mut friction = Vector::ZERO;
        for contact in &manifold.data.solver_contacts {
            let point = &manifold.points[(contact.contact_id[0] & !NEW_CONTACT_BIT) as usize];
            sum.normal_n += point.data.impulse / step_s;
            sum.penetration_m = sum.penetration_m.max(-point.dist);
            let here = point.data.warmstart_tangent_world;
            friction = if per_point { friction + here } else { here };
        }
        // The engine's vector acts on the first body of the pair.
        let sign = if pair.collider1 == pad { 1.0 } else { -1.0 };
        sum.friction_n += friction * (sign * SOLVER_ITERATIONS as f64 / step_s);
    }
    sum
}

/// Whether a collider belongs to a multibody.
fn is_link(world: &World, collider: ColliderHandle) -> bool {
    let body = world.colliders[collider].parent();
    body.is_some_and(|b| world.multibodies.rigid_body_link(b).is_some())
}
