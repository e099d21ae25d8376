//! Stage `raster`: from a mesh to the height map that the gel meets.

use crate::grid::{Grid, Plane};
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;

/// A triangle corner in pixels; `height_px` grows towards the gel.
#[derive(Debug, Clone, Copy)]
struct Corner {
    x_px: f64,
    y_px: f64,
    height_px: f64,
    vertex: u32,
}

/// Height of the part's surface above the gel plane, in pixels, orthographic along the gel's normal.
///
/// Positive heights lie inside the unloaded gel. Where several surfaces lie over a pixel, the one nearest the gel
/// counts; where there is none, or only one deeper than `depth_px` below the nearest vertex, the height is
/// `-inf`. Pixel centres are sampled; two triangles that share an edge compute its crossing of a row from the same
/// end, so no pixel falls between them.
pub fn raster(mesh: &TriMesh, gel_from_mesh: &Pose, grid: &Grid, depth_px: f64) -> Plane {
    let mut map = Plane::filled(grid.width_px, grid.height_px, f32::NEG_INFINITY);
    let scale = 1.0 / grid.metres_per_px;
    // Pixel coordinates whose integers are pixel centres.
    let (x0, y0) = (grid.width_px as f64 / 2.0 - 0.5, grid.height_px as f64 / 2.0 - 0.5);
    let corners: Vec<Corner> = mesh
        .vertices_m()
        .iter()
        .enumerate()
        .map(|(i, v)| {
            let p = gel_from_mesh * v;
            let (x_px, y_px) = (p.x * scale + x0, p.y * scale + y0);
            Corner { x_px, y_px, height_px: -p.z * scale, vertex: i as u32 }
        })
        .collect();
    let inside = |c: &&Corner| {
        c.x_px >= 0.0
            && c.y_px >= 0.0
            && c.x_px <= (grid.width_px - 1) as f64
            && c.y_px <= (grid.height_px - 1) as f64
    };
    let nearest = corners.iter().filter(inside).fold(f64::NEG_INFINITY, |a, c| a.max(c.height_px));
    let floor = nearest - depth_px;
    for triangle in mesh.triangles() {
        fill(&mut map, triangle.map(|v| corners[v as usize]), floor);
    }
    map
}

/// Writes one triangle into the map where it is nearer than what is there.
fn fill(map: &mut Plane, t: [Corner; 3], floor_px: f64) {
    let top = t[0].height_px.max(t[1].height_px).max(t[2].height_px);
    let bottom = t[0].height_px.min(t[1].height_px).min(t[2].height_px);
    let first_row = t[0].y_px.min(t[1].y_px).min(t[2].y_px).ceil().max(0.0);
    let last_row = t[0].y_px.max(t[1].y_px).max(t[2].y_px).floor().min(map.height as f64 - 1.0);
    let left = t[0].x_px.min(t[1].x_px).min(t[2].x_px);
    let right = t[0].x_px.max(t[1].x_px).max(t[2].x_px);
    if top < floor_px || first_row > last_row || right < 0.0 || left > map.width as f64 - 1.0 {
        return;
    }
    // Plane through the corners, relative to the first one so that small triangles far away stay exact.
    let (ux, uy, uh) = (t[1].x_px - t[0].x_px, t[1].y_px - t[0].y_px, t[1].height_px - t[0].height_px);
    let (vx, vy, vh) = (t[2].x_px - t[0].x_px, t[2].y_px - t[0].y_px, t[2].height_px - t[0].height_px);
    let area = ux * vy - uy * vx;
    if area == 0.0 {
        return;
    }
    let slope_x = (uh * vy - vh * uy) / area;
    let slope_y = (vh * ux - uh * vx) / area;
    for row in first_row as usize..=last_row as usize {
        let y = row as f64;
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            if let Some(x) = crossing(&t[a], &t[b], y) {
                from = from.min(x);
                to = to.max(x);
            }
        }
        let from = from.ceil().max(0.0);
        let to = to.floor().min(map.width as f64 - 1.0);
        if from > to {
            continue;
        }
        let along_row = t[0].height_px + slope_y * (y - t[0].y_px);
        let start = row * map.width;
        for column in from as usize..=to as usize {
            let height = along_row + slope_x * (column as f64 - t[0].x_px);
            let cell = &mut map.values[start + column];
            *cell = cell.max(height.clamp(bottom, top) as f32);
        }
    }
}

/// Where the edge between two corners crosses row `y`, computed from the corner with the lower vertex number.
fn crossing(a: &Corner, b: &Corner, y: f64) -> Option<f64> {
    let (a, b) = if a.vertex <= b.vertex { (a, b) } else { (b, a) };
    if a.y_px == b.y_px || y < a.y_px.min(b.y_px) || y > a.y_px.max(b.y_px) {
        return None;
    }
    Some(a.x_px + (y - a.y_px) * ((b.x_px - a.x_px) / (b.y_px - a.y_px)))
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
        let mut stream = gripgen_twin::random::Stream::new(3, 0, gripgen_twin::random::Purpose::Draw);
        let mut corner = |vertex| Corner {
            x_px: 80.0 * stream.uniform(),
            y_px: 60.0 * stream.uniform(),
            height_px: 0.0,
            vertex,
        };
        let mut crossed = 0;
        for _ in 0..2000 {
            let (a, b) = (corner(1), corner(2));
            for y in 0..60 {
                let y = f64::from(y);
                assert_eq!(crossing(&a, &b, y).map(f64::to_bits), crossing(&b, &a, y).map(f64::to_bits));
                crossed += usize::from(crossing(&a, &b, y).is_some());
            }
        }
        assert!(crossed > 10_000);
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
