//! From the pressure of every pixel to a few cells with the same force and moments.

mod cell_map;

pub use cell_map::CellMap;

use crate::convolve::Area;
use crate::grid::{Grid, Plane};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::{ContactPatch, PressureCell};

/// Cells along each side of the contact's bounding box.
const CELLS_PER_SIDE: usize = 8;

/// Where the cells of a patch are: the box that was cut, on which grid, and one bit for each of its places that holds a cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CellPlaces {
    grid: Grid,
    pub(crate) area: Area,
    held: u64,
}

/// Sums of force over positions.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    force: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    fn add(&mut self, force: f64, x: f64, y: f64) {
        self.force += force;
        self.x += force * x;
        self.y += force * y;
        self.xx += force * x * x;
        self.xy += force * x * y;
        self.yy += force * y * y;
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            force: self.force + other.force,
            x: self.x + other.x,
            y: self.y + other.y,
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// Central second moments (xx, xy, yy).
    fn central(&self) -> (f64, f64, f64) {
        let f = self.force;
        (self.xx - self.x * self.x / f, self.xy - self.x * self.y / f, self.yy - self.y * self.y / f)
    }
}

/// Sums over the pixels of a cell; u and v count columns and rows from the first of the contact.
#[derive(Debug, Clone, Copy, Default)]
struct CellSum {
    pixels: f64,
    depth: f64,
    u: f64,
    v: f64,
    uu: f64,
    uv: f64,
    vv: f64,
}

struct CellSums<'a> {
    depth_px: &'a Plane,
    area: Area,
}

impl Kernel for CellSums<'_> {
    type Output = [CellSum; CELLS_PER_SIDE * CELLS_PER_SIDE];
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> Self::Output {
        let area = self.area;
        let (nx, ny) = (area.x.1 - area.x.0, area.y.1 - area.y.0);
        let mut cells = [CellSum::default(); CELLS_PER_SIDE * CELLS_PER_SIDE];
        let [mut pixels, mut depth, mut along_v, mut along_vv] = [0, 1, 2, 3].map(|_| vec![0.0; nx]);
        for (k, of_row) in cells.chunks_exact_mut(CELLS_PER_SIDE).enumerate() {
            for sums in [&mut pixels, &mut depth, &mut along_v, &mut along_vv] {
                sums.fill(0.0);
            }
            for y in cell_range(k, ny) {
                let row = &self.depth_px.row(area.y.0 + y)[area.x.0..area.x.1];
                let v = y as f64;
                let (pixels, depth) = (&mut pixels[..nx], &mut depth[..nx]);
                let (along_v, along_vv) = (&mut along_v[..nx], &mut along_vv[..nx]);
                for x in 0..nx {
                    let d = f64::from(row[x]);
                    pixels[x] += if d > 0.0 { 1.0 } else { 0.0 };
                    depth[x] += d;
                    along_v[x] += d * v;
                    along_vv[x] += d * (v * v);
                }
            }
            for (column, cell) in of_row.iter_mut().enumerate() {
                for x in cell_range(column, nx) {
                    let u = x as f64;
                    cell.pixels += pixels[x];
                    cell.depth += depth[x];
                    cell.u += depth[x] * u;
                    cell.uu += depth[x] * (u * u);
                    cell.v += along_v[x];
                    cell.uv += along_v[x] * u;
                    cell.vv += along_vv[x];
                }
            }
        }
        cells
    }
}

/// The pixels of cell `k` of `n` pixels in a row: pixel i is in cell `8 i / n`.
fn cell_range(k: usize, n: usize) -> std::ops::Range<usize> {
    (k * n).div_ceil(CELLS_PER_SIDE)..((k + 1) * n).div_ceil(CELLS_PER_SIDE)
}

/// Aggregates a depth map, whose pressure is proportional to depth and sums to `force_n`.
///
/// The contact's bounding box is cut into 8 x 8 cells with a force and a centre of pressure each. Second moments
/// shrink when pixels are merged; a linear map of the cells about the common centre (the Cholesky factor of the
/// field's second moments over that of the cells') gives them back exactly.
///
/// Sums run over the rows of a cell for each column, then over columns, then over cells.
pub(crate) fn aggregate(
    depth_px: &Plane,
    grid: &Grid,
    force_n: f64,
    level: SimdLevel,
) -> (ContactPatch, CellPlaces) {
    let area = Area::of_positive(depth_px, level);
    if area.is_empty() {
        return Default::default();
    }
    let sums = level.run(CellSums { depth_px, area });
    let total: f64 = sums.iter().map(|cell| cell.depth).sum();
    // From columns and rows of the contact to places on the gel.
    let (x0, y0) = grid.centre_m(area.x.0, area.y.0);
    let (a, per_depth) = (grid.metres_per_px, force_n / total);
    let cells = sums.map(|s| Moments {
        force: per_depth * s.depth,
        x: per_depth * (x0 * s.depth + a * s.u),
        y: per_depth * (y0 * s.depth + a * s.v),
        xx: per_depth * (x0 * x0 * s.depth + 2.0 * x0 * a * s.u + a * a * s.uu),
        xy: per_depth * (x0 * y0 * s.depth + a * (x0 * s.v + y0 * s.u) + a * a * s.uv),
        yy: per_depth * (y0 * y0 * s.depth + 2.0 * y0 * a * s.v + a * a * s.vv),
    });
    let all = cells.iter().fold(Moments::default(), |sum, cell| sum.plus(cell));
    let mut merged = Moments::default();
    let mut patch = ContactPatch::default();
    for (m, pixels) in cells.iter().zip(sums.map(|s| s.pixels)).filter(|(_, pixels)| *pixels > 0.0) {
        let (x_m, y_m) = (m.x / m.force, m.y / m.force);
        merged.add(m.force, x_m, y_m);
        let area_m2 = pixels * grid.metres_per_px * grid.metres_per_px;
        patch.cells.push(PressureCell { x_m, y_m, area_m2, force_n: m.force });
    }
    restore_second_moments(&mut patch, &all, &merged);
    let held = sums.iter().rev().fold(0, |bits, s| (bits << 1) | u64::from(s.pixels > 0.0));
    (patch, CellPlaces { grid: *grid, area, held })
}

fn restore_second_moments(patch: &mut ContactPatch, all: &Moments, merged: &Moments) {
    let (wanted, have) = (all.central(), merged.central());
    let tiny = 1e-12 * (wanted.0 + wanted.2);
    if have.0 <= tiny || have.2 <= tiny {
        // A line along one axis (or one cell): stretch the axis that has an extent.
        let scale = |wanted: f64, have: f64| if have > tiny { (wanted / have).sqrt() } else { 1.0 };
        let (sx, sy) = (scale(wanted.0, have.0), scale(wanted.2, have.2));
        return transform(patch, all, [sx, 0.0, sy]);
    }
    // Lower Cholesky factors: M = L L^T.
    let factor = |(xx, xy, yy): (f64, f64, f64)| {
        let a = xx.sqrt();
        let b = xy / a;
        (a, b, (yy - b * b).max(0.0).sqrt())
    };
    let (wa, wb, wc) = factor(wanted);
    let (ha, hb, hc) = factor(have);
    if hc <= tiny.sqrt() {
        return transform(patch, all, [wa / ha, 0.0, wa / ha]);
    }
    // L_wanted L_have^-1, lower triangular.
    let yy = wc / hc;
    transform(patch, all, [wa / ha, (wb - yy * hb) / ha, yy]);
}

/// Maps the cells about the centre of pressure by the lower triangular matrix [xx, yx, yy].
fn transform(patch: &mut ContactPatch, all: &Moments, [xx, yx, yy]: [f64; 3]) {
    let (cx, cy) = (all.x / all.force, all.y / all.force);
    for cell in &mut patch.cells {
        let (dx, dy) = (cell.x_m - cx, cell.y_m - cy);
        cell.x_m = cx + xx * dx;
        cell.y_m = cy + yx * dx + yy * dy;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments_of_patch(patch: &ContactPatch) -> Moments {
        let mut m = Moments::default();
        for c in &patch.cells {
            m.add(c.force_n, c.x_m, c.y_m);
        }
        m
    }

    #[test]
    fn force_first_and_second_moments_are_kept() {
        let grid = Grid { width_px: 120, height_px: 90, metres_per_px: 1e-4 };
        type Shape = fn(f64, f64) -> f64;
        let shapes: [(&str, Shape); 5] = [
            ("ellipse", |x, y| 1.0 - (x / 3e-3).powi(2) - (y / 1.7e-3).powi(2)),
            ("tilted ridge", |x, y| 0.3 - ((0.8 * x - 0.6 * y) / 1e-3).powi(2)),
            ("two islands", |x, y| {
                (0.2 - ((x - 3e-3) / 2e-3).powi(2) - (y / 1e-3).powi(2))
                    .max(0.5 - ((x + 2e-3) / 1e-3).powi(2) - ((y - 2e-3) / 1e-3).powi(2))
            }),
            ("one row", |_, y| if (0.0..1e-4).contains(&y) { 1.0 } else { 0.0 }),
            (
                "one pixel",
                |x, y| if (0.0..1e-4).contains(&x) && (0.0..1e-4).contains(&y) { 1.0 } else { 0.0 },
            ),
        ];
        for (name, shape) in shapes {
            let depth = grid.plane(|x, y| shape(x, y).max(0.0));
            let total: f64 = depth.values.iter().map(|&d| f64::from(d)).sum();
            let mut exact = Moments::default();
            for y in 0..90 {
                for x in 0..120 {
                    let (px, py) = grid.centre_m(x, y);
                    exact.add(40.0 * f64::from(depth.at(x, y)) / total, px, py);
                }
            }
            let patch = aggregate(&depth, &grid, 40.0, SimdLevel::best()).0;
            assert!(patch.cells.len() <= ContactPatch::MAX_CELLS);
            let m = moments_of_patch(&patch);
            let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-9 * scale;
            assert!(close(m.force, 40.0, 40.0), "{name}: force");
            assert!(close(m.x, exact.x, 40.0 * 1e-2) && close(m.y, exact.y, 40.0 * 1e-2), "{name}: first");
            let scale = 40.0 * 1e-4;
            assert!(
                close(m.xx, exact.xx, scale) && close(m.xy, exact.xy, scale) && close(m.yy, exact.yy, scale),
                "{name}: second"
            );
            let pixels = depth.values.iter().filter(|&&d| d > 0.0).count() as f64;
            assert!(close(patch.area_m2(), pixels * 1e-8, 1e-4), "{name}: area");
        }
    }
}
