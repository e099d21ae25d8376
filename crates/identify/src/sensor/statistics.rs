//! A few functions of statistics.

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

/// 95 % quantile of Student's t, within 1 % for 3 degrees of freedom or more (Hill's expansion about the normal one).
pub(crate) fn t95(degrees: f64) -> f64 {
    let z = 1.644_853_626_951_472_2_f64;
    if degrees < 1.5 {
        return 6.314;
    }
    if degrees < 2.5 {
        return 2.920;
    }
    let z3 = z * z * z;
    let z5 = z3 * z * z;
    let z7 = z5 * z * z;
    z + (z3 + z) / (4.0 * degrees)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * degrees * degrees)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * degrees * degrees * degrees)
}

/// Mean and its standard error.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    if values.is_empty() {
        return (0.0, 0.0);
    }
    let mean = values.iter().sum::<f64>() / n;
    if values.len() < 2 {
        return (mean, f64::INFINITY);
    }
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, libm::sqrt(square / (n - 1.0) / n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_and_quantiles_are_those_of_the_tables() {
        // Chi-squared with 1, 2 and 10 degrees of freedom: 5 % points 3.841, 5.991, 18.307.
        for (degrees, point) in [(1.0, 3.841_458_8), (2.0, 5.991_464_5), (10.0, 18.307_038)] {
            assert!((gamma_tail(degrees / 2.0, point / 2.0) - 0.05).abs() < 1e-7, "{degrees}");
        }
        assert!((gamma_tail(1.0, 30.0) - libm::exp(-30.0)).abs() < 1e-18);
        for (degrees, t) in [(3.0, 2.353), (5.0, 2.015), (11.0, 1.796), (23.0, 1.714)] {
            assert!((t95(degrees) - t).abs() < 0.02 * t, "{degrees}: {}", t95(degrees));
        }
    }
}
