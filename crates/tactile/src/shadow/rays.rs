//! Casting the rays of a shadow table from the rim of a contact.

use super::Relief;
use super::table::{ShadowKind, ShadowTable};
use crate::colour::Sectors;

/// Half opening of the fan of rays, and the angle between two of them (`fan_angle`, `fan_precision` of Taxim's source).
const FAN_RAD: (f64, f64) = (0.1, 0.05);

/// A pixel as far from the border as pixels of images are: adding it rounds positions as Taxim does, which adds a
/// fraction to a pixel and cuts.
const FAR_PX: f64 = 512.0;

/// One target of a ray: where it lies from the origin, and its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    pub(crate) dx: i32,
    pub(crate) dy: i32,
    pub(crate) value: [f32; 4],
}

/// A table laid out for one pixel size: the pixels of each fan of rays, every pixel once.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rays {
    pub(crate) sectors: Sectors,
    pub(crate) heights: usize,
    /// Begin and number of rows, in pixels of height; and whether other heights use the first and the last one.
    pub(crate) first_px: f64,
    pub(crate) per_px: f64,
    pub(crate) clamped: bool,
    pub(crate) targets: Vec<Target>,
    /// For direction `n` and row `h`, at `n * heights + h`: its targets, and their largest distance along an axis.
    pub(crate) fans: Vec<(usize, usize, i32)>,
}

impl Rays {
    pub(super) fn new(table: &ShadowTable, metres_per_px: f64) -> Self {
        let step_px = table.step_m / metres_per_px;
        let mut targets = Vec::new();
        let mut fans = Vec::with_capacity(table.rays.len());
        for (i, ray) in table.rays.iter().enumerate() {
            let from = targets.len();
            fan(table.directions_rad[i / table.heights], step_px, ray, &mut targets);
            let reach = targets[from..].iter().map(|t: &Target| t.dx.abs().max(t.dy.abs())).max();
            fans.push((from, targets.len(), reach.unwrap_or(0)));
        }
        let count = table.directions_rad.len();
        Self {
            sectors: Sectors::new(table.direction_step_rad(), count),
            heights: table.heights,
            first_px: table.first_height_m / metres_per_px,
            per_px: metres_per_px / table.height_step_m,
            clamped: table.kind == ShadowKind::Darkening,
            targets,
            fans,
        }
    }

    /// Lowers the first three lanes of `pixels` to the values of the rays; the fourth is the height of the surface. A
    /// ray only darkens what lies lower than its origin. Nothing but minima: the order does not matter.
    pub(super) fn cast(&self, relief: &Relief<'_>, rim: &[u8], pixels: &mut [[f32; 4]]) {
        let (w, h) = (relief.along_x.width, relief.along_x.height);
        for (y, row) in rim.chunks_exact(w).enumerate() {
            for (x, _) in row.iter().enumerate().filter(|(_, at_rim)| **at_rim != 0) {
                let Some(&(from, to, reach)) = self.fan_of(relief, y * w + x) else { continue };
                let origin = y * w + x;
                let height = pixels[origin][3];
                let (x, y, reach) = (x as i32, y as i32, reach + 1);
                let targets = &self.targets[from..to];
                if x >= reach && y >= reach && x + reach < w as i32 && y + reach < h as i32 {
                    for target in targets {
                        let at = origin as i32 + target.dy * w as i32 + target.dx;
                        lower(&mut pixels[at as usize], height, target);
                    }
                    continue;
                }
                // Cutting a position just outside, between -1 and 0, gives pixel 0.
                let cut = |at: i32| if at == -1 { 0 } else { at };
                for target in targets {
                    let (tx, ty) = (cut(x + target.dx), cut(y + target.dy));
                    if tx >= 0 && ty >= 0 && tx < w as i32 && ty < h as i32 {
                        lower(&mut pixels[ty as usize * w + tx as usize], height, target);
                    }
                }
            }
        }
    }

    fn fan_of(&self, relief: &Relief<'_>, at: usize) -> Option<&(usize, usize, i32)> {
        let row = ((f64::from(relief.raised_px.values[at]) - self.first_px) * self.per_px).floor();
        let last = self.heights as f64 - 1.0;
        // Taxim's table ends where its rows end. Our own goes on with its last row, and with its first one down to
        // half of that row's height.
        let half = 0.5 * self.first_px <= f64::from(relief.raised_px.values[at]);
        let row = if self.clamped && half { row.clamp(0.0, last) } else { row };
        if !(0.0..=last).contains(&row) {
            return None;
        }
        let (gx, gy) = (relief.along_x.values[at], relief.along_y.values[at]);
        let slope = (gx * gx + gy * gy).sqrt();
        let direction =
            if slope > 0.0 { self.sectors.of(gx / slope, gy / slope) } else { self.sectors.of(1.0, 0.0) };
        self.fans.get(direction * self.heights + row as usize)
    }
}

/// Lowers what lies deeper than the origin. Without a branch: whether it does is hard to foresee.
#[inline(always)]
fn lower(pixel: &mut [f32; 4], height: f32, target: &Target) {
    let lower = height > pixel[3];
    let limit = target.value.map(|value| if lower { value } else { f32::INFINITY });
    for lane in 0..4 {
        pixel[lane] = if limit[lane] < pixel[lane] { limit[lane] } else { pixel[lane] };
    }
}

/// The pixels that the fan around one direction hits from step 1 on, each once with the least value. A shorter channel
/// leaves infinity.
fn fan(direction_rad: f64, step_px: f64, ray: &[Vec<f32>; 3], targets: &mut Vec<Target>) {
    let steps = ray.iter().map(Vec::len).max().unwrap_or(0);
    let (half, between) = FAN_RAD;
    // numpy's arange(direction - half, direction + half, between): rounding decides whether the last ray is there.
    let (start, stop) = (direction_rad - half, direction_rad + half);
    let rays = ((stop - start) / between).ceil() as usize;
    let delta = (start + between) - start;
    let mut hit = Vec::new();
    for i in 0..rays {
        let angle = start + i as f64 * delta;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        for s in 1..steps {
            let along = step_px * s as f64;
            let cut = |d: f64| ((FAR_PX + d).floor() - FAR_PX) as i32;
            let value = |c: usize| ray[c].get(s).copied().unwrap_or(f32::INFINITY);
            let value = [value(0), value(1), value(2), f32::INFINITY];
            hit.push(Target { dx: cut(along * cos), dy: cut(along * sin), value });
        }
    }
    hit.sort_by_key(|t| (t.dy, t.dx));
    let from = targets.len();
    for target in hit {
        match targets[from..].last_mut() {
            Some(last) if (last.dx, last.dy) == (target.dx, target.dy) => {
                for lane in 0..3 {
                    last.value[lane] = last.value[lane].min(target.value[lane]);
                }
            }
            _ => targets.push(target),
        }
    }
}
