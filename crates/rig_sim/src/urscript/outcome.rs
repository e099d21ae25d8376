//! What functions of the language give.

use super::value::Value;
use gripgen_twin::frames::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// What a function gives, or what its thread waits for.
pub(super) enum Outcome {
    Value(Value),
    /// The next control step.
    Sync,
    /// So many seconds.
    Sleep(f64),
    /// The end of a motion.
    Motion,
}

/// Numbers as a list.
pub(super) fn list(numbers: &[f64]) -> Value {
    Value::List(Arc::new(numbers.iter().map(|x| Value::Float(*x)).collect()))
}

/// A pose as a rigid motion.
pub(super) fn pose(value: &Value) -> Result<Pose, String> {
    let [x, y, z, rx, ry, rz] = value.pose()?;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
    Ok(Pose::from_parts(Translation3::new(x, y, z), turn))
}

/// A rigid motion as a pose.
pub(super) fn numbers(pose: &Pose) -> Value {
    let (t, r) = (pose.translation.vector, pose.rotation.scaled_axis());
    Value::Pose([t.x, t.y, t.z, r.x, r.y, r.z])
}
