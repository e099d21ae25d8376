//! The corners of a cluster in pixels, and which of its triangles can be seen there.

use super::clusters::{Cluster, ClusteredMesh, VERTICES};
use super::edge::{Corner, higher};
use crate::convolve::Area;
use std::ops::Range;

/// From mesh coordinates to pixels: the pose's rotation as a quaternion, its translation, pixels per metre and the
/// place of the origin.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct View {
    pub(super) quaternion: [f64; 4],
    pub(super) translation: [f64; 3],
    pub(super) scale: f64,
    pub(super) origin_px: (f64, f64),
}

/// The vertices of the cluster at hand: pixels, and the whole numbers next to them.
#[derive(Debug, Clone, Default)]
pub(super) struct Corners {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) height: Vec<f64>,
    /// Smallest pixel not before the vertex and largest pixel not after it.
    pub(super) columns: Vec<(i32, i32)>,
    pub(super) rows: Vec<(i32, i32)>,
    /// Around the triangles below.
    pub(super) area: Area,
    /// Triangles that can reach a pixel centre.
    pub(super) reaching: Vec<Reaching>,
}

/// A triangle and the rows of the window that it crosses.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reaching {
    pub(super) corners: [u16; 3],
    pub(super) first_row: i32,
    pub(super) last_row: i32,
}

impl Corners {
    #[inline(always)]
    fn corner(&self, number: u16) -> Corner {
        let i = usize::from(number);
        Corner { x_px: self.x[i], y_px: self.y[i], height_px: self.height[i], number: u32::from(number) }
    }

    /// Written out: the compiler does not take the functions of arrays into code for a vector unit.
    #[inline(always)]
    pub(super) fn triangle(&self, [a, b, c]: [u16; 3]) -> [Corner; 3] {
        [self.corner(a), self.corner(b), self.corner(c)]
    }

    /// The vertices of a cluster in pixels, with the operations of `gel_from_mesh * vertex` in their order.
    #[inline(always)]
    pub(super) fn transform(&mut self, mesh: &ClusteredMesh, cluster: &Cluster, view: &View) {
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
    pub(super) fn select(
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
