//! Drawing the clusters of a mesh from the top down, as deep as needed.

use super::clusters::{Cluster, ClusteredMesh, VERTICES};
use super::edge::{Corner, higher};
use super::fill::fill;
use super::steps::Steps;
use crate::convolve::{Area, raise};
use crate::grid::{Grid, Plane};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::frames::Pose;
use std::ops::Range;

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

/// From mesh coordinates to pixels: the pose's rotation as a quaternion, its translation, pixels per metre and the
/// place of the origin.
#[derive(Debug, Clone, Copy, Default)]
struct View {
    quaternion: [f64; 4],
    translation: [f64; 3],
    scale: f64,
    origin_px: (f64, f64),
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

/// The vertices of the cluster at hand: pixels, and the whole numbers next to them.
#[derive(Debug, Clone, Default)]
struct Corners {
    x: Vec<f64>,
    y: Vec<f64>,
    height: Vec<f64>,
    /// Smallest pixel not before the vertex and largest pixel not after it.
    columns: Vec<(i32, i32)>,
    rows: Vec<(i32, i32)>,
    /// Around the triangles below.
    area: Area,
    /// Triangles that can reach a pixel centre.
    reaching: Vec<Reaching>,
}

/// A triangle and the rows of the window that it crosses.
#[derive(Debug, Clone, Copy, Default)]
struct Reaching {
    corners: [u16; 3],
    first_row: i32,
    last_row: i32,
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

    /// Puts the mean depth at their points into these pixels; `lift` is what lies between heights and depths.
    pub(crate) fn write_steps(&self, lift: f64, depth_px: &mut Plane, level: SimdLevel) {
        self.steps.write(lift, depth_px, level);
    }

    /// The highest pixel.
    pub(crate) fn top(&self, rest: Option<&Plane>, level: SimdLevel) -> f32 {
        level.run(Top { map: self, rest })
    }

    /// Sum of `height + rest - top`, and number, of the pixels that a press touches: those above `top - press_px`.
    ///
    /// Columns are summed first, then columns from left to right, so that the sum depends on these pixels alone.
    pub(crate) fn touched(
        &self,
        rest: Option<&Plane>,
        top: f64,
        press_px: f64,
        level: SimdLevel,
    ) -> (f64, f64) {
        level.run(Touched { map: self, rest, top, press_px })
    }

    /// The values of a row within the area, `rest` added in `sums`.
    #[inline(always)]
    pub(crate) fn above_gel<'a>(
        &'a self,
        rest: Option<&Plane>,
        y: usize,
        sums: &'a mut Vec<f32>,
    ) -> &'a [f32] {
        let range = y * self.width + self.area.x.0..y * self.width + self.area.x.1;
        let row = &self.values[range.clone()];
        let Some(rest) = rest else { return row };
        sums.resize(row.len(), 0.0);
        for ((sum, h), r) in sums.iter_mut().zip(row).zip(&rest.values[range]) {
            *sum = h + r;
        }
        sums
    }

    /// The values from a place on, `-inf` after the first `n`, `rest` added.
    #[inline(always)]
    fn some_above_gel(&self, rest: Option<&Plane>, at: usize, n: usize) -> [f32; SUMMED] {
        let some = |values: &[f32]| {
            let mut some = [f32::NEG_INFINITY; SUMMED];
            if n >= SUMMED {
                some.copy_from_slice(&values[at..at + SUMMED]);
            } else {
                some[..n].copy_from_slice(&values[at..at + n]);
            }
            some
        };
        let mut row = some(&self.values);
        if let Some(rest) = rest {
            let rest = some(&rest.values);
            for i in 0..SUMMED {
                row[i] += rest[i];
            }
        }
        row
    }

    pub(crate) fn into_plane(self) -> Plane {
        Plane { width: self.width, height: self.height, values: self.values }
    }
}

struct Top<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
}

impl Kernel for Top<'_> {
    type Output = f32;
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let mut lanes = [f32::NEG_INFINITY; 32];
        let mut sums = Vec::new();
        for y in self.map.area.y.0..self.map.area.y.1 {
            let row = self.map.above_gel(self.rest, y, &mut sums);
            let (chunks, rest) = row.as_chunks::<32>();
            raise(&mut lanes, rest);
            for chunk in chunks {
                raise(&mut lanes, chunk);
            }
        }
        lanes.iter().fold(f32::NEG_INFINITY, |m, &v| if v > m { v } else { m })
    }
}

struct Touched<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
    top: f64,
    press_px: f64,
}

/// Columns that are summed at once, their sums in registers.
const SUMMED: usize = 16;

impl Kernel for Touched<'_> {
    type Output = (f64, f64);
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> (f64, f64) {
        let Self { map, rest, top, press_px } = self;
        // Nothing so low touches, whatever the rounding: rows of a block without anything higher add nothing.
        let low = ((top - press_px) as f32).next_down();
        let Area { x: (from, to), y: rows } = map.area;
        let (mut all, mut number) = (0.0, 0.0);
        for x in (from..to).step_by(SUMMED) {
            let (mut sum, mut count) = ([0.0; SUMMED], [0.0; SUMMED]);
            for y in rows.0..rows.1 {
                let row = map.some_above_gel(rest, y * map.width + x, to - x);
                if !row.iter().fold(false, |some, &h| some | (h > low)) {
                    continue;
                }
                for i in 0..SUMMED {
                    let below = f64::from(row[i]) - top;
                    let touches = below + press_px > 0.0;
                    sum[i] += if touches { below } else { 0.0 };
                    count[i] += if touches { 1.0 } else { 0.0 };
                }
            }
            for i in 0..SUMMED {
                all += sum[i];
                number += count[i];
            }
        }
        (all, number)
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

impl Corners {
    #[inline(always)]
    fn corner(&self, number: u16) -> Corner {
        let i = usize::from(number);
        Corner { x_px: self.x[i], y_px: self.y[i], height_px: self.height[i], number: u32::from(number) }
    }

    /// Written out: the compiler does not take the functions of arrays into code for a vector unit.
    #[inline(always)]
    fn triangle(&self, [a, b, c]: [u16; 3]) -> [Corner; 3] {
        [self.corner(a), self.corner(b), self.corner(c)]
    }

    /// The vertices of a cluster in pixels, with the operations of `gel_from_mesh * vertex` in their order.
    #[inline(always)]
    fn transform(&mut self, mesh: &ClusteredMesh, cluster: &Cluster, view: &View) {
        for values in [&mut self.x, &mut self.y, &mut self.height] {
            values.resize(VERTICES, 0.0);
        }
        self.columns.resize(VERTICES, (0, 0));
        self.rows.resize(VERTICES, (0, 0));
        let Range { start, end } = cluster.vertices;
        let n = end - start;
        let (x, y, z) = (&mesh.x_m[start..end], &mesh.y_m[start..end], &mesh.z_m[start..end]);
        let (px, py, ph) = (&mut self.x[..n], &mut self.y[..n], &mut self.height[..n]);
        let [qx, qy, qz, qw] = view.quaternion;
        let [tx, ty, tz] = view.translation;
        for i in 0..n {
            let (vx, vy, vz) = (x[i], y[i], z[i]);
            // t = 2 q x v, then q_w t + q x t + v.
            let (ax, ay, az) =
                ((qy * vz - qz * vy) * 2.0, (qz * vx - qx * vz) * 2.0, (qx * vy - qy * vx) * 2.0);
            let (bx, by, bz) = (qy * az - qz * ay, qz * ax - qx * az, qx * ay - qy * ax);
            px[i] = (ax * qw + bx + vx + tx) * view.scale + view.origin_px.0;
            py[i] = (ay * qw + by + vy + ty) * view.scale + view.origin_px.1;
            ph[i] = -(az * qw + bz + vz + tz) * view.scale;
        }
        let whole = |v: f64| {
            let v = v.clamp(-1e9, 1e9);
            // SAFETY: finite, since meshes and poses are, and within the range of i32.
            unsafe { (v.ceil().to_int_unchecked::<i32>(), v.floor().to_int_unchecked::<i32>()) }
        };
        for i in 0..n {
            self.columns[i] = whole(px[i]);
            self.rows[i] = whole(py[i]);
        }
    }

    /// Collects the triangles that can reach a pixel centre of the window and whose highest corner lies from the
    /// floor up to what was drawn before. Returns the height of the highest one that lies below the floor.
    #[inline(always)]
    fn select(
        &mut self,
        mesh: &ClusteredMesh,
        cluster: &Cluster,
        (width, height): (usize, usize),
        (floor_px, drawn_px): (f64, f64),
    ) -> f64 {
        let (mut left, mut count) = (f64::NEG_INFINITY, 0);
        let (mut low, mut high) = ([i32::MAX; 2], [0; 2]);
        self.reaching.resize(VERTICES / 3, Reaching::default());
        for &corners in &mesh.triangles[cluster.triangles.clone()] {
            let [a, b, c] = [usize::from(corners[0]), usize::from(corners[1]), usize::from(corners[2])];
            let span = |v: &[(i32, i32)], n: usize| {
                let first = v[a].0.min(v[b].0).min(v[c].0).max(0);
                (first, v[a].1.max(v[b].1).max(v[c].1).min(n as i32 - 1))
            };
            let ((first_row, last_row), (first_column, last_column)) =
                (span(&self.rows, height), span(&self.columns, width));
            let reaches = (first_row <= last_row) & (first_column <= last_column);
            let top = higher(higher(self.height[a], self.height[b]), self.height[c]);
            let deep = top < floor_px;
            left = if reaches & deep & (top > left) { top } else { left };
            let drawn = reaches & !deep & (top < drawn_px);
            self.reaching[count] = Reaching { corners, first_row, last_row };
            count += usize::from(drawn);
            if drawn {
                low = [low[0].min(first_column), low[1].min(first_row)];
                high = [high[0].max(last_column + 1), high[1].max(last_row + 1)];
            }
        }
        self.reaching.truncate(count);
        let range = |i: usize| (low[i] as usize, high[i] as usize);
        self.area = if count == 0 { Area::EMPTY } else { Area { x: range(0), y: range(1) } };
        left
    }
}
