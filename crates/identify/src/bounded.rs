//! Intervals of parameters that have a bound.
//!
//! The unified construction of Feldman and Cousins 1998 (Phys. Rev. D 57, 3873): for every true mean mu >= 0 of a normal variable
//! x of variance 1, those x are accepted for which the likelihood of mu, over that of the best mean that is allowed, is
//! largest, until they have the level wanted. With q = -2 log of that ratio,
//!
//! ```text
//! q(x) = (x - mu)^2 where x >= 0,   mu^2 - 2 x mu where x < 0
//! ```
//!
//! and the belt is q <= c(mu). Its interval of a measured x never is empty and goes over by itself from a limit to two ends.

use crate::grouped::t_quantile_95;
use gripgen_twin::random::normal_cdf;

/// Smallest and largest x that are accepted for a mean.
fn belt(mean: f64, level: f64) -> (f64, f64) {
    let ends = |root: f64| {
        let low = if root <= mean {
            mean - root
        } else if mean > 0.0 {
            (mean * mean - root * root) / (2.0 * mean)
        } else {
            f64::NEG_INFINITY
        };
        (low, mean + root)
    };
    let (mut less, mut more) = (0.0, 10.0);
    for _ in 0..60 {
        let root = 0.5 * (less + more);
        let (low, high) = ends(root);
        if normal_cdf(high - mean) - normal_cdf(low - mean) < level {
            less = root;
        } else {
            more = root;
        }
    }
    ends(more)
}

/// The interval of a mean that is not below 0, of which `x` was measured with a standard deviation of 1.
pub fn above_zero(x: f64, level: f64) -> (f64, f64) {
    let last = |mut inside: f64, mut outside: f64, is_inside: &dyn Fn(f64) -> bool| {
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if is_inside(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    let start = x.max(0.0);
    let high = last(start, start + 10.0, &|mean| belt(mean, level).0 <= x);
    let low = if belt(0.0, level).1 >= x { 0.0 } else { last(start, 0.0, &|mean| belt(mean, level).1 >= x) };
    (low, high)
}

/// How far beyond a bound, in standard deviations, an estimate counts: what lies further is a model that does not fit.
const BEYOND: f64 = -1.0;

/// The 90 % interval of a parameter inside `bounds` whose unbounded estimate and standard deviation are known.
pub fn interval90(value: f64, sd: f64, bounds: (f64, f64), freedom: f64) -> (f64, f64) {
    let unit = sd.max(1e-300) * t_quantile_95(freedom) / t_quantile_95(f64::INFINITY);
    let (from_low, from_high) = ((value - bounds.0) / unit, (bounds.1 - value) / unit);
    // Far from both it is the plain interval.
    let (low, high) = if from_low.min(from_high) > 6.0 {
        (value - 1.644_853_6 * unit, value + 1.644_853_6 * unit)
    } else if from_low <= from_high {
        let (a, b) = above_zero(from_low.max(BEYOND), 0.9);
        (bounds.0 + a * unit, bounds.0 + b * unit)
    } else {
        let (a, b) = above_zero(from_high.max(BEYOND), 0.9);
        (bounds.1 - b * unit, bounds.1 - a * unit)
    };
    (low.max(bounds.0), high.min(bounds.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    /// Table X of Feldman and Cousins 1998, 90 % and 95 %.
    #[test]
    fn intervals_are_those_of_the_published_table() {
        let table = [
            (-3.0, 0.9, 0.0, 0.26),
            (-2.0, 0.9, 0.0, 0.40),
            (-1.0, 0.9, 0.0, 0.81),
            (0.0, 0.9, 0.0, 1.64),
            (1.0, 0.9, 0.0, 2.64),
            (2.0, 0.9, 0.58, 3.64),
            (3.0, 0.9, 1.37, 4.64),
            (-1.0, 0.95, 0.0, 1.10),
            (0.0, 0.95, 0.0, 1.96),
            (2.0, 0.95, 0.35, 3.96),
        ];
        for (x, level, low, high) in table {
            let (a, b) = above_zero(x, level);
            assert!((a - low).abs() < 0.006 && (b - high).abs() < 0.006, "{x} at {level}: {a} {b}");
        }
    }

    /// The belt holds what it is made for, wherever the truth is.
    #[test]
    fn intervals_hold_nine_of_ten_truths_also_at_the_bound() {
        let mut draws = Draws::new(4, 0);
        for truth in [0.0, 0.4, 1.0, 2.5, 8.0] {
            let held = (0..2000)
                .filter(|_| {
                    let (low, high) = above_zero(truth + draws.normal(), 0.9);
                    low <= truth && truth <= high
                })
                .count();
            assert!(held.abs_diff(1800) < 54, "{held} of 2000 at {truth}");
        }
    }

    #[test]
    fn bounds_on_either_side_are_mirrored() {
        let (low, high) = interval90(0.99, 0.01, (0.3, 1.0), f64::INFINITY);
        assert!((low - 0.97355).abs() < 1e-4 && high == 1.0, "{low} {high}");
        let (low, high) = interval90(0.01, 0.01, (0.0, 1.0), f64::INFINITY);
        assert!(low == 0.0 && (high - 0.02645).abs() < 1e-4, "{low} {high}");
    }
}
