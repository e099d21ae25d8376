//! What a change comes to in numbers, each with its 90 % interval.

use super::tried::SINK_IN_STEP;
use super::verdict::mean_and_se;
use super::{Change, DayNumber};
use crate::sensor::Sensor;
use gripgen_twin::values::t_quantile_95;

/// The mean factor of some logarithms of radii.
pub(super) fn radius(ln_radii: &[f64]) -> DayNumber {
    let (mean, se) = mean_and_se(ln_radii);
    let off = t_quantile_95(ln_radii.len() as f64 - 1.0) * se;
    let at = |off: f64| libm::exp(mean + off);
    DayNumber { name: "radius_factor", value: at(0.0), low90: at(-off), high90: at(off) }
}

/// The numbers of a change, each from its fits without a press.
pub(super) fn numbers(change: &Change, folds: &[Change], sensor: &Sensor, ball_m: f64) -> Vec<DayNumber> {
    let of = |change: &Change| named_numbers(change, sensor, ball_m);
    let each: Vec<Vec<(&'static str, f64, f64)>> = folds.iter().map(of).collect();
    let n = folds.len();
    let number = |(k, (name, value, step)): (usize, (&'static str, f64, f64))| {
        let without: Vec<f64> = each.iter().filter_map(|numbers| Some(numbers.get(k)?.1)).collect();
        let mean = without.iter().sum::<f64>() / without.len().max(1) as f64;
        let squares: f64 = without.iter().map(|v| (v - mean) * (v - mean)).sum();
        // A value on a grid is known to a step of it at best.
        let se = libm::hypot((squares * (n.max(1) - 1) as f64 / n.max(1) as f64).sqrt(), step / 12f64.sqrt());
        let off = t_quantile_95(n as f64 - 1.0) * se;
        DayNumber { name, value, low90: value - off, high90: value + off }
    };
    of(change).into_iter().enumerate().map(number).collect()
}

/// Name, value and step of the grid of each number of a change.
fn named_numbers(change: &Change, sensor: &Sensor, ball_m: f64) -> Vec<(&'static str, f64, f64)> {
    let mm = 1e3;
    match change {
        Change::Nothing => vec![],
        Change::Light(light) => {
            let means = [0, 1, 2].map(|c| {
                let sum: f64 = sensor.rest[c].iter().map(|&v| f64::from(v)).sum();
                sum / sensor.rest[c].len().max(1) as f64
            });
            let gain =
                |c: usize| (0..3).map(|d| light.mixture[c][d] * means[d]).sum::<f64>() / means[c].max(1.0);
            let names = ["level_ratio_red", "level_ratio_green", "level_ratio_blue"];
            let slopes = [
                ["slope_x_red", "slope_y_red"],
                ["slope_x_green", "slope_y_green"],
                ["slope_x_blue", "slope_y_blue"],
            ];
            let levels = (0..3).map(|c| (names[c], gain(c), 0.0));
            levels
                .chain((0..3).flat_map(|c| [0, 1].map(|i| (slopes[c][i], light.field[c][i], 0.0))))
                .collect()
        }
        Change::Gel { sink_in_fraction, width } => {
            let before = sensor.pyramid.as_ref().map_or(0.0, |pyramid| pyramid.sink_in_fraction);
            vec![
                ("sink_in_fraction", *sink_in_fraction, SINK_IN_STEP),
                ("sink_in_fraction_before", before, 0.0),
                ("halo_width_factor", *width, *width * (std::f64::consts::SQRT_2 - 1.0)),
            ]
        }
        Change::Scale { zoom, .. } => {
            let mm_per_px = sensor.grid.metres_per_px * mm;
            vec![("zoom", *zoom, 0.0), ("mm_per_px", mm_per_px / zoom, 0.0)]
        }
        Change::Ball { factor } => {
            vec![("diameter_factor", *factor, 0.0), ("ball_mm", factor * ball_m * mm, 0.0)]
        }
        Change::Force { factor } => vec![("radius_factor", *factor, 0.0)],
    }
}
