//! The frame at rest and its noise, from pixels far from the contact over all presses.

use crate::grid::{Grid, Plane};
use crate::presses::{Contact, Press};
use gripgen_twin::TactileImage;

/// Distance from the rim of a contact beyond which a pixel counts as far.
const FAR_MM: f64 = 2.6;

/// Side of the squares within which smooth differences are removed from the noise.
const SQUARE_MM: f64 = 1.2;

/// How much a frame without contact counts beside a far pixel of a press: it is one raw frame, and from another time.
const RAW_REST_WEIGHT: f64 = 0.02;

/// Mean over the presses of their image less its modelled change, far pixels first.
///
/// Without a model (no `change`) the pixels close to a contact count next to nothing, so they only fill what no
/// press leaves far; with one they count more. A pixel that a dot of the gel hides counts as without a model.
pub(super) fn rest_frame(
    presses: &[(&Press, Contact)],
    change: impl Fn(usize) -> Option<[Plane; 3]>,
    raw: Option<&TactileImage>,
    grid: &Grid,
) -> [Vec<f32>; 3] {
    let far_px = FAR_MM * 1e-3 / grid.metres_per_px;
    let mut sums = [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0f64; grid.len()]);
    let mut weights = vec![0.0f64; grid.len()];
    for (i, (press, contact)) in presses.iter().enumerate() {
        let change = change(i);
        for (pixel, total) in weights.iter_mut().enumerate() {
            let t = (contact.beyond_rim_px(pixel, grid.width_px) / far_px).clamp(0.0, 1.0);
            let change = change.as_ref().filter(|_| !press.hides(pixel));
            let weight = match change {
                None => 1e-4 + t * t * t * t,
                Some(_) => 1e-2 + t * t,
            };
            *total += weight;
            for (c, sum) in sums.iter_mut().enumerate() {
                let modelled = change.map_or(0.0, |planes| planes[c].values[pixel]);
                sum[pixel] += weight * (f64::from(press.image.rgb[3 * pixel + c]) - f64::from(modelled));
            }
        }
    }
    if let Some(raw) = raw {
        for (pixel, total) in weights.iter_mut().enumerate() {
            *total += RAW_REST_WEIGHT;
            for (c, sum) in sums.iter_mut().enumerate() {
                sum[pixel] += RAW_REST_WEIGHT * f64::from(raw.rgb[3 * pixel + c]);
            }
        }
    }
    sums.map(|sum| sum.iter().zip(&weights).map(|(s, w)| (s / w).clamp(0.0, 255.0) as f32).collect())
}

/// Standard deviation of the noise of red, green and blue: the median over far squares of the variance within the
/// square, less the 1/12 of rounding to whole grey levels.
pub(super) fn noise_rgb(presses: &[(&Press, Contact)], rest: &[Vec<f32>; 3], grid: &Grid) -> [f32; 3] {
    let side = ((SQUARE_MM * 1e-3 / grid.metres_per_px).round() as usize).clamp(3, 64);
    let far_px = FAR_MM * 1e-3 / grid.metres_per_px;
    let mut variances = [const { Vec::new() }; 3];
    for (press, contact) in presses {
        for top in (0..grid.height_px.saturating_sub(side - 1)).step_by(side) {
            for left in (0..grid.width_px.saturating_sub(side - 1)).step_by(side) {
                let middle = (top + side / 2) * grid.width_px + left + side / 2;
                if contact.beyond_rim_px(middle, grid.width_px) < far_px {
                    continue;
                }
                let rows = (top..top + side).map(|y| y * grid.width_px + left);
                let square: Vec<usize> =
                    rows.flat_map(|first| first..first + side).filter(|&pixel| !press.hides(pixel)).collect();
                if 2 * square.len() < side * side {
                    continue;
                }
                for (c, list) in variances.iter_mut().enumerate() {
                    let (mut sum, mut squares) = (0.0f64, 0.0f64);
                    for &pixel in &square {
                        let d = f64::from(press.image.rgb[3 * pixel + c]) - f64::from(rest[c][pixel]);
                        sum += d;
                        squares += d * d;
                    }
                    let n = square.len() as f64;
                    list.push((squares - sum * sum / n) / (n - 1.0));
                }
            }
        }
    }
    // The rest frame is a mean over the presses and hides its share of the noise.
    let n = presses.len() as f64;
    let hidden = if n > 1.0 { n / (n - 1.0) } else { 1.0 };
    variances.map(|mut list| {
        list.sort_by(f64::total_cmp);
        let median = list.get(list.len() / 2).copied().unwrap_or(0.0);
        (median * hidden - 1.0 / 12.0).max(0.0).sqrt() as f32
    })
}
