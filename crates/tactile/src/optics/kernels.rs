//! Blurs whose size is a real number, so that it can be fitted.

use crate::deform::gaussian;

/// The kernel of the gel's deformation of size `factor * size_px`: the weights of the two odd sizes next to it,
/// interpolated. At a factor of 1 it is that of `size_px`, bit for bit.
pub(super) fn scaled(size_px: u32, factor: f64) -> Vec<f32> {
    let size = (f64::from(size_px) * factor).max(1.0);
    let lower = 2 * ((size - 1.0) / 2.0).floor() as u32 + 1;
    let share = ((size - f64::from(lower)) / 2.0) as f32;
    let small = if lower == 1 { vec![1.0] } else { gaussian(lower) };
    if share == 0.0 {
        return small;
    }
    let mut weights = gaussian(lower + 2);
    for w in &mut weights {
        *w *= share;
    }
    for (w, s) in weights[1..].iter_mut().zip(&small) {
        *w += (1.0 - share) * s;
    }
    weights
}

/// Weights below this are left out.
const MIN_WEIGHT: f64 = 1e-7;

/// The discrete Gaussian of standard deviation `sigma_px` (Lindeberg 1990): `w_n = exp(-t) I_n(t)` with `t = sigma^2`
/// and the modified Bessel functions I_n. Unlike a sampled Gaussian it has exactly that variance however small it is, so
/// that the image is a smooth function of sigma.
pub(super) fn discrete_gaussian(sigma_px: f64) -> Vec<f32> {
    let t = sigma_px * sigma_px;
    if t < 1e-12 {
        return vec![1.0];
    }
    // Miller's backward recurrence I_(n-1) = I_(n+1) + (2 n / t) I_n, normalised by I_0 + 2 sum I_n = exp(t).
    let start = 12 + libm::ceil(8.0 * sigma_px) as usize;
    let mut values = vec![0.0; start + 2];
    values[start] = 1e-290;
    for n in (1..=start).rev() {
        values[n - 1] = values[n + 1] + 2.0 * n as f64 / t * values[n];
        if values[n - 1] > 1e200 {
            for v in &mut values[n - 1..] {
                *v *= 1e-200;
            }
        }
    }
    let sum = values[0] + 2.0 * values[1..].iter().sum::<f64>();
    let half = values.iter().rposition(|v| v / sum >= MIN_WEIGHT).unwrap_or(0);
    (0..=2 * half).map(|i| (values[i.abs_diff(half)] / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variance(weights: &[f32]) -> f64 {
        let half = weights.len() as f64 / 2.0 - 0.5;
        weights.iter().enumerate().map(|(i, &w)| f64::from(w) * (i as f64 - half).powi(2)).sum()
    }

    #[test]
    fn scaled_kernels_meet_the_odd_sizes_and_grow_between_them() {
        assert_eq!(scaled(21, 1.0), gaussian(21));
        assert_eq!(scaled(51, 1.0), gaussian(51));
        assert_eq!(scaled(5, 0.2), [1.0]);
        // 21 * 5 / 3 = 35
        let (a, b) = (scaled(21, 5.0 / 3.0), gaussian(35));
        assert!(a.len() <= 37 && (variance(&a) - variance(&b)).abs() < 1e-4);
        let mut last = 0.0;
        for i in 0..151 {
            let weights = scaled(11, 0.5 + 0.01 * f64::from(i));
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6 && weights.len() % 2 == 1);
            assert!(variance(&weights) > last);
            last = variance(&weights);
        }
    }

    #[test]
    fn discrete_gaussians_have_their_variance_and_sum_to_one() {
        for sigma in [1e-3, 0.1, 0.3, 1.0, 2.5, 7.0, 40.0] {
            let weights = discrete_gaussian(sigma);
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sigma}: {sum}");
            let found = variance(&weights);
            assert!((found / (sigma * sigma) - 1.0).abs() < 2e-3 || sigma < 0.01, "{sigma}: {found}");
        }
        // exp(-1) I_n(1), Abramowitz & Stegun table 9.8
        let w = discrete_gaussian(1.0);
        let middle = w.len() / 2;
        assert!((f64::from(w[middle]) - 0.465_759_6).abs() < 1e-6);
        assert!((f64::from(w[middle + 1]) - 0.207_910_4).abs() < 1e-6);
        assert_eq!(discrete_gaussian(0.0), [1.0]);
    }
}
