//! Slopes of a contact along and across a pull, as friction needs them.

use crate::grid::{Grid, Plane};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::ContactSlopes;

/// Steepest slope that counts, of 60 degrees: flanks beyond it stand in no contact of a gel that is blurred.
const STEEPEST: f64 = 1.732;

/// Slopes below this are the rounding of a flat face.
const FLAT: f64 = 1e-6;

/// Standard deviations to which the blur reaches.
const REACH: f64 = 3.0;

/// Moments of the slopes of a contact, weighted with its pressure, which is proportional to depth.
///
/// `depth_px` is the depth of the part in the gel in pixels, 0 without contact. It is blurred with a Gaussian of `smoothing_m` over pixels in contact alone,
/// as the skin of a gel bridges sharp corners; a flat face stays flat up to its rim. `along` is the unit vector of the pull in the `gel`
/// frame. The slope q along the pull is that which resists: positive where the part gets shallower ahead. Means are subtracted: a
/// face that is inclined as a whole is a wedge, which effects of the jaws have. The same bits at every SIMD level.
pub fn contact_slopes(
    depth_px: &Plane,
    grid: &Grid,
    smoothing_m: f64,
    along: [f64; 2],
    level: SimdLevel,
) -> ContactSlopes {
    let Some(boxed) = Boxed::of(depth_px) else { return ContactSlopes::default() };
    let surface = boxed.blurred(smoothing_m / grid.metres_per_px, level);
    let (mut rows, mut sums) = (Vec::new(), [0.0; 3]);
    for y in 0..boxed.height {
        for x in 0..boxed.width {
            let weight = boxed.depth[y * boxed.width + x];
            if weight <= 0.0 {
                continue;
            }
            let [right, down] = boxed.gradient(&surface, x, y);
            let q = -(right * along[0] + down * along[1]);
            let s = right * along[1] - down * along[0];
            sums = [sums[0] + weight, sums[1] + weight * q, sums[2] + weight * s];
            rows.push([weight, q, s]);
        }
    }
    let [total, mean_q, mean_s] = [sums[0], sums[1] / sums[0], sums[2] / sums[0]];
    let mut moments = [0.0; 4];
    for [weight, q, s] in rows {
        let clean = |slope: f64| if slope.abs() < FLAT { 0.0 } else { slope.clamp(-STEEPEST, STEEPEST) };
        let (q, s) = (clean(q - mean_q), clean(s - mean_s));
        let across = (1.0 + s * s).sqrt();
        let a = q / across;
        let stretch = across * (1.0 + a * a);
        let terms = [stretch - 1.0, stretch * a, stretch * a * a, stretch * a * a * a];
        moments.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight / total * term);
    }
    ContactSlopes { moments }
}

/// A contact within its bounding box.
struct Boxed {
    width: usize,
    height: usize,
    /// Depths, 0 without contact.
    depth: Vec<f64>,
}

impl Boxed {
    fn of(depth_px: &Plane) -> Option<Self> {
        let touched = |y: usize| depth_px.row(y).iter().any(|&d| d > 0.0);
        let first = (0..depth_px.height).find(|&y| touched(y))?;
        let last = (0..depth_px.height).rev().find(|&y| touched(y))?;
        let rows = || (first..=last).map(|y| depth_px.row(y));
        let left = rows().filter_map(|row| row.iter().position(|&d| d > 0.0)).min()?;
        let right = rows().filter_map(|row| row.iter().rposition(|&d| d > 0.0)).max()?;
        let depth = rows().flat_map(|row| row[left..=right].iter().map(|&d| f64::from(d).max(0.0)));
        Some(Self { width: right - left + 1, height: last - first + 1, depth: depth.collect() })
    }

    /// Depths blurred over pixels in contact; 0 elsewhere.
    fn blurred(&self, sigma_px: f64, level: SimdLevel) -> Vec<f64> {
        if sigma_px <= 0.0 {
            return self.depth.clone();
        }
        let reach = (REACH * sigma_px).ceil() as usize;
        let weights: Vec<f64> =
            (0..=reach).map(|i| libm::exp(-0.5 * (i as f64 / sigma_px) * (i as f64 / sigma_px))).collect();
        let mask: Vec<f64> = self.depth.iter().map(|&d| if d > 0.0 { 1.0 } else { 0.0 }).collect();
        let blur = |plane: &[f64]| level.run(Blur { plane, width: self.width, weights: &weights });
        let (depth, share) = (blur(&self.depth), blur(&mask));
        let inside = mask.iter().zip(depth.iter().zip(&share));
        inside.map(|(&m, (d, share))| if m > 0.0 { d / share } else { 0.0 }).collect()
    }

    /// Rise to the right and downwards between neighbours in contact, 0 where there is none.
    fn gradient(&self, surface: &[f64], x: usize, y: usize) -> [f64; 2] {
        let held = |x: usize, y: usize| self.depth[y * self.width + x] > 0.0;
        let at = |x: usize, y: usize| surface[y * self.width + x];
        let right = x + 1 < self.width && held(x + 1, y);
        let left = x > 0 && held(x - 1, y);
        let down = y + 1 < self.height && held(x, y + 1);
        let up = y > 0 && held(x, y - 1);
        let between = |low: (bool, f64), high: (bool, f64)| match (low.0, high.0) {
            (true, true) => 0.5 * (high.1 - low.1),
            (true, false) => at(x, y) - low.1,
            (false, true) => high.1 - at(x, y),
            (false, false) => 0.0,
        };
        let value = |there: bool, x: usize, y: usize| (there, if there { at(x, y) } else { 0.0 });
        [
            between(value(left, x.saturating_sub(1), y), value(right, x + 1, y)),
            between(value(up, x, y.saturating_sub(1)), value(down, x, y + 1)),
        ]
    }
}

/// A convolution along rows, then along columns, with nothing outside the plane.
struct Blur<'a> {
    plane: &'a [f64],
    width: usize,
    /// Weight of the centre and of each pixel to one side.
    weights: &'a [f64],
}

impl Kernel for Blur<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> Vec<f64> {
        let Self { plane, width, weights } = self;
        let (reach, height) = (weights.len() - 1, plane.len() / width);
        let mut padded = vec![0.0; width + 2 * reach];
        let mut rows = vec![0.0; plane.len()];
        for (row, out) in plane.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            padded[reach..reach + width].copy_from_slice(row);
            weighted(out, weights, |i, ahead| &padded[if ahead { reach + i } else { reach - i }..][..width]);
        }
        let nothing = vec![0.0; width];
        let mut out = vec![0.0; plane.len()];
        for (y, out) in out.chunks_exact_mut(width).enumerate() {
            weighted(out, weights, |i, ahead| {
                let row = if ahead { Some(y + i).filter(|&y| y < height) } else { y.checked_sub(i) };
                row.map_or(&nothing[..], |y| &rows[y * width..][..width])
            });
        }
        out
    }
}

/// `out = w_0 a_0 + sum_i w_i (a_-i + a_i)` of lines `a_i` (ahead) and `a_-i`, from the centre outwards.
#[inline(always)]
fn weighted<'a>(out: &mut [f64], weights: &[f64], line: impl Fn(usize, bool) -> &'a [f64]) {
    out.iter_mut().zip(line(0, true)).for_each(|(sum, a)| *sum = weights[0] * a);
    for (i, weight) in weights.iter().enumerate().skip(1) {
        let pairs = line(i, false).iter().zip(line(i, true));
        out.iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += weight * (a + b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width_px: 240, height_px: 240, metres_per_px: 5e-5 };
    const UP: [f64; 2] = [0.0, -1.0];

    fn depth(f: impl Fn(f64, f64) -> f64) -> Plane {
        GRID.plane(|x, y| (f(x, y) / GRID.metres_per_px).max(0.0))
    }

    fn slopes(depth_px: &Plane, grid: &Grid, smoothing_m: f64, along: [f64; 2]) -> ContactSlopes {
        let [first, others @ ..] = &SimdLevel::available()[..] else { unreachable!() };
        let found = contact_slopes(depth_px, grid, smoothing_m, along, *first);
        for &level in others {
            assert_eq!(found, contact_slopes(depth_px, grid, smoothing_m, along, level), "{level:?}");
        }
        found
    }

    /// A wave of flanks of one slope T: mu_eff = mu (1 + T^2) / (1 - mu^2 T^2) across its crests and mu sqrt(1 + T^2) along them.
    #[test]
    fn a_saw_of_one_slope_is_the_closed_form() {
        let (slope, pitch) = (0.6, 2e-3);
        let saw = |t: f64| slope * ((t / pitch).rem_euclid(1.0) - 0.5).abs() * pitch;
        let across = depth(|_, y| 1e-3 + saw(y));
        for mu in [0.05, 0.15, 0.3] {
            let found = slopes(&across, &GRID, 0.0, UP).coefficient(mu, 1.0);
            let wanted = mu * (1.0 + slope * slope) / (1.0 - (mu * slope).powi(2));
            assert!((found / wanted - 1.0).abs() < 0.03, "mu {mu}: {found} and {wanted}");
            let along = slopes(&across, &GRID, 0.0, [1.0, 0.0]).coefficient(mu, 1.0);
            let wanted = mu * (1.0 + slope * slope).sqrt();
            assert!((along / wanted - 1.0).abs() < 0.03, "mu {mu}: {along} and {wanted}");
        }
    }

    /// A face without friction resists nothing, whatever its shape; a flat one changes no bit, tilted or not.
    #[test]
    fn no_friction_holds_nothing_and_flat_faces_are_coulombs() {
        let bumps = depth(|x, y| 6e-4 + 3e-4 * (2e3 * x).sin() * (3e3 * y).cos() + 0.05 * y);
        assert_eq!(slopes(&bumps, &GRID, 3e-4, UP).coefficient(0.0, 1.0), 0.0);
        let stamp =
            |tilt: f64| depth(|x, y| if x.abs() < 3e-3 && y.abs() < 4e-3 { 1e-3 + tilt * y } else { 0.0 });
        for tilt in [0.0, 0.05] {
            let slopes = slopes(&stamp(tilt), &GRID, 0.0, UP);
            assert!((slopes.coefficient(0.2, 1.0) - 0.2).abs() < 1e-6, "{slopes:?}");
        }
        let flat = slopes(&stamp(0.0), &GRID, 3e-4, UP);
        assert_eq!(flat.coefficient(0.2, 1.0).to_bits(), 0.2_f64.to_bits());
    }

    /// Blurred with a Gaussian of sd s, a sine of wave number k keeps exp(-k^2 s^2 / 2) of its height.
    #[test]
    fn smoothing_flattens_as_a_gaussian_does() {
        let (k, s, height) = (2.0 * std::f64::consts::PI / 1.5e-3, 1.5e-4, 1e-4);
        let wave = depth(|_, y| 1e-3 + height * (k * y).sin());
        let kept = (-0.5 * (k * s).powi(2)).exp();
        let mean_square = |keep: f64| 0.5 * (height * k * keep).powi(2);
        for (smoothing_m, keep) in [(0.0, 1.0), (s, kept)] {
            let excess = slopes(&wave, &GRID, smoothing_m, UP).coefficient(1e-6, 1.0) / 1e-6 - 1.0;
            // The rim, where half of the blur has no contact, is a thirteenth of the contact.
            assert!((excess / mean_square(keep) - 1.0).abs() < 0.07, "{excess} and {}", mean_square(keep));
        }
        let off = slopes(&wave, &GRID, s, UP).coefficient(0.2, 0.0);
        assert_eq!(off.to_bits(), 0.2_f64.to_bits());
    }
}
