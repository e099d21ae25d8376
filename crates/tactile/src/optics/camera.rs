//! Light and camera on the whole frame, with and without contact.

use super::pattern::{FinerPattern, mean_square, normalised};
use super::warp;
use crate::grid::{Grid, Plane};
use gripgen_twin::{BACKGROUND_TERMS, OpticsState};

/// Turns a change against the rest frame into the change that the camera shows, in grey levels:
///
/// ```text
/// I  = (rest + change) gain_c + pattern_c(u, v)
/// I' = 255 (exposure max(0, I) / 255)^gamma
/// ```
///
/// with the frame at rest where the camera sees it.
pub(super) fn apply(optics: &OpticsState, grid: &Grid, rest: &[Vec<f32>; 3], change: &mut [Plane; 3]) {
    let response = (optics.exposure_gain != 1.0 || optics.gamma != 1.0).then(|| Response::new(optics));
    for (channel, plane) in change.iter_mut().enumerate() {
        let gain = optics.light_gain[channel] as f32;
        let pattern = &optics.background[channel];
        let has_pattern = pattern.iter().any(|c| *c != 0.0);
        let (w, h) = (plane.width, plane.height);
        let finer = FinerPattern::new(&optics.finer_background[channel], w, h);
        let moved = optics.moves_frame().then(|| warp::frame(&rest[channel], grid, optics));
        for y in 0..h {
            let [c0, c1, c2] = row_polynomial(pattern, w, h, y).map(|c| c as f32);
            let finer_row = finer.as_ref().map(|finer| finer.row(y));
            for x in 0..w {
                let at = y * w + x;
                let still = rest[channel][at];
                let light = moved.as_ref().map_or(still, |moved| moved[at]);
                let mut seen = (light + plane.values[at]) * gain;
                if has_pattern {
                    let u = normalised(x, w) as f32;
                    seen += c0 + u * (c1 + u * c2);
                }
                if let (Some(finer), Some(row)) = (&finer, &finer_row) {
                    seen += finer.at(row, x);
                }
                if let Some(response) = &response {
                    seen = response.of(seen);
                }
                plane.values[at] = seen - still;
            }
        }
    }
}

/// [`apply`] at one pixel: what becomes of a level of the rest frame with its change.
pub(crate) fn level_at(optics: &OpticsState, grid: &Grid, pixel: usize, channel: usize, level: f32) -> f32 {
    let (w, h) = (grid.width_px, grid.height_px);
    let mut seen = level * optics.light_gain[channel] as f32;
    let pattern = &optics.background[channel];
    if pattern.iter().any(|c| *c != 0.0) {
        let [c0, c1, c2] = row_polynomial(pattern, w, h, pixel / w).map(|c| c as f32);
        let u = normalised(pixel % w, w) as f32;
        seen += c0 + u * (c1 + u * c2);
    }
    if let Some(finer) = FinerPattern::new(&optics.finer_background[channel], w, h) {
        seen += finer.at(&finer.row(pixel / w), pixel % w);
    }
    if optics.exposure_gain != 1.0 || optics.gamma != 1.0 {
        let light = (optics.exposure_gain * f64::from(seen) / 255.0).max(0.0);
        seen = (255.0 * libm::pow(light, optics.gamma)) as f32;
    }
    seen
}

/// The curve `255 (exposure max(0, I) / 255)^gamma` of a camera, tabulated from `FIRST_LEVEL` to twice full scale and
/// interpolated: to within 0.001 grey levels.
struct Response {
    exposure: f64,
    gamma: f64,
    table: Vec<f32>,
}

/// Below this level, where the curve bends, it is computed.
const FIRST_LEVEL: f32 = 4.0;

const STEPS_PER_LEVEL: usize = 16;

impl Response {
    fn new(optics: &OpticsState) -> Self {
        let (exposure, gamma) = (optics.exposure_gain, optics.gamma);
        let mut response = Self { exposure, gamma, table: Vec::new() };
        let level = |i: usize| i as f64 / STEPS_PER_LEVEL as f64;
        response.table = (0..=510 * STEPS_PER_LEVEL).map(|i| response.exact(level(i))).collect();
        response
    }

    fn exact(&self, level: f64) -> f32 {
        (255.0 * libm::pow((self.exposure * level / 255.0).max(0.0), self.gamma)) as f32
    }

    fn of(&self, level: f32) -> f32 {
        let place = level * STEPS_PER_LEVEL as f32;
        let i = place as usize;
        if level < FIRST_LEVEL || i + 1 >= self.table.len() {
            return self.exact(f64::from(level));
        }
        let (a, b) = (self.table[i], self.table[i + 1]);
        a + (place - i as f32) * (b - a)
    }
}

/// A pattern in one row: coefficients of 1, u and u^2.
fn row_polynomial(pattern: &[f64; BACKGROUND_TERMS], width: usize, height: usize, y: usize) -> [f64; 3] {
    let [u, v, uu, uv, vv] = *pattern;
    let at = normalised(y, height);
    let constant = v * at + vv * (at * at - mean_square(height)) - uu * mean_square(width);
    [constant, u + uv * at, uu]
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::FINER_TERMS;

    fn grid_of(change: &[Plane; 3]) -> Grid {
        Grid { width_px: change[0].width, height_px: change[0].height, metres_per_px: 1e-4 }
    }

    /// Terms have mean 0, and a linear one goes from -1 to 1.
    #[test]
    fn patterns_have_mean_zero_whatever_the_size_of_the_frame() {
        for (w, h) in [(320, 240), (17, 16), (64, 1)] {
            for term in 0..BACKGROUND_TERMS + FINER_TERMS.len() {
                let mut optics = OpticsState::default();
                match term.checked_sub(BACKGROUND_TERMS) {
                    None => optics.background[1][term] = 10.0,
                    Some(finer) => optics.finer_background[1][finer] = 10.0,
                }
                let rest = [vec![90.0; w * h], vec![90.0; w * h], vec![90.0; w * h]];
                let mut change = [0, 1, 2].map(|_| Plane::filled(w, h, 0.0));
                apply(&optics, &grid_of(&change), &rest, &mut change);
                let mean = change[1].values.iter().map(|&x| f64::from(x)).sum::<f64>() / (w * h) as f64;
                assert!(mean.abs() < 1e-4, "{term}: {mean}");
                assert!(change[0].values.iter().chain(&change[2].values).all(|&x| x == 0.0));
                if term == 0 {
                    let edge = 10.0 * (1.0 - 1.0 / w as f32);
                    assert!((change[1].at(0, 0) + edge).abs() < 1e-4);
                    assert!((change[1].at(w - 1, h - 1) - edge).abs() < 1e-4);
                }
            }
        }
    }

    /// The table against the formula, at the ends of the bounds too.
    #[test]
    fn the_tabulated_response_is_the_curve() {
        for (exposure_gain, gamma) in [(0.3, 0.4), (0.3, 2.5), (1.1, 0.9), (1.7, 2.5), (3.0, 0.4)] {
            let response = Response::new(&OpticsState { exposure_gain, gamma, ..Default::default() });
            for i in 0..6000 {
                let level = -20.0 + 0.1 * f64::from(i);
                let exact = 255.0 * (exposure_gain * level.max(0.0) / 255.0).powf(gamma);
                let found = f64::from(response.of(level as f32));
                assert!((found - exact).abs() < 1e-3 + 1e-6 * exact, "{gamma}, {level}: {found} and {exact}");
            }
        }
    }

    /// One pixel at a time is the frame, to within the table of the response.
    #[test]
    fn single_pixels_are_those_of_the_frame() {
        let mut optics =
            OpticsState { light_gain: [0.9, 1.0, 1.1], exposure_gain: 1.2, gamma: 0.8, ..Default::default() };
        optics.background = [[3.0, -2.0, 4.0, 1.0, 5.0]; 3];
        let grid = Grid { width_px: 24, height_px: 17, metres_per_px: 1e-4 };
        let rest = [0, 1, 2].map(|c| (0..grid.len()).map(|i| (20 * c + i % 60) as f32).collect::<Vec<f32>>());
        let mut change = [0, 1, 2].map(|_| Plane::filled(24, 17, 7.0));
        apply(&optics, &grid_of(&change), &rest, &mut change);
        for c in 0..3 {
            for i in 0..grid.len() {
                let one = level_at(&optics, &grid, i, c, rest[c][i] + 7.0);
                assert!((one - rest[c][i] - change[c].values[i]).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn gain_and_gamma_follow_the_formula_on_rest_and_contact() {
        let optics =
            OpticsState { light_gain: [0.9, 1.0, 1.1], exposure_gain: 1.2, gamma: 0.8, ..Default::default() };
        let rest = [vec![90.0f32], vec![100.0], vec![0.0]];
        let mut change = [20.0, -30.0, -5.0].map(|c| Plane::filled(1, 1, c));
        apply(&optics, &grid_of(&change), &rest, &mut change);
        for c in 0..3 {
            let light = (f64::from(rest[c][0]) + [20.0, -30.0, -5.0][c]) * [0.9, 1.0, 1.1][c];
            let seen = 255.0 * (1.2 * light.max(0.0) / 255.0).powf(0.8);
            assert!((f64::from(rest[c][0] + change[c].values[0]) - seen).abs() < 1e-4);
        }
    }
}
