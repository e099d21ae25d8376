//! Stage `raster`: from a mesh to the height map that the gel meets.

mod clusters;
mod corners;
mod draw;
mod edge;
mod fill;
mod find;
mod points;
#[cfg(test)]
mod step_tests;
mod steps;
mod sums;

pub use clusters::ClusteredMesh;
pub(crate) use draw::HeightMap;

use crate::grid::{Grid, Plane};
use crate::simd::SimdLevel;
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;

/// Height of the part's surface above the gel plane, in pixels, orthographic along the gel's normal.
///
/// Positive heights lie inside the unloaded gel. Where several surfaces lie over a pixel, the one nearest the gel
/// counts; where there is none, or only one deeper than `depth_px` below the highest pixel, the height is
/// `-inf`. Pixel centres are sampled; two triangles that share an edge compute its crossing of a row from the same
/// end, so no pixel falls between them. The result depends on no order of triangles.
///
/// It sorts the mesh first; who needs several views of a mesh keeps a [`ClusteredMesh`].
pub fn raster(mesh: &TriMesh, gel_from_mesh: &Pose, grid: &Grid, depth_px: f64) -> Plane {
    ClusteredMesh::new(mesh).raster(gel_from_mesh, grid, depth_px)
}

impl ClusteredMesh {
    /// As [`raster`].
    pub fn raster(&self, gel_from_mesh: &Pose, grid: &Grid, depth_px: f64) -> Plane {
        let mut map = HeightMap::default();
        map.start(self, gel_from_mesh, grid);
        let top = map.draw_down(self, depth_px, None, SimdLevel::best());
        let floor = (f64::from(top) - depth_px) as f32;
        let mut plane = map.into_plane();
        if floor > f32::NEG_INFINITY {
            for h in &mut plane.values {
                *h = if *h < floor { f32::NEG_INFINITY } else { *h };
            }
        }
        plane
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::frames::{pose, rotation_from_fixed_xyz};
    use gripgen_twin::parts::SteppedShaft;
    use nalgebra::{Point3, Rotation3, Vector3};

    const GRID: Grid = Grid { width_px: 80, height_px: 60, metres_per_px: 1e-4 };

    fn sphere(radius_m: f64, rings: usize) -> TriMesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for i in 0..=rings {
            let polar = std::f64::consts::PI * i as f64 / rings as f64;
            for j in 0..2 * rings {
                let around = std::f64::consts::PI * j as f64 / rings as f64;
                vertices.push(
                    Point3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
                        * radius_m,
                );
            }
        }
        let n = 2 * rings;
        for i in 0..rings {
            for j in 0..n {
                let (a, b, c, d) =
                    (i * n + j, i * n + (j + 1) % n, (i + 1) * n + (j + 1) % n, (i + 1) * n + j);
                triangles.push([a as u32, d as u32, c as u32]);
                triangles.push([a as u32, c as u32, b as u32]);
            }
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn a_sphere_has_the_height_of_a_sphere() {
        let radius = 2e-3;
        let at = pose(&Rotation3::identity(), Vector3::new(0.55e-3, -0.3e-3, 3e-3));
        let map = raster(&sphere(radius, 200), &at, &GRID, 1e3);
        for row in 0..60 {
            for column in 0..80 {
                let (x, y) = GRID.centre_m(column, row);
                let r2 = (x - 0.55e-3).powi(2) + (y + 0.3e-3).powi(2);
                let height = map.at(column, row);
                if r2 < (0.95 * radius).powi(2) {
                    let exact = ((radius * radius - r2).sqrt() - 3e-3) / 1e-4;
                    assert!((f64::from(height) - exact).abs() < 0.03, "({column}, {row})");
                } else if r2 > (1.01 * radius).powi(2) {
                    assert_eq!(height, f32::NEG_INFINITY);
                }
            }
        }
    }

    /// A closed mesh leaves no pin holes, at any pose.
    #[test]
    fn shared_edges_leave_no_holes() {
        let mesh = SteppedShaft { segments: 90, ..Default::default() }.mesh();
        for i in 0..40 {
            let angles = [0.37 * f64::from(i), 0.0, 0.11 * f64::from(i)];
            let at = pose(&rotation_from_fixed_xyz(angles), Vector3::new(0.0, 0.0, 0.012));
            let map = raster(&mesh, &at, &GRID, 1e9);
            // The window (8 x 6 mm) lies wholly inside the shaft's outline (20 mm thick).
            let holes = map.values.iter().filter(|h| !h.is_finite()).count();
            assert_eq!(holes, 0, "pose {i}");
        }
    }

    /// Two triangles see their common edge from its two ends and compute the same crossing, to the bit.
    #[test]
    fn an_edge_crosses_a_row_at_one_place() {
        use super::edge::{Corner, Edge};
        let mut stream = gripgen_twin::random::Stream::new(3, 0, gripgen_twin::random::Purpose::Draw);
        let mut corner = |vertex| Corner {
            x_px: 80.0 * stream.uniform(),
            y_px: 60.0 * stream.uniform(),
            height_px: 0.0,
            number: vertex,
        };
        let mut crossed = 0;
        for _ in 0..2000 {
            let (a, b) = (corner(1), corner(2));
            for y in 0..60 {
                let y = f64::from(y);
                let crossing = |a, b| Edge::new(a, b).crossing(y).map(f64::to_bits);
                assert_eq!(crossing(&a, &b), crossing(&b, &a));
                crossed += usize::from(crossing(&a, &b).is_some());
            }
        }
        assert!(crossed > 10_000);
    }

    /// A plate far below the highest point of the part: all triangles over the window are drawn in one look.
    #[test]
    fn a_few_triangles_far_below_the_highest_point_are_seen() {
        let corner = |x, y, z| Point3::new(x, y, z);
        let vertices = vec![
            corner(-0.02, -0.02, 0.03),
            corner(0.02, -0.02, 0.03),
            corner(0.0, 0.03, 0.03),
            corner(0.02, -0.02, 0.0),
        ];
        let mesh = TriMesh::new(vertices, vec![[0, 1, 2], [1, 3, 2]]).unwrap();
        let map = raster(&mesh, &Pose::identity(), &GRID, 40.0);
        let height = map.at(20, 30);
        assert!((height + 300.0).abs() < 1e-3, "{height} px instead of -300 px");
    }

    #[test]
    fn surfaces_too_deep_to_touch_are_left_out() {
        let at = pose(&Rotation3::identity(), Vector3::new(0.0, 0.0, 2e-3));
        let map = raster(&sphere(2e-3, 100), &at, &GRID, 5.0);
        let deepest = map.values.iter().copied().filter(|h| h.is_finite()).fold(0.0f32, f32::min);
        assert!(deepest > -7.0, "{deepest} px");
        assert!(map.values.iter().any(|h| !h.is_finite()));
    }
}
