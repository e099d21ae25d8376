//! Drawing the clusters of a mesh from the top down, as deep as needed.

use super::clusters::ClusteredMesh;
use super::corners::{Corners, View};
use super::edge::higher;
use super::fill::fill;
use super::steps::Steps;
use crate::convolve::Area;
use crate::deform::Edges;
use crate::grid::{Grid, Plane};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::frames::Pose;

/// Boxes are this much larger than computed, in pixels: rounding must not lose a cluster.
const SLACK_PX: f64 = 1e-6;

/// A first look at what is uppermost goes this deep, in pixels.
const FIRST_LOOK_PX: f64 = 4.0;

/// The map that a mesh is drawn into, and memory for it to be used again.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeightMap {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row; `-inf` where nothing was drawn.
    pub(crate) values: Vec<f32>,
    /// Where something was drawn.
    pub(crate) area: Area,
    view: View,
    seen: Vec<Seen>,
    corners: Corners,
    pub(super) steps: Steps,
}

/// A cluster over the window.
#[derive(Debug, Clone, Copy)]
struct Seen {
    cluster: usize,
    /// Columns and rows of the window that its box reaches, both ends included.
    columns: (usize, usize),
    rows: (usize, usize),
    /// No point of it is higher.
    top_px: f64,
    /// The highest triangle that was not drawn yet.
    left_px: f64,
    /// All triangles that reach above this were drawn.
    drawn_px: f64,
}

impl HeightMap {
    /// A map that is all drawn.
    pub(crate) fn of(plane: &Plane) -> Self {
        let area = Area::whole(plane.width, plane.height);
        Self {
            width: plane.width,
            height: plane.height,
            values: plane.values.clone(),
            area,
            ..Self::default()
        }
    }

    /// Empties the map and finds the clusters over the window.
    pub(crate) fn start(&mut self, mesh: &ClusteredMesh, gel_from_mesh: &Pose, grid: &Grid) {
        (self.width, self.height) = (grid.width_px, grid.height_px);
        self.values.clear();
        self.values.resize(grid.len(), f32::NEG_INFINITY);
        self.area = Area::EMPTY;
        let q = gel_from_mesh.rotation.coords;
        let t = gel_from_mesh.translation.vector;
        // Pixel coordinates whose integers are pixel centres.
        let origin_px = (grid.width_px as f64 / 2.0 - 0.5, grid.height_px as f64 / 2.0 - 0.5);
        self.view = View {
            quaternion: [q.x, q.y, q.z, q.w],
            translation: [t.x, t.y, t.z],
            scale: 1.0 / grid.metres_per_px,
            origin_px,
        };
        let r = gel_from_mesh.rotation.to_rotation_matrix();
        let (last_x, last_y) = ((self.width - 1) as f64, (self.height - 1) as f64);
        let view = self.view;
        // Points of pixels lie less than half a pixel from their centres.
        let reached = |a: f64, reach: f64, last: f64| {
            let (from, to) = ((a - reach).round().max(0.0), (a + reach).round().min(last));
            (from <= to).then_some((from as usize, to as usize))
        };
        self.seen.clear();
        for (cluster, c) in mesh.clusters.iter().enumerate() {
            let p = gel_from_mesh * c.middle_m;
            let reach = |i: usize| {
                let half: f64 = (0..3).map(|j| r[(i, j)].abs() * c.half_m[j]).sum();
                half * view.scale * (1.0 + 1e-9) + SLACK_PX
            };
            let (x, y) = (p.x * view.scale + origin_px.0, p.y * view.scale + origin_px.1);
            let (rx, ry) = (reach(0), reach(1));
            if let (Some(columns), Some(rows)) = (reached(x, rx, last_x), reached(y, ry, last_y)) {
                let top_px = -p.z * view.scale + reach(2);
                let never = f64::INFINITY;
                self.seen.push(Seen { cluster, columns, rows, top_px, left_px: never, drawn_px: never });
            }
        }
    }

    /// Draws all that can lie less than `depth_px` below the highest pixel, `rest` added to it where there is one
    /// (at most 0 everywhere). Returns the highest pixel, `-inf` if there is none.
    pub(crate) fn draw_down(
        &mut self,
        mesh: &ClusteredMesh,
        depth_px: f64,
        rest: Option<&Plane>,
        level: SimdLevel,
    ) -> f32 {
        let mut top = self.top(rest, level);
        let highest = self.seen.iter().fold(f64::NEG_INFINITY, |m, s| m.max(s.top_px));
        let mut look = FIRST_LOOK_PX.min(depth_px);
        let mut left = true;
        while top == f32::NEG_INFINITY && left {
            // The last triangles may be those that are seen.
            left = self.draw_above(mesh, highest - look, level);
            top = self.top(rest, level);
            look *= 2.0;
        }
        if top > f32::NEG_INFINITY {
            self.draw_above(mesh, f64::from(top) - depth_px, level);
            top = self.top(rest, level);
        }
        top
    }

    /// Draws the triangles that reach above `floor_px`. Returns whether some are left.
    fn draw_above(&mut self, mesh: &ClusteredMesh, floor_px: f64, level: SimdLevel) -> bool {
        level.run(Draw { map: self, mesh, floor_px })
    }

    /// Finds the pixels beside a step of a contact that is so deep at the centres of pixels, 0 beyond `area`. Returns
    /// whether there are any.
    pub(crate) fn find_steps(&mut self, depth_px: &Plane, area: Area, level: SimdLevel) -> bool {
        self.steps.find(depth_px, area, level)
    }

    /// Draws these pixels at their points, all that reaches above `floor_px`.
    pub(crate) fn draw_steps(
        &mut self,
        mesh: &ClusteredMesh,
        floor_px: f64,
        rest: Option<&Plane>,
        level: SimdLevel,
    ) {
        self.steps.empty();
        level.run(DrawPoints { map: self, mesh, floor_px });
        self.steps.collect(&self.values, rest);
    }

    /// What a press touches, `by_centres` as [`HeightMap::touched`] says, with these pixels at their points.
    pub(crate) fn with_steps(
        &self,
        by_centres: (f64, f64),
        top: f64,
        press_px: f64,
        level: SimdLevel,
    ) -> (f64, f64) {
        self.steps.touched(by_centres, top, press_px, level)
    }

    /// Puts the mean depth at their points into these pixels, and returns the depths there; `lift` is what lies between heights
    /// and depths.
    pub(crate) fn write_steps(&self, lift: f64, depth_px: &mut Plane, level: SimdLevel) -> Edges {
        self.steps.write(lift, depth_px, level);
        self.steps.edges(lift)
    }

    pub(crate) fn into_plane(self) -> Plane {
        Plane { width: self.width, height: self.height, values: self.values }
    }
}

struct Draw<'a> {
    map: &'a mut HeightMap,
    mesh: &'a ClusteredMesh,
    floor_px: f64,
}

impl Kernel for Draw<'_> {
    type Output = bool;
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> bool {
        let Self { map, mesh, floor_px } = self;
        let mut seen = std::mem::take(&mut map.seen);
        let mut corners = std::mem::take(&mut map.corners);
        let width = map.width;
        let mut left = false;
        for s in &mut seen {
            if s.top_px >= floor_px && s.left_px >= floor_px {
                let cluster = &mesh.clusters[s.cluster];
                corners.transform(mesh, cluster, &map.view);
                let heights = (floor_px, s.drawn_px);
                s.left_px = corners.select(mesh, cluster, (map.width, map.height), heights);
                s.drawn_px = floor_px;
                for r in &corners.reaching {
                    let t = corners.triangle(r.corners);
                    fill(&mut map.values, width, t, (r.first_row as usize, r.last_row as usize));
                }
                map.area.join(corners.area);
            }
            left |= s.left_px > f64::NEG_INFINITY;
        }
        (map.seen, map.corners) = (seen, corners);
        left
    }
}

struct DrawPoints<'a> {
    map: &'a mut HeightMap,
    mesh: &'a ClusteredMesh,
    floor_px: f64,
}

impl Kernel for DrawPoints<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let HeightMap { seen, corners, steps, view, width, height: rows_px, .. } = self.map;
        for s in &*seen {
            if s.top_px < self.floor_px || !steps.may_be_in(s.rows, s.columns) {
                continue;
            }
            let cluster = &self.mesh.clusters[s.cluster];
            corners.transform(self.mesh, cluster, view);
            for t in &self.mesh.triangles[cluster.triangles.clone()] {
                let [a, b, c] = [usize::from(t[0]), usize::from(t[1]), usize::from(t[2])];
                let height = &corners.height;
                if higher(higher(height[a], height[b]), height[c]) < self.floor_px {
                    continue;
                }
                let around = |v: &[(i32, i32)], n: usize| {
                    let (a, b, c) = (v[a], v[b], v[c]);
                    // From the largest whole number before the corners to the smallest one after them.
                    (a.1.min(b.1).min(c.1).max(0), a.0.max(b.0).max(c.0).min(n as i32 - 1))
                };
                let (rows, columns) = (around(&corners.rows, *rows_px), around(&corners.columns, *width));
                if rows.0 > rows.1 || columns.0 > columns.1 {
                    continue;
                }
                let whole = |(from, to): (i32, i32)| (from as usize, to as usize);
                let (rows, columns) = (whole(rows), whole(columns));
                if steps.may_be_in(rows, columns) {
                    // SAFETY: the caller has the instructions of `L`.
                    unsafe { steps.fill::<L>(corners.triangle(*t), rows, columns) };
                }
            }
        }
    }
}
