//! Frames and rigid poses.
//!
//! All frames are right-handed, all lengths are metres. A pose is named `target_from_source`: it takes
//! coordinates in `source` to coordinates in `target`, so neighbouring names match when a product is read
//! (`gel_from_part = gel_from_world * world_from_part`).
//!
//! | frame | origin | axes |
//! |---|---|---|
//! | `world` | grip centre at the start of the pull | +z up (the default pull), +y along the jaw axis |
//! | `base` | robot base | parallel to `world` |
//! | `tool` | flange | parallel to `world` at the start of the pull |
//! | `jaw` | centre of a jaw's pad surface | parallel to `world`; the left jaw closes along -y, the right jaw along +y |
//! | `gel` | centre of the unloaded gel surface | +z out of the gel towards the part, +x image right, +y image down |
//! | `part` | grip centre of the selected grip | +x long axis, +y jaw axis, +z up at a grip angle of 0 |
//! | `image` | corner of the top left pixel | +x right (columns), +y down (rows), in pixels |
//!
//! A tactile image is what the camera behind the gel sees: up is +z of `world` for both jaws, right is -x of
//! `world` for the left jaw and +x of `world` for the right jaw (the mirror rule of `docs/model.md`).

use crate::Jaw;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A rigid motion, `target_from_source`, in metres.
pub type Pose = Isometry3<f64>;

/// Rotation by `angle_rad` about the x, y or z axis (0, 1, 2).
///
/// Uses `libm`, so that the same angle gives the same bits on every host.
pub fn rotation_about_axis(axis: usize, angle_rad: f64) -> Rotation3<f64> {
    let (s, c) = (libm::sin(angle_rad), libm::cos(angle_rad));
    let m = match axis {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
        1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
        _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
    };
    Rotation3::from_matrix_unchecked(m)
}

/// Rotation from three angles about the fixed x, then y, then z axis: `R_z R_y R_x`.
pub fn rotation_from_fixed_xyz(angles_rad: [f64; 3]) -> Rotation3<f64> {
    let [x, y, z] = angles_rad;
    rotation_about_axis(2, z) * rotation_about_axis(1, y) * rotation_about_axis(0, x)
}

/// A pose from a rotation and the position of the source origin in the target frame.
pub fn pose(rotation: &Rotation3<f64>, position_m: Vector3<f64>) -> Pose {
    Pose::from_parts(Translation3::from(position_m), quaternion_from_rotation(rotation))
}

/// `base_from_tool` of a grip at a lever along the part's long axis and an angle about the jaws' axis, from that in its middle
/// at an angle of 0. The tool's x axis lies along the part, its y axis along the jaws.
pub fn tool_at(base_from_middle: &Pose, offset_m: f64, angle_rad: f64) -> Pose {
    base_from_middle * pose(&rotation_about_axis(1, angle_rad), Vector3::new(offset_m, 0.0, 0.0))
}

/// The unit quaternion of a rotation, by the largest-component method (Shepperd 1978), square roots only.
fn quaternion_from_rotation(rotation: &Rotation3<f64>) -> UnitQuaternion<f64> {
    let m = rotation.matrix();
    let candidates = [
        1.0 + m[(0, 0)] + m[(1, 1)] + m[(2, 2)],
        1.0 + m[(0, 0)] - m[(1, 1)] - m[(2, 2)],
        1.0 - m[(0, 0)] + m[(1, 1)] - m[(2, 2)],
        1.0 - m[(0, 0)] - m[(1, 1)] + m[(2, 2)],
    ];
    let mut best = 0;
    for i in 1..4 {
        if candidates[i] > candidates[best] {
            best = i;
        }
    }
    let s = 2.0 * candidates[best].sqrt();
    let (w, i, j, k) = match best {
        0 => (s / 4.0, (m[(2, 1)] - m[(1, 2)]) / s, (m[(0, 2)] - m[(2, 0)]) / s, (m[(1, 0)] - m[(0, 1)]) / s),
        1 => ((m[(2, 1)] - m[(1, 2)]) / s, s / 4.0, (m[(0, 1)] + m[(1, 0)]) / s, (m[(0, 2)] + m[(2, 0)]) / s),
        2 => ((m[(0, 2)] - m[(2, 0)]) / s, (m[(0, 1)] + m[(1, 0)]) / s, s / 4.0, (m[(1, 2)] + m[(2, 1)]) / s),
        _ => ((m[(1, 0)] - m[(0, 1)]) / s, (m[(0, 2)] + m[(2, 0)]) / s, (m[(1, 2)] + m[(2, 1)]) / s, s / 4.0),
    };
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k))
}

/// Pose of a jaw's gel frame in `world`, its surface `distance_m` from the grip centre along the jaw axis.
pub fn world_from_gel(jaw: Jaw, distance_m: f64) -> Pose {
    // Columns: image right, image down, out of the gel.
    let m = match jaw {
        Jaw::Left => Matrix3::new(-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.0),
        Jaw::Right => Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
    };
    pose(&Rotation3::from_matrix_unchecked(m), Vector3::new(0.0, jaw.side() * distance_m, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn gel_axes_follow_the_mirror_rule() {
        for (jaw, right) in [(Jaw::Left, -Vector3::x()), (Jaw::Right, Vector3::x())] {
            let p = world_from_gel(jaw, 0.01);
            assert!((p * Vector3::x() - right).norm() < 1e-15, "image right of {jaw}");
            assert!((p * Vector3::y() + Vector3::z()).norm() < 1e-15, "image down of {jaw}");
            let towards_part = p * Point3::new(0.0, 0.0, 0.01);
            assert!(towards_part.coords.norm() < 1e-15, "out of the {jaw} gel is towards the part");
        }
    }

    #[test]
    fn rotations_are_right_handed_and_keep_their_angles() {
        let quarter = std::f64::consts::FRAC_PI_2;
        for (axis, from, to) in [
            (0, Vector3::y(), Vector3::z()),
            (1, Vector3::z(), Vector3::x()),
            (2, Vector3::x(), Vector3::y()),
        ] {
            assert!((rotation_about_axis(axis, quarter) * from - to).norm() < 1e-15);
        }
        for angles in [[0.3, -2.0, 1.0], [3.1, 0.0, 0.0], [0.0, 3.1, 0.1], [0.1, 0.0, 3.1]] {
            let r = rotation_from_fixed_xyz(angles);
            let q = pose(&r, Vector3::zeros());
            assert!((q.rotation.to_rotation_matrix().matrix() - r.matrix()).norm() < 1e-14);
        }
    }
}
