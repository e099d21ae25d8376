//! The scatter of friction from grip to grip, with its interval.
//!
//! A residual e has the variance v + b s^2: v is what noise adds, b what the scatter s of the limit does to the reading that is
//! compared. The likelihood is that of the fits, Student's t with 6 degrees of freedom, whose scale is taken so that normal
//! residuals give back their standard deviation.

use super::context::Context;
use super::fitting::Fitted;
use crate::grouped::t_quantile_95;

/// Degrees of freedom of the fits.
const FREEDOM: f64 = 6.0;

/// Most likely scale of Student's t for normal residuals, over their standard deviation: where the mean of 7 z^2 / (6 k^2 + z^2)
/// is 1.
const SCALE: f64 = 0.875_318;

/// Scatter that is a prediction's own: of a slip in a trace, and of a label.
const MODEL: (f64, f64) = (0.001, 0.003);

/// Largest scatter that is tried, and the number of values.
const MAX_SCATTER: f64 = 0.3;
const VALUES: usize = 600;

/// Value and 90 % interval of the scatter of a fit.
pub(super) fn scatter(context: &Context<'_>, fitted: &Fitted, rows: &[usize]) -> (f64, f64, f64) {
    let sd = context.deviations(&fitted.model, rows);
    let mut still = fitted.model.clone();
    still.scatter = 0.0;
    let noise = context.deviations(&still, rows);
    let n = rows.len() as f64;
    let parts = fitted.model.mu.len() as f64 + 1.0;
    let few = n / (n - parts).max(1.0);
    let square = fitted.model.scatter * fitted.model.scatter;
    let each: Vec<(f64, f64, f64)> = fitted
        .residuals
        .iter()
        .zip(&sd)
        .zip(&noise)
        .zip(rows)
        .map(|(((r, sd), noise), &row)| {
            let own = if context.observed[row].is_some() { MODEL.0 } else { MODEL.1 };
            let v = noise * noise;
            let b = ((sd * sd - v) / square).max(0.0);
            (few * r * r * sd * sd, v + b * own * own, b)
        })
        .collect();
    let cost = |scatter: f64| -> f64 {
        each.iter()
            .map(|(ee, v, b)| {
                let variance = v + b * scatter * scatter;
                let z = ee / (FREEDOM * SCALE * SCALE * variance);
                libm::log(variance) + (FREEDOM + 1.0) * libm::log1p(z)
            })
            .sum()
    };
    // Evenly in the square root: fine at the bound.
    let at = |i: usize| MAX_SCATTER * (i as f64 / VALUES as f64).powi(2);
    let costs: Vec<f64> = (0..=VALUES).map(|i| cost(at(i))).collect();
    let best = (0..=VALUES).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
    let memory = fitted.likelihood.memory;
    let stretch = (1.0 + memory) / (1.0 - memory);
    let critical = costs[best] + stretch * t_quantile_95(n - parts).powi(2);
    let end = |inside: usize, outside: usize| {
        let share = (critical - costs[inside]) / (costs[outside] - costs[inside]);
        at(inside) + share.clamp(0.0, 1.0) * (at(outside) - at(inside))
    };
    let low = (1..=best).rev().find(|&i| costs[i - 1] > critical).map_or(0.0, |i| end(i, i - 1));
    let high = (best..VALUES).find(|&i| costs[i + 1] > critical).map_or(MAX_SCATTER, |i| end(i, i + 1));
    (at(best), low, high)
}
