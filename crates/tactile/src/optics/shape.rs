//! A part whose shape is not that of its mesh.

use super::kernels::discrete_gaussian;
use crate::deform::blurred;
use crate::grid::{Grid, Plane};
use crate::simd::SimdLevel;
use gripgen_twin::OpticsState;

/// Rings of the disc that grows a part: share of its radius, points on it.
const RINGS: [(f64, usize); 2] = [(0.5, 12), (1.0, 24)];

/// The imprint, as a gel `surface` in pixels towards the camera, of a part whose convex edges are blunted and whose
/// outlines lie further out: `max of min(z, z * N(0, blunting))` within the offset, the smallest one within a negative
/// offset (dilation and erosion with a disc, Serra 1982). Then all heights by one factor, so that the imprint keeps its
/// volume: `V = c F` holds for the real part.
///
/// It works on the gel and not on the part, because the gel is smooth: a part's walls lie between pixels, and moving
/// them by a share of a pixel moves either nothing or a whole pixel. So the image is a continuous function of both.
pub(super) fn part(surface: Plane, grid: &Grid, optics: &OpticsState, level: SimdLevel) -> Plane {
    let offset_px = optics.part_offset_m / grid.metres_per_px;
    let blunting_px = optics.edge_blunting_m / grid.metres_per_px;
    let volume = |plane: &Plane| plane.values.iter().map(|&z| f64::from(z)).sum::<f64>();
    let before = volume(&surface);
    let mut seen = surface;
    if blunting_px > 0.0 {
        let smooth = blurred(&seen, &discrete_gaussian(blunting_px), level);
        seen.values.iter_mut().zip(&smooth.values).for_each(|(z, s)| *z = z.min(*s));
    }
    if offset_px != 0.0 {
        seen = grown(&seen, offset_px);
    }
    let after = volume(&seen);
    if after > 0.0 {
        let factor = (before / after) as f32;
        seen.values.iter_mut().for_each(|z| *z *= factor);
    }
    seen
}

/// The largest value within `radius_px`, or the smallest one within minus a negative radius. Values between pixels are
/// interpolated and the points of the disc move with its radius.
fn grown(plane: &Plane, radius_px: f64) -> Plane {
    let radius = radius_px.abs();
    let sign = if radius_px < 0.0 { -1.0f32 } else { 1.0 };
    let margin = radius.ceil() as usize + 1;
    let around = Margin::new(plane, margin, sign);
    let (w, h) = (plane.width, plane.height);
    // The smallest is the largest of the negatives.
    let mut best: Vec<f32> = plane.values.iter().map(|&v| sign * v).collect();
    for (share, directions) in RINGS {
        for k in 0..directions {
            let angle = std::f64::consts::TAU * k as f64 / directions as f64;
            let (dx, dy) = (share * radius * libm::cos(angle), share * radius * libm::sin(angle));
            let (x0, y0) = (dx.floor(), dy.floor());
            let (fx, fy) = ((dx - x0) as f32, (dy - y0) as f32);
            let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
            let column = (margin as f64 + x0) as usize;
            for y in 0..h {
                let first = ((margin + y) as f64 + y0) as usize;
                let upper = &around.row(first)[column..][..w + 1];
                let lower = &around.row(first + 1)[column..][..w + 1];
                for (x, best) in best[y * w..][..w].iter_mut().enumerate() {
                    let value = weights[0] * upper[x]
                        + weights[1] * upper[x + 1]
                        + weights[2] * lower[x]
                        + weights[3] * lower[x + 1];
                    *best = best.max(value);
                }
            }
        }
    }
    best.iter_mut().for_each(|v| *v *= sign);
    Plane { width: w, height: h, values: best }
}

/// A plane with its border continued, and with a sign.
struct Margin {
    stride: usize,
    values: Vec<f32>,
}

impl Margin {
    fn new(plane: &Plane, margin: usize, sign: f32) -> Self {
        let stride = plane.width + 2 * margin + 1;
        let mut values = Vec::with_capacity(stride * (plane.height + 2 * margin + 1));
        let inside = |i: usize, n: usize| i.saturating_sub(margin).min(n - 1);
        for y in 0..=plane.height + 2 * margin {
            let row = plane.row(inside(y, plane.height));
            values.extend((0..stride).map(|x| sign * row[inside(x, plane.width)]));
        }
        Self { stride, values }
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.stride..(y + 1) * self.stride]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width_px: 120, height_px: 90, metres_per_px: 1e-4 };

    fn plane(f: impl Fn(f64, f64) -> f64) -> Plane {
        Plane::from_fn(120, 90, |x, y| f(x as f64 - 59.5, y as f64 - 44.5) as f32)
    }

    /// A plate that is long in y: from -20 to 20 px, its walls a normal integral wide.
    fn plate() -> Plane {
        plane(|x, _| 1.5 * libm::erfc((x.abs() - 20.0) / 3.0))
    }

    fn optics(offset_px: f64, blunting_px: f64) -> OpticsState {
        OpticsState {
            part_offset_m: offset_px * GRID.metres_per_px,
            edge_blunting_m: blunting_px * GRID.metres_per_px,
            ..Default::default()
        }
    }

    fn shaped(surface: &Plane, offset_px: f64, blunting_px: f64) -> Plane {
        part(surface.clone(), &GRID, &optics(offset_px, blunting_px), SimdLevel::best())
    }

    fn volume(p: &Plane) -> f64 {
        p.values.iter().map(|&z| f64::from(z)).sum()
    }

    /// The walls of a plate move outwards by the offset, by parts of a pixel too, and the plate sinks in less.
    #[test]
    fn outlines_move_by_the_offset_and_the_volume_stays() {
        for offset_px in [-2.6, -1.0, -0.2, 0.1, 0.3, 1.0, 2.5] {
            let found = shaped(&plate(), offset_px, 0.0);
            assert!((volume(&found) / volume(&plate()) - 1.0).abs() < 1e-6);
            let sinks = 40.0 / (40.0 + 2.0 * offset_px);
            for x in 20..100 {
                let at = (x as f64 - 59.5).abs() - 20.0 - offset_px;
                let exact = 1.5 * sinks * libm::erfc(at / 3.0);
                let error = f64::from(found.at(x, 45)) - exact;
                assert!(error.abs() < 0.05, "{offset_px}, {at} px from the wall: {error}");
            }
        }
    }

    /// The outline of a disc grows alike in all directions.
    #[test]
    fn discs_stay_round() {
        let disc = |radius: f64| plane(move |x, y| libm::erfc((x.hypot(y) - radius) / 3.0));
        for offset_px in [-2.3, 1.7] {
            let found = shaped(&disc(20.0), offset_px, 0.0);
            let sinks = volume(&disc(20.0)) / volume(&disc(20.0 + offset_px));
            for (a, b) in found.values.iter().zip(&disc(20.0 + offset_px).values) {
                assert!((f64::from(*a) - sinks * f64::from(*b)).abs() < 0.03);
            }
        }
    }

    /// Convex edges get lower, and before the volume is restored nothing gets higher; planes and hollows stay.
    #[test]
    fn convex_edges_are_blunted_and_the_rest_stays() {
        let blunt = shaped(&plate(), 0.0, 2.0);
        let raised = f64::from(blunt.at(60, 45) / plate().at(60, 45));
        let lowered = |x: usize| f64::from(blunt.at(x, 45)) / raised / f64::from(plate().at(x, 45));
        assert!(raised > 1.0 && raised < 1.05, "{raised}");
        // The edge lies at column 79; the widths of wall and blunting add as variances where the plate is convex.
        let sigma2 = 2.0 * (4.5f64 + 4.0);
        for x in 70..79 {
            let at = x as f64 - 79.5;
            let exact = libm::erfc(at / sigma2.sqrt()) / libm::erfc(at / 3.0);
            assert!((lowered(x) - exact).abs() < 0.01, "{at}: {} and {exact}", lowered(x));
        }
        for x in 81..100 {
            assert!((lowered(x) - 1.0).abs() < 1e-5, "the hollow at the foot of the wall stays");
        }
    }

    /// So that they can be fitted.
    #[test]
    fn shapes_are_continuous_in_their_parameters() {
        let step = 0.01;
        let largest = |a: &Plane, b: &Plane| {
            a.values.iter().zip(&b.values).fold(0f32, |m, (x, y)| m.max((x - y).abs()))
        };
        for i in -30..60 {
            let at = 0.05 * f64::from(i);
            let change = largest(&shaped(&plate(), at, 0.0), &shaped(&plate(), at + step, 0.0));
            assert!(change < 0.02, "offset {at}: {change}");
            let (a, b) = (shaped(&plate(), 0.0, at.abs()), shaped(&plate(), 0.0, at.abs() + step));
            assert!(largest(&a, &b) < 0.02, "blunting {at}: {}", largest(&a, &b));
        }
    }

    #[test]
    fn nothing_stays_nothing() {
        let nothing = Plane::filled(120, 90, 0.0);
        assert_eq!(shaped(&nothing, 2.0, 1.0), nothing);
    }
}
