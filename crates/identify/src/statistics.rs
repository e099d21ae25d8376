//! A few functions of statistics.

use crate::grouped::t_quantile_95;

/// Upper tail of the gamma distribution with this shape and scale 1 (series and continued fraction, Numerical Recipes
/// section 6.2).
pub(crate) fn gamma_tail(shape: f64, x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 || shape <= 0.0 {
        return 1.0;
    }
    let front = libm::exp(-x + shape * libm::log(x) - libm::lgamma(shape));
    if x < shape + 1.0 {
        let (mut term, mut sum, mut k) = (1.0 / shape, 1.0 / shape, shape);
        for _ in 0..500 {
            k += 1.0;
            term *= x / k;
            sum += term;
            if term < 1e-15 * sum {
                break;
            }
        }
        return (1.0 - front * sum).clamp(0.0, 1.0);
    }
    let mut b = x + 1.0 - shape;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..500 {
        let an = -f64::from(i) * (f64::from(i) - shape);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    (front * h).clamp(0.0, 1.0)
}

/// Mean and its standard error; infinite for one value.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n.max(1.0);
    if values.len() < 2 {
        return (mean, f64::INFINITY);
    }
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, libm::sqrt(square / (n - 1.0) / n))
}

/// Half the length of the 90 % interval of the logarithm of a root mean squared error whose `mean` square comes from the squares of
/// several parts, by the scatter of these. It is for the error of new data of the same size, whose own scatter is as large: root of 2.
pub(crate) fn log_error_half90(mean: f64, squares: &[f64]) -> f64 {
    let (_, deviation) = mean_and_error(squares);
    if mean > 0.0 && deviation.is_finite() {
        let t = t_quantile_95(squares.len() as f64 - 1.0);
        0.5 * std::f64::consts::SQRT_2 * t * (deviation / mean).min(3.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Chi-squared with 1, 2 and 10 degrees of freedom: 5 % points 3.841, 5.991, 18.307.
        for (degrees, point) in [(1.0, 3.841_458_8), (2.0, 5.991_464_5), (10.0, 18.307_038)] {
            assert!((gamma_tail(degrees / 2.0, point / 2.0) - 0.05).abs() < 1e-7, "{degrees}");
        }
        assert!((gamma_tail(1.0, 30.0) - libm::exp(-30.0)).abs() < 1e-18);
    }
}
