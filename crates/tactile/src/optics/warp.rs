//! A contact that is seen elsewhere.

use crate::grid::{Grid, Plane};
use gripgen_twin::OpticsState;

/// The surface as it is where the camera sees it. At x is seen what lies at `R(-rotation) (1 + k1 r^2) (x - shift) /
/// scale`, with `r = |x - shift|` in half image widths and x from the middle of the image. Heights, which are in pixels
/// like x, grow with the scale, so that slopes stay.
///
/// Interpolated by Catmull-Rom splines, whose slopes are continuous; beyond the frame the border goes on.
pub(super) fn surface(surface: &Plane, grid: &Grid, optics: &OpticsState) -> Plane {
    let (w, h) = (surface.width, surface.height);
    let middle = [(w as f64 - 1.0) / 2.0, (h as f64 - 1.0) / 2.0];
    let shift = optics.shift_m.map(|m| m / grid.metres_per_px);
    let (sin, cos) = (libm::sin(optics.rotation_rad), libm::cos(optics.rotation_rad));
    let half_width = w as f64 / 2.0;
    let mut seen = Plane::filled(w, h, 0.0);
    for y in 0..h {
        for x in 0..w {
            let dx = x as f64 - middle[0] - shift[0];
            let dy = y as f64 - middle[1] - shift[1];
            let r2 = (dx * dx + dy * dy) / (half_width * half_width);
            let factor = (1.0 + optics.distortion_k1 * r2) / optics.scale;
            let from = [factor * (cos * dx + sin * dy), factor * (cos * dy - sin * dx)];
            let height = interpolated(surface, from[0] + middle[0], from[1] + middle[1]);
            seen.values[y * w + x] = (optics.scale * height) as f32;
        }
    }
    seen
}

/// The value at a place between pixels.
fn interpolated(plane: &Plane, x: f64, y: f64) -> f64 {
    let (columns, wx) = taps(x, plane.width);
    let (rows, wy) = taps(y, plane.height);
    let mut sum = 0.0;
    for (row, wy) in rows.into_iter().zip(wy) {
        let values = plane.row(row);
        let along: f64 = columns.iter().zip(wx).map(|(&column, w)| w * f64::from(values[column])).sum();
        sum += wy * along;
    }
    sum
}

/// The four neighbours of a place and their weights (Catmull and Rom 1974).
fn taps(at: f64, n: usize) -> ([usize; 4], [f64; 4]) {
    let last = n as f64 - 1.0;
    let at = at.clamp(0.0, last);
    let i = (at as usize).min(n.saturating_sub(2));
    let t = at - i as f64;
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        0.5 * (2.0 * t2 - t3 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ];
    ([i.saturating_sub(1), i, (i + 1).min(n - 1), (i + 2).min(n - 1)], weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width_px: 80, height_px: 60, metres_per_px: 1e-4 };

    fn hill(x: f64, y: f64) -> f64 {
        5.0 * (-((x - 45.0) / 9.0).powi(2) - ((y - 25.0) / 6.0).powi(2)).exp()
    }

    fn plane(f: impl Fn(f64, f64) -> f64) -> Plane {
        let values = (0..GRID.len()).map(|i| f((i % 80) as f64, (i / 80) as f64) as f32).collect();
        Plane { width: 80, height: 60, values }
    }

    fn largest_difference(a: &Plane, b: &Plane) -> f32 {
        a.values.iter().zip(&b.values).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
    }

    /// A hill that is moved is the hill of the moved centre.
    #[test]
    fn shifts_turns_and_scales_are_those_of_the_hill() {
        let at = |shift_m: [f64; 2], rotation_rad: f64, scale: f64| {
            let optics = OpticsState { shift_m, rotation_rad, scale, ..Default::default() };
            surface(&plane(hill), &GRID, &optics)
        };
        let moved = plane(|x, y| hill(x - 3.4, y + 2.7));
        assert!(largest_difference(&at([3.4e-4, -2.7e-4], 0.0, 1.0), &moved) < 0.01);
        // A quarter turn takes right to down: what was right of the middle is below it.
        let quarter = plane(|x, y| hill(39.5 + (y - 29.5), 29.5 - (x - 39.5)));
        let inside = |p: &Plane| Plane {
            values: (0..GRID.len()).filter(|i| (10..70).contains(&(i % 80))).map(|i| p.values[i]).collect(),
            ..*p
        };
        let turned = at([0.0; 2], std::f64::consts::FRAC_PI_2, 1.0);
        assert!(largest_difference(&inside(&turned), &inside(&quarter)) < 1e-4);
        let peak = |p: &Plane| p.values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
        assert!(peak(&turned) / 80 > 30, "right of the middle has gone down");
        let large = plane(|x, y| 1.1 * hill((x - 39.5) / 1.1 + 39.5, (y - 29.5) / 1.1 + 29.5));
        assert!(largest_difference(&at([0.0; 2], 0.0, 1.1), &large) < 0.01);
    }

    /// Half an image width from the middle a point is seen nearer to it by k1.
    #[test]
    fn distortion_grows_with_the_cube_of_the_distance() {
        let optics = OpticsState { distortion_k1: 0.05, ..Default::default() };
        let ramp = surface(&plane(|x, _| x - 39.5), &GRID, &optics);
        for x in [10usize, 25, 39, 60] {
            let r = (x as f64 - 39.5) / 40.0;
            let exact = 40.0 * r * (1.0 + 0.05 * (r * r + (0.5f64 / 40.0).powi(2)));
            assert!((f64::from(ramp.at(x, 30)) - exact).abs() < 1e-4);
        }
    }

    #[test]
    fn whole_pixels_are_exact_and_the_border_goes_on() {
        let optics = OpticsState { shift_m: [5e-4, 0.0], ..Default::default() };
        let hills = plane(hill);
        let moved = surface(&hills, &GRID, &optics);
        assert!((moved.at(50, 25) - hills.at(45, 25)).abs() < 1e-5);
        assert!((moved.at(0, 25) - hills.at(0, 25)).abs() < 1e-6);
    }
}
