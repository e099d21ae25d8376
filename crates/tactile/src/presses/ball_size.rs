//! Whether the ball of a set of presses is as large as was said.
//!
//! Presses of one ball cannot tell: with a diameter that is 1.5 times the true one all slopes are two thirds of the true ones,
//! and colours that are fitted to them fit as well as before. It shows in images of anything else of known size. A body with a
//! mesh is then drawn with slopes that have the wrong colours. And how far the ball travelled, with the rim of its contact,
//! says how large it is, as far as it is known how the gel gives way: `a^2 = k R d`, k from 1 (elastic half-space, Hertz 1882) to 2 (a
//! gel that is cut). A sensor's sink-in s (see [`crate::Pyramid`]) is fitted to shapes of contacts and not to sizes; with it k is
//! `2 (1 - s)`.

use super::calibrate::Resized;
use super::circle::{find_circle, reference_frame};
use super::compare::{WINDOW_PX, crop, predict_press};
use super::{Calibration, Press, PressSet};
use crate::metrics::mean_squared_error;
use crate::sensor::Sensor;

/// Factors on the diameter that are tried: thirds of an octave, the given size in the middle.
const TRIED: i32 = 3;
const STEPS_AN_OCTAVE: f64 = 3.0;

/// Fewest bodies, and fewest presses with a depth, that something is said by.
const MIN_BODIES: usize = 2;
const MIN_DEPTHS: usize = 3;

/// What models of gel and mesh are wrong by, of the logarithm of the factor: four presses of a sphere and four of a printed prism
/// into one real sensor, whose ball is known, have their least errors at 1.17 and 1.03.
const MODEL_SD: f64 = 0.1;

/// k of a gel lies within this of `2 (1 - s)`, and within the limits of all gels.
const K_WITHIN: f64 = 0.25;
const K_LIMITS: (f64, f64) = (1.0, 2.0);

/// Standard deviations of a two-sided 90 % of a normal distribution.
const SD90: f64 = 1.645;

/// A factor that is nearer to 1 than this is no wrong size.
const WRONG_FROM: f64 = 1.2;

/// The factor between two sizes that a check has to tell apart.
const TELLS: f64 = 1.5;

/// What the size of a ball was checked by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BallSizeBy {
    /// How far it travelled.
    Depths,
    /// Presses of bodies whose mesh is known.
    Shapes,
}

impl BallSizeBy {
    /// Name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            BallSizeBy::Depths => "depths",
            BallSizeBy::Shapes => "shapes",
        }
    }
}

/// The true diameter over the one that was given, with its 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallSize {
    /// What it was checked by.
    pub by: BallSizeBy,
    /// The most likely factor.
    pub factor: f64,
    /// Lower end.
    pub low90: f64,
    /// Upper end.
    pub high90: f64,
}

impl BallSize {
    /// Whether a size that is wrong by a factor of 1.5 would have been seen.
    pub fn tells(&self) -> bool {
        self.factor / self.low90 < TELLS && self.high90 / self.factor < TELLS
    }

    /// Whether the given size is wrong.
    pub fn is_wrong(&self) -> bool {
        let off = self.factor.max(1.0 / self.factor) >= WRONG_FROM;
        off && !(self.low90..=self.high90).contains(&1.0)
    }
}

/// Checks the ball of a calibration by the bodies among its presses, or by how far the ball travelled. `None` where the
/// presses have neither.
pub fn check_ball_size(set: &PressSet, calibration: &Calibration) -> Option<BallSize> {
    let bodies: Vec<&Press> = set.presses.iter().filter(|press| press.indenter.is_some()).collect();
    let travels = set.presses.iter().filter(|press| press.indenter.is_none() && press.travel_m.is_some());
    if bodies.len() < MIN_BODIES && travels.count() < MIN_DEPTHS {
        return None;
    }
    let balls = Resized::new(set, calibration)?;
    by_shapes(&bodies, &balls).or_else(|| by_depths(set, balls.sink_in_fraction()))
}

/// Draws the bodies with sensors that were fitted to balls of several sizes.
fn by_shapes(bodies: &[&Press], balls: &Resized) -> Option<BallSize> {
    if bodies.len() < MIN_BODIES {
        return None;
    }
    let mut errors = Vec::new();
    for step in -TRIED..=TRIED {
        let ln_factor = f64::from(step) / STEPS_AN_OCTAVE * std::f64::consts::LN_2;
        let Some(sensor) = balls.sensor(libm::exp(ln_factor)) else { continue };
        let of_bodies: Option<Vec<f64>> = bodies.iter().map(|body| window_error(body, &sensor)).collect();
        errors.push((ln_factor, of_bodies?));
    }
    least(&errors).map(|(ln_factor, sd)| within(BallSizeBy::Shapes, ln_factor, libm::hypot(sd, MODEL_SD)))
}

fn window_error(body: &Press, sensor: &Sensor) -> Option<f64> {
    let circle = body.circle?;
    // No ball is looked at.
    let drawn = predict_press(body, 0.0, sensor).ok()?;
    let cropped = |image| crop(image, (circle.x_px, circle.y_px), WINDOW_PX);
    mean_squared_error(&cropped(&drawn), &cropped(&body.image)).ok()
}

fn within(by: BallSizeBy, ln_factor: f64, sd: f64) -> BallSize {
    let at = |deviations: f64| libm::exp(ln_factor + deviations * sd);
    BallSize { by, factor: at(0.0), low90: at(-SD90), high90: at(SD90) }
}

/// Where the mean of several curves is least, and its standard deviation by leaving one curve out at a time. The curves are given by
/// their values at each place; `None` with fewer than three places.
fn least(curves: &[(f64, Vec<f64>)]) -> Option<(f64, f64)> {
    let n = curves.first()?.1.len();
    if curves.len() < 3 {
        return None;
    }
    let without = |left_out: Option<usize>| {
        let mean = |values: &[f64]| -> f64 {
            values.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, v)| v).sum()
        };
        let sums: Vec<(f64, f64)> = curves.iter().map(|(x, values)| (*x, mean(values))).collect();
        lowest(&sums)
    };
    let jackknife: Vec<f64> = (0..n).map(|i| without(Some(i))).collect();
    let mean = jackknife.iter().sum::<f64>() / n as f64;
    let squares: f64 = jackknife.iter().map(|x| (x - mean) * (x - mean)).sum();
    Some((without(None), (squares * (n - 1) as f64 / n as f64).sqrt()))
}

/// The lowest point of the parabola through the lowest of some points and its neighbours; at the end of the range that end.
fn lowest(points: &[(f64, f64)]) -> f64 {
    let at = (0..points.len()).min_by(|&a, &b| points[a].1.total_cmp(&points[b].1)).unwrap_or(0);
    let Some([(x0, y0), (x1, y1), (x2, y2)]) = at
        .checked_sub(1)
        .and_then(|first| points.get(first..first + 3))
        .and_then(|three| three.first_chunk())
    else {
        return points[at].0;
    };
    let (left, right) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
    let curvature = (right - left) / (x2 - x0);
    // The lowest of three has no negative curvature; where all are alike it is as good as any.
    if curvature > 0.0 { 0.5 * (x0 + x1) - 0.5 * left / curvature } else { *x1 }
}

/// From how far the ball travelled, and the rims of its contacts as they are found in the images.
fn by_depths(set: &PressSet, sink_in_fraction: f64) -> Option<BallSize> {
    let rest = reference_frame(set)?;
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    let ln_factor = |press: &Press| {
        let travel_m = press.travel_m.filter(|_| press.indenter.is_none())?;
        let found = find_circle(&press.image, &rest, ball_radius_px)?;
        let radius_m = found.radius_px * set.metres_per_px;
        Some(libm::log(radius_m * radius_m / (travel_m * set.ball_m / 2.0)))
    };
    let mut found: Vec<f64> = set.presses.iter().filter_map(ln_factor).collect();
    if found.len() < MIN_DEPTHS {
        return None;
    }
    found.sort_by(f64::total_cmp);
    let middle = found[found.len() / 2];
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    let variance = found.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (found.len() - 1) as f64;
    let sd = (variance / found.len() as f64).sqrt();
    let usual = 2.0 * (1.0 - sink_in_fraction);
    let k = |within: f64| (usual + within).clamp(K_LIMITS.0, K_LIMITS.1);
    let factor = |k: f64, deviations: f64| libm::exp(middle + deviations * sd) / k;
    Some(BallSize {
        by: BallSizeBy::Depths,
        factor: factor(k(0.0), 0.0),
        low90: factor(k(K_WITHIN), -SD90),
        high90: factor(k(-K_WITHIN), SD90),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_point_is_that_of_a_parabola_or_an_end() {
        let at = |lowest: f64, from: i32| -> Vec<(f64, f64)> {
            (from..4).map(|i| (f64::from(i), 3.0 + 2.0 * (f64::from(i) - lowest).powi(2))).collect()
        };
        assert!((lowest(&at(0.3, -3)) - 0.3).abs() < 1e-12);
        assert!((lowest(&at(-1.6, -3)) + 1.6).abs() < 1e-12);
        assert_eq!(lowest(&at(-9.0, -3)), -3.0);
        assert_eq!(lowest(&at(9.0, 1)), 3.0);
    }

    #[test]
    fn curves_that_agree_are_sure_and_others_are_not() {
        let curves = |lowest: [f64; 3]| -> Vec<(f64, Vec<f64>)> {
            let at = |i: i32| (f64::from(i), lowest.map(|x| (f64::from(i) - x).powi(2)).to_vec());
            (-3..=3).map(at).collect()
        };
        let (place, sd) = least(&curves([0.4; 3])).unwrap();
        assert!((place - 0.4).abs() < 1e-12 && sd < 1e-12);
        // Parabolas of one width have their mean's lowest point in the middle: the standard error of three numbers.
        let (place, sd) = least(&curves([0.1, 0.4, 0.7])).unwrap();
        assert!((place - 0.4).abs() < 1e-12 && (sd - 0.3 / 3.0_f64.sqrt()).abs() < 1e-12, "{place} {sd}");
        assert_eq!(least(&curves([0.4; 3])[..2]), None);
    }

    #[test]
    fn a_size_is_wrong_where_its_interval_says_so() {
        let size = |factor, low90, high90| BallSize { by: BallSizeBy::Depths, factor, low90, high90 };
        assert!(size(0.67, 0.55, 0.8).is_wrong() && size(1.5, 1.2, 1.8).is_wrong());
        assert!(!size(1.3, 0.9, 1.8).is_wrong() && !size(1.1, 1.05, 1.15).is_wrong());
        assert!(size(1.3, 0.9, 1.8).tells() && !size(1.3, 0.8, 1.8).tells() && !size(1.0, 0.9, 1.6).tells());
    }
}
