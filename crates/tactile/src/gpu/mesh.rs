//! Meshes and poses as the stage `raster` wants them: clusters of triangles, and fixed-point numbers.

use super::layout::{Cluster, PressInput};
use crate::grid::Grid;
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;
use std::collections::HashMap;

/// Most vertices and triangles of a cluster; the sizes of the arrays in `raster.wgsl`.
const MAX_VERTICES: usize = 128;
const MAX_TRIANGLES: usize = 128;

/// Steps of a vertex from the centre of its mesh, at most.
const STEPS: f64 = (1u32 << 30) as f64;

/// A mesh cut into clusters. Vertices are whole steps from the mesh's centre, so that every cluster that uses a vertex
/// has it at the same place to the bit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clusters {
    pub(super) clusters: Vec<Cluster>,
    /// x, y, z of each vertex of each cluster.
    pub(super) vertices: Vec<i32>,
    /// Three places in the cluster's vertices, 8 bits each.
    pub(super) triangles: Vec<u32>,
    /// Where the mesh lies and how it is measured.
    pub(super) steps: Steps,
}

/// Centre and scale of a mesh in steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    centre_m: [f64; 3],
    /// Half extents.
    half_m: [f64; 3],
    metres_per_step: f64,
}

impl Clusters {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for v in mesh.vertices_m() {
            for axis in 0..3 {
                low[axis] = low[axis].min(v[axis]);
                high[axis] = high[axis].max(v[axis]);
            }
        }
        let centre_m: [f64; 3] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
        let half_m: [f64; 3] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
        let largest = half_m.iter().fold(f64::MIN_POSITIVE, |m, &h| m.max(h));
        let steps = Steps { centre_m, half_m, metres_per_step: largest / STEPS };
        let placed: Vec<[i32; 3]> = mesh
            .vertices_m()
            .iter()
            .map(|v| std::array::from_fn(|a| ((v[a] - centre_m[a]) / steps.metres_per_step).round() as i32))
            .collect();
        let mut result = Self { clusters: vec![], vertices: vec![], triangles: vec![], steps };
        let mut open = Open::default();
        for triangle in in_space_order(mesh, &placed) {
            if !open.takes(triangle) {
                result.close(&mut open, &placed);
            }
            open.push(triangle);
        }
        result.close(&mut open, &placed);
        result
    }

    fn close(&mut self, open: &mut Open, placed: &[[i32; 3]]) {
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for &v in &open.vertices {
            for axis in 0..3 {
                low[axis] = low[axis].min(placed[v as usize][axis]);
                high[axis] = high[axis].max(placed[v as usize][axis]);
            }
        }
        let middle = |a: usize| ((i64::from(low[a]) + i64::from(high[a])) / 2) as i32;
        self.clusters.push(Cluster {
            first_vertex: (self.vertices.len() / 3) as u32,
            vertices: open.vertices.len() as u32,
            first_triangle: self.triangles.len() as u32,
            triangles: open.triangles.len() as u32,
            centre: std::array::from_fn(middle),
            half: std::array::from_fn(|a| (f64::from(high[a]) - f64::from(middle(a)) + 1.0) as f32),
        });
        self.vertices.extend(open.vertices.iter().flat_map(|&v| placed[v as usize]));
        self.triangles.append(&mut open.triangles);
        *open = Open::default();
    }
}

/// A cluster that is being filled.
#[derive(Default)]
struct Open {
    vertices: Vec<u32>,
    place: HashMap<u32, u32>,
    triangles: Vec<u32>,
}

impl Open {
    fn takes(&self, triangle: [u32; 3]) -> bool {
        let new = triangle.iter().filter(|v| !self.place.contains_key(v)).count();
        self.triangles.len() < MAX_TRIANGLES && self.vertices.len() + new <= MAX_VERTICES
    }

    fn push(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = triangle.map(|v| {
            *self.place.entry(v).or_insert_with(|| {
                self.vertices.push(v);
                self.vertices.len() as u32 - 1
            })
        });
        self.triangles.push(a | b << 8 | c << 16);
    }
}

/// Triangles in the order of a curve that fills space (Morton), so that neighbours in the list are neighbours.
fn in_space_order(mesh: &TriMesh, placed: &[[i32; 3]]) -> Vec<[u32; 3]> {
    let code = |triangle: &[u32; 3]| -> u64 {
        let mut code = 0;
        for axis in 0..3 {
            let sum: i64 = triangle.iter().map(|&v| i64::from(placed[v as usize][axis])).sum();
            // 0 to 2^20 over the mesh.
            let at = ((sum / 3 + (1 << 30)) >> 11) as u64;
            code |= (0..20).map(|bit| (at >> bit & 1) << (3 * bit + axis)).sum::<u64>();
        }
        code
    };
    let mut triangles: Vec<(u64, [u32; 3])> = mesh.triangles().iter().map(|t| (code(t), *t)).collect();
    triangles.sort_unstable();
    triangles.into_iter().map(|(_, t)| t).collect()
}

impl Steps {
    /// Writes the pose of a mesh in front of a gel into `press`: `raster.wgsl` multiplies with 64-bit integers.
    pub(super) fn place(&self, gel_from_mesh: &Pose, grid: &Grid, press: &mut PressInput) {
        let scale = 1.0 / grid.metres_per_px;
        let rotation = gel_from_mesh.rotation.to_rotation_matrix();
        let centre = gel_from_mesh * nalgebra::Point3::from(self.centre_m);
        let shift_px = [
            centre.x * scale + grid.width_px as f64 / 2.0 - 0.5,
            centre.y * scale + grid.height_px as f64 / 2.0 - 0.5,
            -centre.z * scale,
        ];
        let pixels_per_step = self.metres_per_step * scale;
        // Largest number of pixels on the way, with a factor of 4 to the end of 63 bits and matrix entries within 30.
        let reach_px = shift_px.iter().fold(2.0 * STEPS * pixels_per_step, |m, s| m.max(s.abs()));
        let mut bits = 60i32;
        while bits > 33 && reach_px * power_of_two(bits) > power_of_two(61) {
            bits -= 1;
        }
        let unit = power_of_two(bits);
        for row in 0..3 {
            let sign = if row == 2 { -1.0 } else { 1.0 };
            for axis in 0..3 {
                let entry = sign * rotation[(row, axis)] * pixels_per_step * unit;
                press.matrix[3 * row + axis] = entry.round() as i32;
            }
            let shift = (shift_px[row] * unit).round() as i64;
            press.shift[2 * row] = shift as u32;
            press.shift[2 * row + 1] = (shift >> 32) as u32;
        }
        let reach_h: f64 = (0..3).map(|a| rotation[(2, a)].abs() * self.half_m[a] * scale).sum();
        press.bound_px = (shift_px[2] + reach_h).floor().clamp(-1e9, 1e9) as i32 + 1;
        press.fraction_bits = bits as u32;
        press.pixels_per_step = pixels_per_step as f32;
    }
}

fn power_of_two(exponent: i32) -> f64 {
    libm::ldexp(1.0, exponent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::frames::{pose, rotation_from_fixed_xyz};
    use gripgen_twin::parts::SteppedShaft;
    use nalgebra::{Point3, Vector3};

    /// What `placed` of raster.wgsl computes, in pixels.
    fn placed_px(press: &PressInput, row: usize, v: &[i32]) -> f64 {
        let shift = i64::from(press.shift[2 * row + 1] as i32) << 32 | i64::from(press.shift[2 * row]);
        let sum: i64 = (0..3).map(|a| i64::from(press.matrix[3 * row + a]) * i64::from(v[a])).sum();
        (shift + sum) as f64 / power_of_two(press.fraction_bits as i32)
    }

    #[test]
    fn fixed_point_positions_are_exact_to_a_millionth_of_a_pixel() {
        let mesh = SteppedShaft { segments: 40, ..Default::default() }.mesh();
        let clusters = Clusters::new(&mesh);
        let grid = Grid { width_px: 320, height_px: 240, metres_per_px: 5e-5 };
        for (i, z) in [0.012, 0.0, 0.3, -0.05].into_iter().enumerate() {
            let at = pose(
                &rotation_from_fixed_xyz([0.7 * i as f64, 0.2, 1.1]),
                Vector3::new(0.02 * i as f64, -1e-3, z),
            );
            let mut press: PressInput = bytemuck::Zeroable::zeroed();
            clusters.steps.place(&at, &grid, &mut press);
            let mut highest = f64::NEG_INFINITY;
            for v in clusters.vertices.chunks_exact(3) {
                let s = &clusters.steps;
                let point = Point3::from(std::array::from_fn::<_, 3, _>(|a| {
                    s.centre_m[a] + f64::from(v[a]) * s.metres_per_step
                }));
                let p = (at * point).coords / grid.metres_per_px;
                let exact = [p.x + 159.5, p.y + 119.5, -p.z];
                for row in 0..3 {
                    let error = (placed_px(&press, row, v) - exact[row]).abs();
                    // The third pose is 6000 pixels away.
                    let bound = if z > 0.1 { 4e-6 } else { 1e-6 };
                    assert!(error < bound, "pose {i}: {error} px");
                }
                highest = highest.max(exact[2]);
            }
            assert!(f64::from(press.bound_px) >= highest, "{} px, {highest} px", press.bound_px);
        }
    }

    #[test]
    fn clusters_hold_every_triangle_once() {
        let mesh = SteppedShaft { segments: 200, ..Default::default() }.mesh();
        let clusters = Clusters::new(&mesh);
        let s = &clusters.steps;
        let mut found: Vec<[[i64; 3]; 3]> = vec![];
        for c in &clusters.clusters {
            assert!(c.vertices as usize <= MAX_VERTICES && c.triangles as usize <= MAX_TRIANGLES);
            for packed in &clusters.triangles[c.first_triangle as usize..][..c.triangles as usize] {
                let corner = |shift: u32| -> [i64; 3] {
                    let at = 3 * (c.first_vertex + (packed >> shift & 0xff)) as usize;
                    let v = &clusters.vertices[at..at + 3];
                    for a in 0..3 {
                        let off = (f64::from(v[a]) - f64::from(c.centre[a])).abs();
                        // `visible` of raster.wgsl adds 1e-4 of the size.
                        assert!(off <= f64::from(c.half[a]) * (1.0 + 1e-6));
                    }
                    std::array::from_fn(|a| i64::from(v[a]))
                };
                found.push([corner(0), corner(8), corner(16)]);
            }
        }
        let mut wanted: Vec<[[i64; 3]; 3]> = mesh
            .triangles()
            .iter()
            .map(|t| {
                t.map(|v| {
                    let p = mesh.vertices_m()[v as usize];
                    std::array::from_fn(|a| ((p[a] - s.centre_m[a]) / s.metres_per_step).round() as i64)
                })
            })
            .collect();
        found.sort_unstable();
        wanted.sort_unstable();
        assert!(found == wanted);
        assert!(clusters.clusters.len() < mesh.triangles().len() / 40, "{}", clusters.clusters.len());
    }
}
