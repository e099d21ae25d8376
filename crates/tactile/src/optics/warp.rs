//! A contact that is seen elsewhere.

use crate::grid::{Grid, Plane};
use gripgen_twin::OpticsState;

/// Where a camera looks: at x is seen what lies at `R(-rotation) (1 + k1 r^2) (x - shift) / scale`, with `r = |x - shift|` in half image
/// widths and x from the middle of the image.
struct Sight {
    shift: [f64; 2],
    sin: f64,
    cos: f64,
    scale: f64,
    k1: f64,
    middle: [f64; 2],
    half_width: f64,
}

impl Sight {
    /// That of the contact.
    fn of_contact(grid: &Grid, optics: &OpticsState) -> Self {
        let (w, h) = (grid.width_px as f64, grid.height_px as f64);
        Self {
            shift: optics.shift_m.map(|m| m / grid.metres_per_px),
            sin: libm::sin(optics.rotation_rad),
            cos: libm::cos(optics.rotation_rad),
            scale: optics.scale,
            k1: optics.distortion_k1,
            middle: [(w - 1.0) / 2.0, (h - 1.0) / 2.0],
            half_width: w / 2.0,
        }
    }

    /// That of the frame at rest, which goes along for some of the way. It has the size that the camera gave it.
    fn of_frame(grid: &Grid, optics: &OpticsState) -> Self {
        let share = optics.frame_moves;
        let [x_m, y_m] = optics.shift_m;
        let moved = OpticsState {
            shift_m: [share * x_m, share * y_m],
            rotation_rad: share * optics.rotation_rad,
            ..OpticsState::default()
        };
        Self::of_contact(grid, &moved)
    }

    /// What is seen at a pixel lies here.
    fn from(&self, x: usize, y: usize) -> (f64, f64) {
        let dx = x as f64 - self.middle[0] - self.shift[0];
        let dy = y as f64 - self.middle[1] - self.shift[1];
        let r2 = (dx * dx + dy * dy) / (self.half_width * self.half_width);
        let factor = (1.0 + self.k1 * r2) / self.scale;
        let from = [factor * (self.cos * dx + self.sin * dy), factor * (self.cos * dy - self.sin * dx)];
        (from[0] + self.middle[0], from[1] + self.middle[1])
    }
}

/// The surface as it is where the camera sees it. Heights, which are in pixels like x, grow with the scale, so that slopes stay.
///
/// Interpolated by Catmull-Rom splines, whose slopes are continuous; beyond the frame the border goes on.
pub(super) fn surface(surface: &Plane, grid: &Grid, optics: &OpticsState) -> Plane {
    let (w, h) = (surface.width, surface.height);
    let sight = Sight::of_contact(grid, optics);
    Plane::from_fn(w, h, |x, y| {
        (optics.scale * interpolated(&surface.values, (w, h), sight.from(x, y))) as f32
    })
}

/// The frame at rest where it is seen if it moves along, one plane of levels.
pub(super) fn frame(levels: &[f32], grid: &Grid, optics: &OpticsState) -> Vec<f32> {
    let sight = Sight::of_frame(grid, optics);
    let (w, h) = (grid.width_px, grid.height_px);
    (0..w * h).map(|at| interpolated(levels, (w, h), sight.from(at % w, at / w)) as f32).collect()
}

/// [`frame`] at some pixels, all channels.
pub(crate) fn frame_at(
    levels: &[Vec<f32>; 3],
    grid: &Grid,
    optics: &OpticsState,
    pixels: &[usize],
) -> Vec<[f32; 3]> {
    let sight = Sight::of_frame(grid, optics);
    let (w, h) = (grid.width_px, grid.height_px);
    let at = |&pixel: &usize| {
        let from = sight.from(pixel % w, pixel / w);
        [0, 1, 2].map(|c| interpolated(&levels[c], (w, h), from) as f32)
    };
    pixels.iter().map(at).collect()
}

/// The value at a place between pixels.
fn interpolated(values: &[f32], (width, height): (usize, usize), (x, y): (f64, f64)) -> f64 {
    let (columns, wx) = taps(x, width);
    let (rows, wy) = taps(y, height);
    let mut sum = 0.0;
    for (row, wy) in rows.into_iter().zip(wy) {
        let values = &values[row * width..][..width];
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
        Plane::from_fn(80, 60, |x, y| f(x as f64, y as f64) as f32)
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

    /// The frame goes along half of the way, and not without a way to go.
    #[test]
    fn a_frame_moves_along() {
        let hills = plane(hill);
        let optics = OpticsState { shift_m: [6e-4, -4e-4], frame_moves: 0.5, ..Default::default() };
        let moved = frame(&hills.values, &GRID, &optics);
        let exact = plane(|x, y| hill(x - 3.0, y + 2.0));
        let inside = |i: &usize| (5..75).contains(&(i % 80)) && (5..55).contains(&(i / 80));
        let off =
            (0..GRID.len()).filter(inside).map(|i| (moved[i] - exact.values[i]).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
        let rest = [0, 1, 2].map(|_| hills.values.clone());
        assert_eq!(frame_at(&rest, &GRID, &optics, &[2040])[0], [moved[2040]; 3]);
        assert!(
            optics.moves_frame() && !OpticsState { frame_moves: 1.0, ..Default::default() }.moves_frame()
        );
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
