//! How likely a measured label is under a twin: its predictive distribution over scatter and noise.

use gripgen_twin::random::normal_quantile;

/// Equal parts of the distribution of scatter over which labels are averaged.
const PARTS: usize = 60;

/// Least standard deviation of a label: that of rounding to a tenth of a newton.
const LEAST_SD_N: f64 = 0.03;

/// Probability of a label below `label_n` under `curve`, the label of one pull as a function of the scatter of friction: standard
/// normal variable, mean and variance over noise, in rising order. Over noise it is normal, over scatter the curve is taken between its points.
pub fn share_below(curve: &[(f64, f64, f64)], label_n: f64) -> f64 {
    let at = |z: f64| {
        let next = curve.partition_point(|p| p.0 < z).clamp(1, curve.len().max(2) - 1);
        match (curve.get(next - 1), curve.get(next)) {
            (Some(a), Some(b)) => {
                let t = (z - a.0) / (b.0 - a.0);
                // Beyond the outer points the mean goes on, the variance stays.
                (a.1 + t * (b.1 - a.1), a.2 + t.clamp(0.0, 1.0) * (b.2 - a.2))
            }
            (Some(a), None) => (a.1, a.2),
            (None, _) => (0.0, 0.0),
        }
    };
    let parts = if curve.len() < 2 { 1 } else { PARTS };
    let sum: f64 = (0..parts)
        .map(|k| {
            let (mean, variance) = at(normal_quantile((k as f64 + 0.5) / parts as f64));
            let sd = variance.max(0.0).sqrt().max(LEAST_SD_N);
            0.5 * libm::erfc((mean - label_n) / sd * std::f64::consts::FRAC_1_SQRT_2)
        })
        .sum();
    sum / parts as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scatter and noise together are normal where the label is a straight line in the scatter.
    #[test]
    fn a_straight_curve_is_normal() {
        let curve: Vec<(f64, f64, f64)> =
            [-3.2, -2.0, -1.0, 0.0, 1.0, 2.0, 3.2].map(|z| (z, 12.0 + 0.4 * z, 0.09)).to_vec();
        let sd = (0.16_f64 + 0.09).sqrt();
        for (z, share) in [(-1.644_854, 0.05), (0.0, 0.5), (1.281_552, 0.9)] {
            let found = share_below(&curve, 12.0 + z * sd);
            assert!((found - share).abs() < 2e-3, "{z}: {found}");
        }
        // Without scatter there is one point.
        assert!((share_below(&[(0.0, 5.0, 0.01)], 5.0 + 0.1 * 1.644_854) - 0.95).abs() < 1e-6);
    }
}
