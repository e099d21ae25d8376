//! Noise of a force sensor: white noise beside a first-order autoregression.
//!
//! Residuals of a force sensor are alike from sample to sample; taking rows for independent is how a tool "finds"
//! everything. Here a stretch of rows is decorrelated by the Kalman filter of the model (Harvey 1989, section 3.4), for
//! any sampling times; after that, ordinary least squares is the maximum-likelihood fit.

use crate::draws::Draws;

/// Shape of the noise; its size is fitted with everything else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Correlation of the slow part after one median step, 0..1.
    pub correlation: f64,
    /// Variance of the white part over that of the slow part.
    pub white: f64,
}

impl Noise {
    /// Independent rows.
    pub const WHITE: Self = Self { correlation: 0.0, white: 0.0 };

    /// Variance of the noise where that of the slow part is 1.
    pub fn variance(&self) -> f64 {
        1.0 + self.white
    }
}

/// A decorrelating filter for the rows of a table.
#[derive(Debug, Clone)]
pub(crate) struct Whitener {
    /// For each row: correlation with the row before (0 at the start of a session), gain, 1 / root of the variance.
    steps: Vec<(f64, f64, f64)>,
    /// Sum of the logarithms of the innovations' variances.
    pub log_determinant: f64,
}

impl Whitener {
    /// `steps` are times since the row before in median steps; infinite at the start of a session.
    pub fn new(noise: Noise, steps: &[f64]) -> Self {
        let Noise { correlation, white } = noise;
        let mut left = 1.0;
        let mut log_determinant = 0.0;
        let log_correlation = libm::log(correlation.max(1e-300));
        let filter = steps
            .iter()
            .map(|&step| {
                let phi = if step.is_finite() && correlation > 0.0 {
                    libm::exp(log_correlation * step)
                } else {
                    0.0
                };
                let spread = phi * phi * left + 1.0 - phi * phi;
                let variance = spread + white;
                let gain = spread / variance;
                left = spread - gain * spread;
                log_determinant += libm::log(variance);
                (phi, gain, 1.0 / libm::sqrt(variance))
            })
            .collect();
        Self { steps: filter, log_determinant }
    }

    /// Decorrelates a column in place.
    pub fn apply(&self, column: &mut [f64]) {
        let mut state = 0.0;
        for (value, &(phi, gain, scale)) in column.iter_mut().zip(&self.steps) {
            let predicted = phi * state;
            let innovation = *value - predicted;
            *value = innovation * scale;
            state = predicted + gain * innovation;
        }
    }
}

/// Draws noise whose slow part has variance 1.
pub(crate) fn draw(noise: Noise, steps: &[f64], draws: &mut Draws) -> Vec<f64> {
    let mut slow = 0.0;
    let root_white = libm::sqrt(noise.white);
    let log_correlation = libm::log(noise.correlation.max(1e-300));
    steps
        .iter()
        .map(|&step| {
            let phi = if step.is_finite() && noise.correlation > 0.0 {
                libm::exp(log_correlation * step)
            } else {
                0.0
            };
            slow = phi * slow + libm::sqrt(1.0 - phi * phi) * draws.normal();
            slow + if root_white > 0.0 { root_white * draws.normal() } else { 0.0 }
        })
        .collect()
}

/// The noise of largest likelihood: a grid, then a search by halving steps. `cost` is minus the log-likelihood,
/// which comes back beside the noise.
pub(crate) fn fit_noise(mut cost: impl FnMut(Noise) -> f64) -> (Noise, f64) {
    const CORRELATIONS: [f64; 9] = [0.0, 0.3, 0.6, 0.8, 0.9, 0.96, 0.985, 0.995, 0.999];
    const WHITES: [f64; 5] = [0.0, 0.05, 0.5, 3.0, 30.0];
    let mut best = (cost(Noise::WHITE), Noise::WHITE);
    for correlation in CORRELATIONS.into_iter().skip(1) {
        for white in WHITES {
            let noise = Noise { correlation, white };
            let at = cost(noise);
            if at < best.0 {
                best = (at, noise);
            }
        }
    }
    if best.1.correlation == 0.0 {
        return (best.1, best.0);
    }
    let moved = |noise: Noise, time: f64, white: f64| {
        let tau = -1.0 / libm::log(noise.correlation) * time;
        Noise { correlation: libm::exp(-1.0 / tau).min(0.999_9), white: noise.white * white }
    };
    let mut factor = 1.6;
    while factor > 1.03 {
        let from = best.1;
        for (time, white) in [(factor, 1.0), (1.0 / factor, 1.0), (1.0, factor), (1.0, 1.0 / factor)] {
            let noise = moved(from, time, white);
            let at = cost(noise);
            if at < best.0 - 1e-6 {
                best = (at, noise);
            }
        }
        if best.1 == from {
            factor = libm::sqrt(factor);
        }
    }
    (best.1, best.0)
}

/// Largest autocorrelation of decorrelated residuals at lags 1 to 8. It is about 2.5 / sqrt(rows) if the noise is what
/// the model says.
pub(crate) fn left_correlation(innovations: &[f64]) -> f64 {
    let n = innovations.len();
    let power: f64 = innovations.iter().map(|x| x * x).sum();
    let at = |lag: usize| (lag..n).map(|i| innovations[i] * innovations[i - lag]).sum::<f64>() / power;
    if power > 0.0 && n > 8 { (1..=8).map(|lag| at(lag).abs()).fold(0.0, f64::max) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(n: usize) -> Vec<f64> {
        (0..n).map(|i| if i == 0 { f64::INFINITY } else { 1.0 }).collect()
    }

    /// Minus the log-likelihood of noise alone.
    fn cost(values: &[f64], steps: &[f64], noise: Noise) -> f64 {
        let whitener = Whitener::new(noise, steps);
        let mut v = values.to_vec();
        whitener.apply(&mut v);
        let n = v.len() as f64;
        0.5 * (n * libm::log(v.iter().map(|x| x * x).sum::<f64>() / n) + whitener.log_determinant)
    }

    /// Without a white part the filter is x_i - phi x_(i-1), scaled; with rows apart, phi to that power.
    #[test]
    fn an_autoregression_is_decorrelated_as_in_the_textbook() {
        let noise = Noise { correlation: 0.8, white: 0.0 };
        let mut v = vec![2.0, 3.0, 1.0];
        Whitener::new(noise, &[f64::INFINITY, 1.0, 2.0]).apply(&mut v);
        let scale = |phi: f64| 1.0 / libm::sqrt(1.0 - phi * phi);
        for (found, wanted) in v.iter().zip([2.0, (3.0 - 1.6) * scale(0.8), (1.0 - 0.64 * 3.0) * scale(0.64)])
        {
            assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
        }
    }

    #[test]
    fn drawn_noise_is_found_again_and_becomes_white() {
        for (correlation, white) in [(0.95, 0.0), (0.95, 1.0), (0.7, 0.2)] {
            let noise = Noise { correlation, white };
            let steps = even(6000);
            let values = draw(noise, &steps, &mut Draws::new(5, 0));
            let found = fit_noise(|n| cost(&values, &steps, n)).0;
            assert!((found.correlation - correlation).abs() < 0.04, "{noise:?}: {found:?}");
            let mut v = values;
            Whitener::new(found, &steps).apply(&mut v);
            assert!(left_correlation(&v) < 0.05);
        }
    }

    /// A smooth signal is no such noise, and it shows.
    #[test]
    fn smooth_residuals_stay_correlated() {
        let steps = even(2000);
        let rough = draw(Noise { correlation: 0.98, white: 0.0 }, &steps, &mut Draws::new(7, 0));
        let mut state = 0.0;
        let values: Vec<f64> = rough
            .iter()
            .map(|x| {
                state += 0.1 * (x - state);
                state
            })
            .collect();
        let found = fit_noise(|n| cost(&values, &steps, n)).0;
        let mut v = values;
        Whitener::new(found, &steps).apply(&mut v);
        assert!(left_correlation(&v) > 0.3, "{}", left_correlation(&v));
    }
}
