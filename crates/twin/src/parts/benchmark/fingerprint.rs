//! What tells shapes apart that may be turned and moved: volume, area, and how the surface is spread about its middle.

use crate::TriMesh;
use nalgebra::{Matrix3, Vector3};

/// Numbers of a shape that do not change when it is turned or moved, nor with how its surface is cut into triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprint {
    /// Lengths in metres: roots of volume and area, and spreads along the main axes of the surface, the smallest first.
    lengths_m: [f64; 5],
}

/// Shapes whose lengths all differ by less than this share are one.
const SAME: f64 = 0.004;

impl Fingerprint {
    /// Of a closed mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let (mut area, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t).map(|p| p.coords);
            let own = (b - a).cross(&(c - a)).norm() / 2.0;
            area += own;
            first += (a + b + c) * (own / 3.0);
            // Exact for a polynomial of second degree: middles of the three sides.
            for p in [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0] {
                second += p * p.transpose() * (own / 3.0);
            }
        }
        let middle = first / area;
        let spread = second / area - middle * middle.transpose();
        let mut axes: Vec<f64> = spread.symmetric_eigenvalues().iter().map(|x| x.max(0.0).sqrt()).collect();
        axes.sort_by(f64::total_cmp);
        let volume = mesh.signed_volume_m3().abs();
        Self { lengths_m: [libm::cbrt(volume), area.sqrt(), axes[0], axes[1], axes[2]] }
    }

    /// Whether another shape is the same but for rounding.
    pub fn same(&self, other: &Self) -> bool {
        let pairs = self.lengths_m.iter().zip(&other.lengths_m);
        pairs.into_iter().all(|(a, b)| (a - b).abs() <= SAME * a.max(*b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{InvoluteGear, SteppedShaft};
    use nalgebra::Rotation3;

    #[test]
    fn a_turned_copy_is_the_same_and_a_longer_one_is_not() {
        let shaft = SteppedShaft::default();
        let mesh = shaft.mesh();
        let turn = Rotation3::from_euler_angles(0.3, 1.0, -0.7);
        let moved = mesh.vertices_m().iter().map(|p| turn * p + Vector3::new(0.1, 0.0, -0.2)).collect();
        let copy = TriMesh::new(moved, mesh.triangles().to_vec()).unwrap();
        let coarse = SteppedShaft { segments: 120, ..shaft }.mesh();
        let longer = SteppedShaft { end_mm: 27.0, ..shaft }.mesh();
        let print = Fingerprint::of(&mesh);
        assert!(print.same(&Fingerprint::of(&copy)) && print.same(&Fingerprint::of(&coarse)));
        assert!(!print.same(&Fingerprint::of(&longer)));
        assert!(!print.same(&Fingerprint::of(&InvoluteGear::default().mesh())));
    }
}
