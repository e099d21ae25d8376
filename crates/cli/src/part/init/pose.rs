//! The pose of a grip: as rotations and points, and as the angles that a twin has.

use gripgen_twin::TriMesh;
use gripgen_twin::frames::{Pose, pose, rotation_from_fixed_xyz};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

/// A jaw axis this close to an axis of the mesh is meant to be that axis.
const SNAP_RAD: f64 = 0.05;

/// Origin and angles of a grip as they stand in a twin, rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GripAt {
    pub(super) origin_mm: [f64; 3],
    pub(super) orientation_deg: [f64; 3],
}

impl GripAt {
    pub(super) fn new(rotation: &Rotation3<f64>, origin: Point3<f64>) -> Self {
        Self {
            origin_mm: [0, 1, 2].map(|i| hundredths(origin[i] * 1e3)),
            orientation_deg: fixed_xyz_deg(rotation).map(hundredths),
        }
    }

    pub(super) fn part_from_mesh(&self) -> Pose {
        let rotation = rotation_from_fixed_xyz(self.orientation_deg.map(f64::to_radians));
        let origin = Vector3::from(self.origin_mm.map(|x| x * 1e-3));
        pose(&rotation, -(rotation * origin))
    }
}

/// An axis of the mesh, if the direction is nearly one. The sign does not matter to a gripper.
pub(super) fn snapped(direction: Vector3<f64>) -> Vector3<f64> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    axes.into_iter().find(|a| a.dot(&direction).abs() > libm::cos(SNAP_RAD)).unwrap_or(direction)
}

/// How the vertices of a mesh are spread about their mean.
pub(super) fn spread_of(mesh: &TriMesh) -> Matrix3<f64> {
    let n = mesh.vertices_m().len() as f64;
    let mean = mesh.vertices_m().iter().fold(Vector3::zeros(), |s, v| s + v.coords) / n;
    mesh.vertices_m().iter().fold(Matrix3::zeros(), |sum, v| {
        let d = v.coords - mean;
        sum + d * d.transpose()
    })
}

/// `part_from_mesh` rotation: the jaw axis becomes y, the longest extent across it becomes x.
pub(super) fn orientation(spread: &Matrix3<f64>, jaw_axis: Vector3<f64>) -> Rotation3<f64> {
    let across = Matrix3::identity() - jaw_axis * jaw_axis.transpose();
    let eigen = (across * spread * across).symmetric_eigen();
    let long = (0..3).fold(0, |a, b| if eigen.eigenvalues[b] > eigen.eigenvalues[a] { b } else { a });
    let long = snapped(eigen.eigenvectors.column(long).into_owned());
    let flat = |v: Vector3<f64>| v - jaw_axis * jaw_axis.dot(&v);
    let other = if jaw_axis.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let x = if flat(long).norm() > 1e-3 { flat(long) } else { flat(other) }.normalize();
    let z = x.cross(&jaw_axis);
    let rows = [x.transpose(), jaw_axis.transpose(), z.transpose()];
    Rotation3::from_matrix_unchecked(Matrix3::from_rows(&rows))
}

/// Rounded to hundredths, for files that people read; never -0.
fn hundredths(x: f64) -> f64 {
    (x * 100.0).round() / 100.0 + 0.0
}

/// Angles about the fixed x, y, z axes of a rotation `R_z R_y R_x`, in degrees.
fn fixed_xyz_deg(rotation: &Rotation3<f64>) -> [f64; 3] {
    let m = rotation.matrix();
    let y = libm::asin((-m[(2, 0)]).clamp(-1.0, 1.0));
    let (x, z) = if m[(2, 0)].abs() < 1.0 - 1e-9 {
        (libm::atan2(m[(2, 1)], m[(2, 2)]), libm::atan2(m[(1, 0)], m[(0, 0)]))
    } else {
        (0.0, libm::atan2(-m[(0, 1)], m[(1, 1)]))
    };
    [x, y, z].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_give_back_their_rotation() {
        for angles in [[10.0, 20.0, 30.0], [0.0, 90.0, 45.0], [-170.0, -89.0, 5.0], [0.0, -90.0, 10.0]] {
            let rotation = rotation_from_fixed_xyz(angles.map(f64::to_radians));
            let again = rotation_from_fixed_xyz(fixed_xyz_deg(&rotation).map(f64::to_radians));
            assert!((rotation.matrix() - again.matrix()).norm() < 1e-9, "{angles:?}");
        }
    }
}
