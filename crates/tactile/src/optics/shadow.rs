//! Shadows that a contact throws.

use crate::colour::shade;
use crate::grid::Plane;
use crate::sensor::Sensor;
use gripgen_twin::OpticsState;

/// A pixel with less contact than this lies outside of it.
const MIN_DEPTH_PX: f32 = 0.05;

/// Slope at which a colour model is asked where its light comes from.
const PROBE_SLOPE: f32 = 0.1;

/// The lights are not points: shadow begins at this share of the slope of their middle and is full at `2 -` it.
const PENUMBRA: f32 = 0.5;

/// Steps along a ray: a pixel, further out this share of the distance. The surface is smooth over several pixels.
const STEP: f32 = 1.0 / 16.0;

/// Takes the light that the surface keeps from each pixel outside the contact off a change of colour.
///
/// A channel's light stands in the direction in which its colour model is brightest. The slope of the horizon in that
/// direction, `t = max over d of (z(x + d l) - z(x)) / d`, against that of the light, tan(elevation), says how much of an
/// extended light is hidden (horizon mapping, Max 1988): nothing below half of it, all above one and a half, a
/// smooth step between. A full shadow takes `strength` of the rest frame's brightness.
pub(super) fn cast(
    sensor: &Sensor,
    optics: &OpticsState,
    surface: &Plane,
    depth_px: &Plane,
    change: &mut [Plane; 3],
) {
    let slope = libm::tan(optics.light_elevation_rad) as f32;
    let top = surface.values.iter().fold(0.0f32, |m, &z| m.max(z));
    let lights = light_directions(sensor);
    let Some(raised) = raised(surface, top, PENUMBRA * slope) else { return };
    for ((plane, light), rest) in change.iter_mut().zip(lights).zip(&sensor.rest) {
        let Some(light) = light else { continue };
        let strength = optics.shadow_strength as f32;
        for y in 0..surface.height {
            for x in 0..surface.width {
                let at = y * surface.width + x;
                if depth_px.values[at] > MIN_DEPTH_PX || raised.is_behind(x, y, light) {
                    continue;
                }
                let horizon = horizon(surface, (x, y), light, top, PENUMBRA * slope);
                let hidden = ((horizon / slope - PENUMBRA) / (2.0 - 2.0 * PENUMBRA)).clamp(0.0, 1.0);
                plane.values[at] -= strength * rest[at] * (hidden * hidden * (3.0 - 2.0 * hidden));
            }
        }
    }
}

/// The box around all pixels that are high enough to throw a shadow.
struct Raised {
    columns: [f32; 2],
    rows: [f32; 2],
    /// Length of the longest shadow.
    reach_px: f32,
}

/// `least`: the slope at which shadow begins, and so the least height that throws one on its neighbour.
fn raised(surface: &Plane, top: f32, least: f32) -> Option<Raised> {
    let mut found: Option<Raised> = None;
    for (i, _) in surface.values.iter().enumerate().filter(|(_, z)| **z > least) {
        let (x, y) = ((i % surface.width) as f32, (i / surface.width) as f32);
        let b = found.get_or_insert(Raised { columns: [x, x], rows: [y, y], reach_px: top / least });
        b.columns = [b.columns[0].min(x), b.columns[1].max(x)];
        b.rows = [b.rows[0].min(y), b.rows[1].max(y)];
    }
    found
}

impl Raised {
    /// Whether a ray from a pixel misses the box by more than the width of a pixel, or reaches it too far away.
    fn is_behind(&self, x: usize, y: usize, towards: [f32; 2]) -> bool {
        let (mut enters, mut leaves) = (0.0f32, self.reach_px);
        for (at, [low, high], step) in
            [(x as f32, self.columns, towards[0]), (y as f32, self.rows, towards[1])]
        {
            let (low, high) = (low - 1.0 - at, high + 1.0 - at);
            if step.abs() < 1e-6 {
                if low > 0.0 || high < 0.0 {
                    return true;
                }
            } else {
                let (a, b) = (low / step, high / step);
                enters = enters.max(a.min(b));
                leaves = leaves.min(a.max(b));
            }
        }
        enters > leaves
    }
}

/// Slope of the highest point that a pixel sees in a direction; 0 where nothing reaches `least`.
fn horizon(surface: &Plane, (x, y): (usize, usize), towards: [f32; 2], top: f32, least: f32) -> f32 {
    let here = surface.at(x, y);
    let (last_x, last_y) = ((surface.width - 1) as f32, (surface.height - 1) as f32);
    let mut highest = 0.0f32;
    let mut distance = 1.0f32;
    // Nothing further away than that rises to `least`, or above what was seen.
    while distance * highest.max(least) < top - here {
        let (px, py) = (x as f32 + distance * towards[0], y as f32 + distance * towards[1]);
        if px < 0.0 || py < 0.0 || px > last_x || py > last_y {
            break;
        }
        let (column, row) = ((px as usize).min(surface.width - 2), (py as usize).min(surface.height - 2));
        let (fx, fy) = (px - column as f32, py - row as f32);
        let i = row * surface.width + column;
        let (upper, lower) = (&surface.values[i..i + 2], &surface.values[i + surface.width..][..2]);
        let above = upper[0] + fx * (upper[1] - upper[0]);
        let below = lower[0] + fx * (lower[1] - lower[0]);
        highest = highest.max((above + fy * (below - above) - here) / distance);
        distance += (distance * STEP).max(1.0);
    }
    highest
}

/// Unit vectors in the image towards the light of each channel; `None` for a channel that slopes do not change.
pub(super) fn light_directions(sensor: &Sensor) -> [Option<[f32; 2]>; 3] {
    let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
    let flat = Plane::filled(w, h, 0.0);
    // One height everywhere: a regression is asked only where the gel is displaced, and equal heights cancel.
    let raised = Plane::filled(w, h, 1.0);
    let mean = |gx: f32, gy: f32| {
        let slope = |g: f32| if g == 0.0 { flat.clone() } else { Plane::filled(w, h, g) };
        let change = shade(&sensor.colour, &raised, &slope(gx), &slope(gy), None);
        change.map(|plane| plane.values.iter().map(|&v| f64::from(v)).sum::<f64>() / (w * h) as f64)
    };
    // A surface that falls towards a light faces it.
    let (left, right) = (mean(PROBE_SLOPE, 0.0), mean(-PROBE_SLOPE, 0.0));
    let (up, down) = (mean(0.0, PROBE_SLOPE), mean(0.0, -PROBE_SLOPE));
    [0, 1, 2].map(|c| {
        let (x, y) = (right[c] - left[c], down[c] - up[c]);
        let length = (x * x + y * y).sqrt();
        (length > 1e-9).then(|| [(x / length) as f32, (y / length) as f32])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regression is asked like lights are: red is bright on slopes that face right, green on those that face down.
    #[test]
    fn the_lights_of_a_regression_are_found() {
        use crate::colour::regressor::{NEAR, NEAR_FIELD, SURROUNDINGS};
        let mut near = vec![0.0; 3 * NEAR * NEAR_FIELD];
        near[0] = 50.0;
        near[(NEAR + 1) * NEAR_FIELD] = 30.0;
        let colour = crate::colour::Regressor {
            mm_per_px: 0.1,
            near,
            around: vec![0.0; 3 * SURROUNDINGS * 6],
            slope_limit: 1.0,
            height_limit_mm: 5.0,
            around_limit: vec![1.0; SURROUNDINGS],
        };
        let mut sensor = super::super::testing::rig().sensor;
        sensor.colour = crate::ColourModel::Regressor(Box::new(colour));
        assert_eq!(light_directions(&sensor), [Some([1.0, 0.0]), Some([0.0, 1.0]), None]);
    }

    /// A ridge of height h across the ray is seen under h / d, to within a step.
    #[test]
    fn a_ridge_is_seen_under_its_slope() {
        let ridge = |x: usize| 8.0 * libm::expf(-((x as f32 - 150.0) / 6.0).powi(2));
        let surface = Plane::from_fn(200, 40, |x, _| ridge(x));
        for x in [70usize, 100, 120, 130] {
            let exact = (1..180 - x).map(|d| surface.at((x + d).min(199), 20) / d as f32).fold(0.0, f32::max);
            let found = horizon(&surface, (x, 20), [1.0, 0.0], 8.0, 0.01);
            assert!((found / exact - 1.0).abs() < 0.15, "{x}: {found} and {exact}");
            assert_eq!(horizon(&surface, (x, 20), [-1.0, 0.0], 8.0, 0.01), 0.0, "nothing rises to the left");
        }
    }

    /// Rays that miss the box see nothing, so leaving them out changes nothing.
    #[test]
    fn pixels_behind_the_box_see_no_horizon() {
        let inside = |x, y| (40..60).contains(&x) && (30..40).contains(&y);
        let surface = Plane::from_fn(90, 70, |x, y| if inside(x, y) { 5.0 } else { 0.0 });
        let least = 0.2;
        let found = raised(&surface, 5.0, least).unwrap();
        let mut seen = 0;
        for degrees in [0.0f64, 30.0, 90.0, 200.0, 305.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let light = [cos as f32, sin as f32];
            for (x, y) in (0..90 * 70).map(|i| (i % 90, i / 90)) {
                let horizon = horizon(&surface, (x, y), light, 5.0, least);
                assert!(!found.is_behind(x, y, light) || horizon <= least, "({x}, {y}): {horizon}");
                seen += usize::from(horizon > least);
            }
        }
        assert!(seen > 500);
        assert!(raised(&Plane::filled(9, 9, 0.1), 0.1, least).is_none());
    }
}
