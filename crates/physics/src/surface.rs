//! The surface of a part: what lies in front of a pad, and where a line meets it.

use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

/// Triangles of a group, which has one box.
const GROUP: usize = 32;

/// Boxes are this much larger than computed: rounding must not lose a triangle.
const SLACK_M: f64 = 1e-9;

/// A triangle mesh that is asked for what is nearest. It is geometry only: the engine never touches it.
#[derive(Debug, Clone)]
pub struct Surface {
    mesh: Arc<TriMesh>,
    /// Numbers of the triangles, those of a group together.
    order: Vec<u32>,
    groups: Vec<Group>,
}

#[derive(Debug, Clone)]
struct Group {
    triangles: std::ops::Range<usize>,
    middle_m: Point3<f64>,
    half_m: Vector3<f64>,
}

/// Half sides of the window of a pad: along x and y of its `gel` frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Half of the width, along image x.
    pub half_width_m: f64,
    /// Half of the height, along image y.
    pub half_height_m: f64,
}

/// Where a line meets a surface for the first or last time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineHit {
    /// Distance from the line's point, along its direction.
    pub at_m: f64,
    /// Unit normal of the triangle, with either sign.
    pub normal: Vector3<f64>,
}

impl Surface {
    /// Sorts the triangles of a mesh into boxes.
    pub fn new(mesh: Arc<TriMesh>) -> Self {
        let (mut order, mut groups) = (Vec::with_capacity(mesh.triangles().len()), Vec::new());
        for piece in mesh.pieces(GROUP) {
            let start = order.len();
            order.extend(&piece);
            groups.push(Group::new(&mesh, &piece, start..order.len()));
        }
        Self { mesh, order, groups }
    }

    /// The mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Height of the highest point of the surface in front of a window, along -z of the `gel` frame (towards the gel, which
    /// looks along +z at the part); `None` if there is no surface in front of it. Triangles are cut at the window's edges, so
    /// that the answer is exact.
    pub fn height_m(&self, gel_from_mesh: &Pose, window: Window) -> Option<f64> {
        let mut top = f64::NEG_INFINITY;
        self.cut(gel_from_mesh, window, f64::NEG_INFINITY, |polygon| {
            top = polygon.iter().fold(top, |top, p| top.max(-p.z));
            top
        });
        top.is_finite().then_some(top)
    }

    /// Points (x, y) of the `gel` frame where the surface in front of a window begins or ends: corners of its triangles, cut at
    /// the window's edges, as far as they rise above `floor_m`.
    pub(crate) fn points_above(&self, gel_from_mesh: &Pose, window: Window, floor_m: f64) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        self.cut(gel_from_mesh, window, floor_m, |polygon| {
            let above = cut_at(polygon, |p| -p.z - floor_m);
            points.extend(above.iter().map(|p| [p.x, p.y]));
            floor_m
        });
        points
    }

    /// Hands on each triangle, cut at the window's edges, that can rise above the floor; `each` returns the new floor. The highest
    /// groups come first.
    fn cut(
        &self,
        gel_from_mesh: &Pose,
        window: Window,
        mut floor: f64,
        mut each: impl FnMut(&[Point3<f64>]) -> f64,
    ) {
        let r = gel_from_mesh.rotation.to_rotation_matrix();
        let (w, h) = (window.half_width_m, window.half_height_m);
        let top = |group: &Group| {
            let p = gel_from_mesh * group.middle_m;
            let reach = |i: usize| (0..3).map(|j| r[(i, j)].abs() * group.half_m[j]).sum::<f64>() + SLACK_M;
            let over = p.x.abs() <= w + reach(0) && p.y.abs() <= h + reach(1);
            over.then(|| reach(2) - p.z)
        };
        let tops = self.groups.iter().enumerate().filter_map(|(i, group)| Some((top(group)?, i)));
        let mut highest_first: Vec<(f64, usize)> = tops.filter(|(top, _)| *top >= floor).collect();
        highest_first.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Along z, to what rounding leaves; most triangles need no more.
        let (x, y, z) = (-r[(2, 0)], -r[(2, 1)], -r[(2, 2)]);
        let lift = SLACK_M - gel_from_mesh.translation.z;
        let about = |c: &Point3<f64>| x * c.x + y * c.y + z * c.z + lift;
        for (top, group) in highest_first {
            if top < floor {
                return;
            }
            for &t in &self.order[self.groups[group].triangles.clone()] {
                let corners = self.mesh.corners(t as usize);
                if corners.iter().all(|c| about(c) < floor) {
                    continue;
                }
                let corners = corners.map(|c| gel_from_mesh * c);
                let all = |f: &dyn Fn(&Point3<f64>) -> bool| corners.iter().all(f);
                if all(&|p| p.x > w)
                    || all(&|p| p.x < -w)
                    || all(&|p| p.y > h)
                    || all(&|p| p.y < -h)
                    || all(&|p| -p.z < floor)
                {
                    continue;
                }
                let mut polygon = corners.to_vec();
                if !all(&|p| p.x.abs() <= w && p.y.abs() <= h) {
                    polygon = cut_at(&polygon, |p| w - p.x);
                    polygon = cut_at(&polygon, |p| w + p.x);
                    polygon = cut_at(&polygon, |p| h - p.y);
                    polygon = cut_at(&polygon, |p| h + p.y);
                }
                if !polygon.is_empty() {
                    floor = each(&polygon);
                }
            }
        }
    }

    /// The first and the last place where the line through `from` along the unit vector `along` meets the surface, in mesh
    /// coordinates; `None` if it misses.
    pub fn ends_of_line(&self, from: Point3<f64>, along: Vector3<f64>) -> Option<(LineHit, LineHit)> {
        let mut ends: Option<(LineHit, LineHit)> = None;
        for group in &self.groups {
            if !group.meets(from, along) {
                continue;
            }
            for &t in &self.order[group.triangles.clone()] {
                let [a, b, c] = self.mesh.corners(t as usize);
                let Some(at_m) = meets_triangle(&[a, b, c], from, along) else { continue };
                let hit = LineHit { at_m, normal: (b - a).cross(&(c - a)).normalize() };
                let (first, last) = ends.unwrap_or((hit, hit));
                let nearer = if at_m < first.at_m { hit } else { first };
                ends = Some((nearer, if at_m > last.at_m { hit } else { last }));
            }
        }
        ends
    }
}

impl Group {
    fn new(mesh: &TriMesh, triangles: &[u32], range: std::ops::Range<usize>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in triangles.iter().flat_map(|&t| mesh.corners(t as usize)) {
            for i in 0..3 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        Self {
            triangles: range,
            middle_m: Point3::from([0, 1, 2].map(|i| (low[i] + high[i]) / 2.0)),
            half_m: Vector3::from([0, 1, 2].map(|i| (high[i] - low[i]) / 2.0 + SLACK_M)),
        }
    }

    /// Whether a line passes through the box (slabs).
    fn meets(&self, from: Point3<f64>, along: Vector3<f64>) -> bool {
        let d = self.middle_m - from;
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..3 {
            if along[i] == 0.0 {
                if d[i].abs() > self.half_m[i] {
                    return false;
                }
                continue;
            }
            let (a, b) = ((d[i] - self.half_m[i]) / along[i], (d[i] + self.half_m[i]) / along[i]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// The part of a convex polygon on the side where `inside` is not negative (Sutherland & Hodgman 1974).
fn cut_at(polygon: &[Point3<f64>], inside: impl Fn(&Point3<f64>) -> f64) -> Vec<Point3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (a, b) = (inside(p), inside(q));
        if a >= 0.0 {
            kept.push(*p);
        }
        if (a >= 0.0) != (b >= 0.0) {
            kept.push(p + (q - p) * (a / (a - b)));
        }
    }
    kept
}

/// Distance along a line to a triangle (Moller & Trumbore 1997).
fn meets_triangle([a, b, c]: &[Point3<f64>; 3], from: Point3<f64>, along: Vector3<f64>) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = along.cross(&e2);
    let determinant = e1.dot(&p);
    if determinant.abs() < 1e-18 {
        return None;
    }
    let s = from - a;
    let u = s.dot(&p) / determinant;
    let q = s.cross(&e1);
    let v = along.dot(&q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(&q) / determinant)
}

#[cfg(test)]
mod tests;
