//! How likely a measured label is under a twin: its predictive distribution over scatter and noise, and over what the posterior of
//! the twin leaves open.

use crate::location::Location;
use gripgen_twin::config::{ConfigError, Document};
use gripgen_twin::random::normal_quantile;
use gripgen_twin::{Posterior, Twin};

/// Twins that stand for a posterior: draws at equal steps of probability.
const TWINS: usize = 12;

/// Equal parts of the distribution of scatter over which labels are averaged.
const PARTS: usize = 60;

/// Least standard deviation of a label: that of rounding to a tenth of a newton.
const LEAST_SD_N: f64 = 0.03;

/// Label of one pull as a function of the scatter of friction: standard normal variable, mean and variance over noise, in rising order.
pub(crate) type LabelCurve = Vec<(f64, f64, f64)>;

/// Probability of a label below `label_n`: over noise it is normal, over scatter the curve is taken between its points.
pub(crate) fn share_below(curve: &[(f64, f64, f64)], label_n: f64) -> f64 {
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

/// Twins that stand for the posterior beside a twin; none where there is no such file.
///
/// # Errors
///
/// A file that is no posterior, or draws that make no twin.
pub fn posterior_twins(twin: &Location, document: &Document) -> Result<Vec<Twin>, ConfigError> {
    let Location::Disk(path) = twin else { return Ok(vec![]) };
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let path = path.with_file_name(Posterior::name_beside(&name));
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(vec![]) };
    let fault = |problem: String| ConfigError::new("twin", format!("{}: {problem}", path.display()));
    twins_of(&text, document)
        .map_err(|e| fault(e).hint("it belongs to the twin that was written with it; move it away"))
}

fn twins_of(text: &str, document: &Document) -> Result<Vec<Twin>, String> {
    let posterior = Posterior::parse(text).map_err(|e| e.to_string())?;
    let of = |k: usize| posterior.twin(posterior.at((k as f64 + 0.5) / TWINS as f64), document.table());
    (0..TWINS).map(of).collect::<Result<_, _>>().map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scatter and noise together are normal where the label is a straight line in the scatter.
    #[test]
    fn a_straight_curve_is_normal() {
        let curve: LabelCurve =
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
