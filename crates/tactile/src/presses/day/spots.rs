//! Residuals at each place of the frame over the presses, and spots where several presses have one: scratches, dirt.

use super::Spot;
use crate::grid::islands;
use crate::presses::{ZONES, Zone};
use gripgen_twin::TactileImage;

/// How far a spot differs from its surroundings: this multiple of what pixels of its zone do, and this many grey levels.
const TIMES: f32 = 6.0;
const LEAST: f32 = 8.0;

/// Half the side of the square around a pixel that are its surroundings, and fewest pixels of a spot.
const AROUND_PX: usize = 8;
const LEAST_PX: usize = 6;

/// Spots that are named, at most.
const MOST: usize = 8;

/// How much larger than life the map is.
const ENLARGED: f32 = 8.0;

/// From the median of magnitudes to the standard deviation of a normal distribution.
const FROM_MEDIAN: f32 = 1.4826;

/// Residual of one press.
pub(super) struct Residuals {
    /// Real minus drawn.
    pub(super) grey: Vec<[f32; 3]>,
    pub(super) zones: Vec<Zone>,
}

impl Residuals {
    pub(super) fn of(real: &TactileImage, drawn: &TactileImage, zones: Vec<Zone>) -> Self {
        let pairs = real.rgb.as_chunks::<3>().0.iter().zip(drawn.rgb.as_chunks::<3>().0);
        let grey = pairs.map(|(a, b)| [0, 1, 2].map(|c| f32::from(a[c]) - f32::from(b[c]))).collect();
        Self { grey, zones }
    }

    /// Which pixels stand out: -1, 0 or 1.
    fn standing_out(&self, width: usize) -> Vec<i8> {
        let light: Vec<f32> = self.grey.iter().map(|g| (g[0] + g[1] + g[2]) / 3.0).collect();
        let near = boxes(&light, width, 1);
        let around = boxes(&light, width, AROUND_PX);
        let sharp: Vec<f32> = near.iter().zip(&around).map(|(a, b)| a - b).collect();
        let mut limits = [f32::INFINITY; ZONES.len()];
        for zone in ZONES {
            let mut list: Vec<f32> =
                sharp.iter().zip(&self.zones).filter(|(_, z)| **z == zone).map(|(v, _)| v.abs()).collect();
            list.sort_by(f32::total_cmp);
            if let Some(median) = list.get(list.len() / 2) {
                limits[zone as usize] = (TIMES * FROM_MEDIAN * median).max(LEAST);
            }
        }
        sharp
            .iter()
            .zip(&self.zones)
            .map(|(v, zone)| if v.abs() > limits[*zone as usize] { v.signum() as i8 } else { 0 })
            .collect()
    }
}

/// Means over squares of `2 half + 1` pixels, of those that lie in the frame.
fn boxes(plane: &[f32], width: usize, half: usize) -> Vec<f32> {
    let height = plane.len() / width;
    let mut sums = vec![0.0f64; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = 0.0;
        for x in 0..width {
            row += f64::from(plane[y * width + x]);
            sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
        }
    }
    let mut out = Vec::with_capacity(plane.len());
    for y in 0..height {
        let (top, bottom) = (y.saturating_sub(half), (y + half + 1).min(height));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(half), (x + half + 1).min(width));
            let at = |x: usize, y: usize| sums[y * (width + 1) + x];
            let sum = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
            out.push((sum / ((right - left) * (bottom - top)) as f64) as f32);
        }
    }
    out
}

/// Places that stand out, the same way, in two presses or more outside of the rims of their contacts: the largest first.
pub(super) fn spots(residuals: &[Residuals], known: &[bool], width: usize) -> Vec<Spot> {
    let each: Vec<Vec<i8>> = residuals.iter().map(|r| r.standing_out(width)).collect();
    let pixels = residuals.first().map_or(0, |r| r.grey.len());
    let count = |p: usize, sign: i8| {
        let seen = each.iter().zip(residuals).filter(|(out, r)| out[p] == sign && r.zones[p] != Zone::Rim);
        seen.count()
    };
    let seen_twice = (0..pixels).map(|p| known[p] && (count(p, 1) >= 2 || count(p, -1) >= 2)).collect();
    let islands = islands(seen_twice, width).into_iter().filter(|spot| spot.len() >= LEAST_PX);
    let mut found: Vec<Spot> = islands.map(|spot| named(&spot, residuals, &each, width)).collect();
    found.sort_by(|a, b| b.pixels.cmp(&a.pixels));
    found.truncate(MOST);
    found
}

fn named(spot: &[usize], residuals: &[Residuals], each: &[Vec<i8>], width: usize) -> Spot {
    let n = spot.len();
    let presses = each.iter().filter(|out| spot.iter().any(|&p| out[p] != 0)).count();
    let mean = |of: &dyn Fn(usize) -> f64| spot.iter().map(|&p| of(p)).sum::<f64>() / n as f64;
    let grey = |p: usize| {
        let sum: f32 = residuals.iter().map(|r| r.grey[p].iter().sum::<f32>() / 3.0).sum();
        f64::from(sum) / residuals.len() as f64
    };
    Spot {
        x_px: mean(&|p| (p % width) as f64),
        y_px: mean(&|p| (p / width) as f64),
        pixels: n,
        presses,
        grey: mean(&grey),
    }
}

/// Mean residual over the presses, enlarged around a middle grey.
pub(super) fn map(residuals: &[Residuals], width: usize) -> TactileImage {
    let pixels = residuals.first().map_or(0, |r| r.grey.len());
    let n = residuals.len().max(1) as f32;
    let level = |p: usize, c: usize| {
        let mean = residuals.iter().map(|r| r.grey[p][c]).sum::<f32>() / n;
        (128.0 + ENLARGED * mean).round().clamp(0.0, 255.0) as u8
    };
    let rgb = (0..pixels).flat_map(|p| [0, 1, 2].map(|c| level(p, c))).collect();
    TactileImage { width_px: width as u32, height_px: (pixels / width.max(1)) as u32, rgb }
}

#[cfg(test)]
mod tests {
    use super::*;

    const W: usize = 60;

    fn press(scratch: bool, seed: usize) -> Residuals {
        let grey = |p: usize| {
            let noise = ((p * 7919 + seed * 104_729) % 17) as f32 / 8.0 - 1.0;
            let there = scratch && (20..30).contains(&(p % W)) && (12..15).contains(&(p / W));
            [if there { -40.0 } else { noise }; 3]
        };
        Residuals { grey: (0..W * 40).map(grey).collect(), zones: vec![Zone::Far; W * 40] }
    }

    #[test]
    fn a_scratch_is_what_stands_out_in_several_presses() {
        let seen = [press(true, 1), press(true, 2), press(false, 3)];
        let found = spots(&seen, &[true; W * 40], W);
        assert_eq!(found.len(), 1, "{found:?}");
        let spot = &found[0];
        assert!((spot.x_px - 24.5).abs() < 1.0 && (spot.y_px - 13.0).abs() < 1.0, "{spot:?}");
        assert!(spot.presses == 2 && (20..60).contains(&spot.pixels) && spot.grey < -10.0, "{spot:?}");
        // What one press alone shows is no scratch.
        assert_eq!(spots(&[press(true, 1), press(false, 2), press(false, 3)], &[true; W * 40], W), vec![]);
        // The rim of a contact is drawn wrong more than anything else.
        let rim = |seed| Residuals { zones: vec![Zone::Rim; W * 40], ..press(true, seed) };
        assert_eq!(spots(&[rim(1), rim(2)], &[true; W * 40], W), vec![]);
        let map = map(&seen, W);
        assert!(map.rgb[3 * (13 * W + 25)] < 10 && map.rgb[3 * (30 * W + 5)].abs_diff(128) < 12);
    }
}
