//! From the numbers of a twin to those of the engine.

use gripgen_twin::frames::Pose;
use nalgebra::Vector3;
use rapier3d_f64::prelude as rapier;
use rapier3d_f64::prelude::MassProperties;

/// Mass properties of a compact body of steel density. The carriage locks rotations, so only the order matters.
pub(crate) fn compact(mass_kg: f64) -> MassProperties {
    MassProperties::new(rapier::Vector::ZERO, mass_kg, rapier::Vector::splat(mass_kg * 5e-3))
}

/// A vector of the engine.
pub(crate) fn vector(v: [f64; 3]) -> rapier::Vector {
    rapier::Vector::new(v[0], v[1], v[2])
}

/// A pose of the engine.
pub(crate) fn rapier_pose(pose: &Pose) -> rapier::Pose {
    let t: Vector3<f64> = pose.translation.vector;
    let q = pose.rotation.quaternion();
    rapier::Pose::from_parts(
        rapier::Vector::new(t.x, t.y, t.z),
        rapier::Rotation::from_xyzw(q.i, q.j, q.k, q.w),
    )
}
