//! From the pressure of every pixel to a few cells with the same force and moments.

use crate::grid::{Grid, Plane};
use gripgen_twin::{ContactPatch, PressureCell};

/// Cells along each side of the contact's bounding box.
const CELLS_PER_SIDE: usize = 8;

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

    /// Central second moments (xx, xy, yy).
    fn central(&self) -> (f64, f64, f64) {
        let f = self.force;
        (self.xx - self.x * self.x / f, self.xy - self.x * self.y / f, self.yy - self.y * self.y / f)
    }
}

/// Aggregates a depth map, whose pressure is proportional to depth and sums to `force_n`.
///
/// The contact's bounding box is cut into 8 x 8 cells with a force and a centre of pressure each. Second moments
/// shrink when pixels are merged; a linear map of the cells about the common centre (the Cholesky factor of the
/// field's second moments over that of the cells') gives them back exactly.
pub(crate) fn aggregate(depth_px: &Plane, grid: &Grid, force_n: f64) -> ContactPatch {
    let (mut low, mut high) = ((usize::MAX, usize::MAX), (0, 0));
    let mut total = 0.0;
    for y in 0..depth_px.height {
        for (x, &d) in depth_px.row(y).iter().enumerate() {
            if d > 0.0 {
                low = (low.0.min(x), low.1.min(y));
                high = (high.0.max(x), high.1.max(y));
                total += f64::from(d);
            }
        }
    }
    if total == 0.0 {
        return ContactPatch::default();
    }
    let (nx, ny) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let mut all = Moments::default();
    let mut cells = [(Moments::default(), 0usize); CELLS_PER_SIDE * CELLS_PER_SIDE];
    for y in low.1..=high.1 {
        for x in low.0..=high.0 {
            let depth = depth_px.at(x, y);
            if depth > 0.0 {
                let (px, py) = grid.centre_m(x, y);
                let force = force_n * f64::from(depth) / total;
                all.add(force, px, py);
                let cell =
                    (y - low.1) * CELLS_PER_SIDE / ny * CELLS_PER_SIDE + (x - low.0) * CELLS_PER_SIDE / nx;
                cells[cell].0.add(force, px, py);
                cells[cell].1 += 1;
            }
        }
    }
    let mut merged = Moments::default();
    let mut patch = ContactPatch::default();
    for (m, pixels) in cells.iter().filter(|(_, pixels)| *pixels > 0) {
        let (x_m, y_m) = (m.x / m.force, m.y / m.force);
        merged.add(m.force, x_m, y_m);
        let area_m2 = *pixels as f64 * grid.metres_per_px * grid.metres_per_px;
        patch.cells.push(PressureCell { x_m, y_m, area_m2, force_n: m.force });
    }
    restore_second_moments(&mut patch, &all, &merged);
    patch
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
            let mut depth = Plane::filled(120, 90, 0.0);
            let mut exact = Moments::default();
            let mut total = 0.0;
            for y in 0..90 {
                for x in 0..120 {
                    let (px, py) = grid.centre_m(x, y);
                    let d = shape(px, py).max(0.0) as f32;
                    depth.values[y * 120 + x] = d;
                    total += f64::from(d);
                }
            }
            for y in 0..90 {
                for x in 0..120 {
                    let (px, py) = grid.centre_m(x, y);
                    exact.add(40.0 * f64::from(depth.at(x, y)) / total, px, py);
                }
            }
            let patch = aggregate(&depth, &grid, 40.0);
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
