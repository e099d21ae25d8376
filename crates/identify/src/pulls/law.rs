//! The offset law of a part, as a calibration states it.

use crate::diagnosis::ParameterEstimate;

/// The offset law of a part: its coefficient is mu (a + b / F_G) with the mu of the twin.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetLaw {
    /// The part.
    pub part: String,
    /// Coefficient a, 1.
    pub a: ParameterEstimate,
    /// Coefficient b.
    pub b_n: ParameterEstimate,
    /// Covariance of (a, b): variance of a, covariance in N, variance of b in N^2.
    pub covariance: [f64; 3],
    /// Largest relative standard deviation of the coefficient over the grip forces of the fit.
    pub largest_relative_sigma: f64,
    /// The same, of a fit to the least, the middle and the largest grip force alone.
    pub of_three_levels: Option<f64>,
}

/// Largest relative standard deviation of a + b / F over grip forces, from the values and their covariance.
pub(super) fn largest_relative_sigma((a, b): (f64, f64), [aa, ab, bb]: [f64; 3], range: (f64, f64)) -> f64 {
    (0..=40)
        .map(|k| range.0 + (range.1 - range.0) * f64::from(k) / 40.0)
        .map(|f| (aa + 2.0 * ab / f + bb / (f * f)).max(0.0).sqrt() / (a + b / f).abs().max(1e-9))
        .fold(0.0, f64::max)
}
