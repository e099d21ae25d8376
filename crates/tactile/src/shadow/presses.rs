//! A shadow table from images of a pressed ball.

use super::rim_px;
use super::table::{ShadowKind, ShadowTable};
use crate::grid::{Grid, Plane};
use std::f64::consts::TAU;

/// Directions of the table, 0.1 rad each and a little less, as fans of rays expect.
const DIRECTIONS: usize = 63;
/// Distance of two values along a ray: 1.25 px of Taxim's sensor.
const STEP_M: f64 = 1.25 * 0.0295e-3;
/// Longest ray.
const REACH_M: f64 = 3e-3;
/// Distance of two rows of the table. The contact must not grow much within one: what lies beside a smaller contact lies
/// in a larger one.
const HEIGHT_STEP_M: f64 = 0.02e-3;
/// A ray ends where it is less dark than this in all channels.
const MIN_GREY_LEVELS: f32 = 0.5;
/// Directions on either side that are averaged with one.
const SMOOTHED_DIRECTIONS: isize = 2;

/// The image of a ball in the gel, as far as the colour model does not explain it.
#[derive(Debug, Clone, Copy)]
pub struct BallPress<'a> {
    /// Measured minus modelled grey levels: red, green, blue.
    pub residual: &'a [Plane; 3],
    /// Centre of the contact in pixels.
    pub centre_px: [f64; 2],
    /// Radius of the contact in pixels.
    pub radius_px: f64,
    /// Depth of the press.
    pub depth_m: f64,
}

/// The shadow table that explains what a colour model leaves over beside the contacts of a ball.
///
/// `restore_depth_fraction` is the share of the press above which the gel follows the part: its edge is where rays
/// start, and the height of the gel there tells the rows of the table apart. Residuals are averaged by row, direction
/// and distance from that edge, over neighbouring directions and distances too; brighter than modelled is no shadow; and a shadow
/// fades: each ray is the decreasing sequence closest to its means (pool adjacent violators; Ayer et al. 1955). Inside
/// the contact there is no shadow. Directions that no press has seen are empty; a row without a press between two that have
/// one is that of the lower one.
///
/// `None` if no press leaves a shadow.
pub fn shadow_from_presses(
    presses: &[BallPress<'_>],
    grid: &Grid,
    restore_depth_fraction: f64,
) -> Option<ShadowTable> {
    let row_of = |p: &BallPress<'_>| (restore_depth_fraction * p.depth_m / HEIGHT_STEP_M).floor();
    let usable = |p: &&BallPress<'_>| p.radius_px >= 1.0 && row_of(p).is_finite() && row_of(p) >= 0.0;
    let presses: Vec<&BallPress<'_>> = presses.iter().filter(usable).collect();
    let first = presses.iter().map(|p| row_of(p)).fold(f64::INFINITY, f64::min);
    let last = presses.iter().map(|p| row_of(p)).fold(0.0, f64::max);
    if presses.is_empty() || last - first > 4000.0 {
        return None;
    }
    let heights = (last - first) as usize + 1;
    let steps = (REACH_M / STEP_M) as usize;
    let mut means = Means { sums: vec![[0.0; 4]; DIRECTIONS * heights * steps], heights, steps };
    let mut seen = vec![false; heights];
    for press in presses {
        seen[(row_of(press) - first) as usize] = true;
        means.add(press, (row_of(press) - first) as usize, grid, restore_depth_fraction);
    }
    let mut rays: Vec<[Vec<f32>; 3]> =
        (0..DIRECTIONS * heights).map(|i| means.ray(i / heights, i % heights)).collect();
    for i in 0..rays.len() {
        if i % heights > 0 && !seen[i % heights] {
            rays[i] = rays[i - 1].clone();
        }
    }
    rays.iter().flatten().any(|ray| !ray.is_empty()).then(|| ShadowTable {
        kind: ShadowKind::Darkening,
        directions_rad: (0..DIRECTIONS).map(|i| i as f64 * TAU / DIRECTIONS as f64).collect(),
        first_height_m: first * HEIGHT_STEP_M,
        height_step_m: HEIGHT_STEP_M,
        heights,
        step_m: STEP_M,
        rays,
    })
}

/// Sums of red, green and blue, and their number, by direction, row and step.
struct Means {
    sums: Vec<[f64; 4]>,
    heights: usize,
    steps: usize,
}

impl Means {
    fn add(&mut self, press: &BallPress<'_>, row: usize, grid: &Grid, restore_depth_fraction: f64) {
        let step_px = STEP_M / grid.metres_per_px;
        // The depth under a ball falls with the square of the distance, and the core ends at its share of the press.
        let core_px = press.radius_px * (1.0 - restore_depth_fraction).max(0.0).sqrt();
        // A shadow fades, so that of all rays that reach a pixel those of the outermost origins count.
        let origin_px = core_px + rim_px(step_px) as f64 - 0.5;
        for y in 0..grid.height_px {
            for x in 0..grid.width_px {
                let (dx, dy) = (x as f64 - press.centre_px[0], y as f64 - press.centre_px[1]);
                let distance = (dx * dx + dy * dy).sqrt();
                let step = ((distance - origin_px) / step_px).round();
                if distance <= press.radius_px || !(0.0..self.steps as f64).contains(&step) {
                    continue;
                }
                let angle = libm::atan2(dy, dx).rem_euclid(TAU);
                let direction = (angle / TAU * DIRECTIONS as f64).round() as usize % DIRECTIONS;
                let at = (direction * self.heights + row) * self.steps + step as usize;
                let value = press.residual.each_ref().map(|plane| f64::from(plane.at(x, y)));
                if value.iter().all(|v| v.is_finite()) {
                    for c in 0..3 {
                        self.sums[at][c] += value[c];
                    }
                    self.sums[at][3] += 1.0;
                }
            }
        }
    }

    fn ray(&self, direction: usize, row: usize) -> [Vec<f32>; 3] {
        let around = |offset: isize| {
            let direction = (direction as isize + offset).rem_euclid(DIRECTIONS as isize) as usize;
            &self.sums[(direction * self.heights + row) * self.steps..][..self.steps]
        };
        let mut sums = vec![[0.0; 4]; self.steps];
        for offset in -SMOOTHED_DIRECTIONS..=SMOOTHED_DIRECTIONS {
            let weight = (SMOOTHED_DIRECTIONS + 1 - offset.abs()) as f64;
            for (sum, s) in sums.iter_mut().zip(around(offset)) {
                for k in 0..4 {
                    sum[k] += weight * s[k];
                }
            }
        }
        // Along the ray too, but not into the contact, where nothing was summed.
        let smoothed = |s: usize, k: usize| {
            let at = |s: usize| sums.get(s).map_or(0.0, |sum| sum[k]);
            if sums[s][3] > 0.0 { at(s.wrapping_sub(1)) + 2.0 * at(s) + at(s + 1) } else { 0.0 }
        };
        let channels = [0, 1, 2].map(|c| {
            let seen: Vec<(f64, f64)> = (0..self.steps).map(|s| (smoothed(s, c), smoothed(s, 3))).collect();
            fading(&seen)
        });
        let dark = |s: &usize| channels.iter().any(|channel| channel[*s] < -MIN_GREY_LEVELS);
        let length = (0..self.steps).rev().find(dark).map_or(0, |s| s + 1);
        channels.map(|mut channel| {
            channel.truncate(length);
            channel
        })
    }
}

/// The sequence closest to the means of `(sum, weight)` that never gets darker, at most 0; 0 before the first mean.
/// Where one is missing in between, the value before holds.
fn fading(seen: &[(f64, f64)]) -> Vec<f32> {
    // Blocks of (sum, weight, number of values).
    let mut blocks: Vec<(f64, f64, usize)> = Vec::new();
    let mut before = 0;
    for &(sum, weight) in seen {
        match blocks.last_mut() {
            None if weight <= 0.0 => before += 1,
            Some(last) if weight <= 0.0 => last.2 += 1,
            _ => blocks.push((sum, weight, 1)),
        }
        while let [.., a, b] = blocks[..]
            && a.0 / a.1 > b.0 / b.1
        {
            blocks.truncate(blocks.len() - 2);
            blocks.push((a.0 + b.0, a.1 + b.1, a.2 + b.2));
        }
    }
    let mut out = vec![0.0; before];
    for (sum, weight, count) in blocks {
        out.resize(out.len() + count, (sum / weight).min(0.0) as f32);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fading_sequence_is_the_closest_one() {
        // -10 then -12 get darker: their mean; the missing one holds; +2 is no shadow.
        let seen = [(0.0, 0.0), (-10.0, 1.0), (-24.0, 2.0), (0.0, 0.0), (-3.0, 1.0), (2.0, 1.0)];
        let ray = fading(&seen);
        let mean = -34.0 / 3.0;
        for (value, exact) in ray.iter().zip([0.0, mean, mean, mean, -3.0, 0.0]) {
            assert!((f64::from(*value) - exact).abs() < 1e-5, "{ray:?}");
        }
        assert_eq!(ray.len(), seen.len());
    }
}
