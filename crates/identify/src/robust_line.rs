//! A line of labels over grip force that single pulls move little.

use gripgen_twin::values::median;

/// Pulls that a line is fitted to, at least.
const MIN_PULLS: usize = 8;
/// Deviations beyond which a pull pulls a line less (Huber's 95 % efficiency).
const HUBER: f64 = 1.345;
/// Rounds of the reweighting; it has settled long before.
const ROUNDS: usize = 20;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// Scatter that a label has at least, as a share of the grip force: without it a table of rounded numbers has wonders.
const MIN_SCATTER: f64 = 1e-3;

/// The line: label = `at_zero_n + slope` times grip force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustLine {
    /// Label at no grip force.
    pub at_zero_n: f64,
    /// Label over grip force.
    pub slope: f64,
    /// Scatter of labels as a share of the grip force.
    pub scatter: f64,
}

impl RobustLine {
    /// The line through pulls (grip force, label), relative to the grip force (iteratively reweighted least squares with Huber's
    /// weights); `None` for too few.
    pub fn of(pulls: &[(f64, f64)]) -> Option<Self> {
        if pulls.len() < MIN_PULLS {
            return None;
        }
        let mut weights = vec![1.0; pulls.len()];
        let mut found = Self { at_zero_n: 0.0, slope: 0.0, scatter: MIN_SCATTER };
        for _ in 0..ROUNDS {
            // label / force = slope + at_zero / force, by weighted least squares.
            let sum = |of: &dyn Fn(f64, f64) -> f64| {
                pulls
                    .iter()
                    .zip(&weights)
                    .map(|((force, label), w)| w * of(1.0 / force, label / force))
                    .sum::<f64>()
            };
            let n = sum(&|_, _| 1.0);
            let (mean_x, mean_y) = (sum(&|x, _| x) / n, sum(&|_, y| y) / n);
            let xx = sum(&|x, _| (x - mean_x) * (x - mean_x));
            // One level of force has no line, only a mean.
            let at_zero_n = if xx > 1e-9 * n * mean_x * mean_x {
                sum(&|x, y| (x - mean_x) * (y - mean_y)) / xx
            } else {
                0.0
            };
            found.at_zero_n = at_zero_n;
            found.slope = mean_y - at_zero_n * mean_x;
            let residuals: Vec<f64> = pulls
                .iter()
                .map(|(force, label)| (label - at_zero_n - found.slope * force).abs() / force)
                .collect();
            found.scatter = (NORMAL * median(residuals.clone()).unwrap_or(0.0)).max(MIN_SCATTER);
            for (weight, residual) in weights.iter_mut().zip(&residuals) {
                *weight = (HUBER * found.scatter / residual.max(1e-300)).min(1.0);
            }
        }
        Some(found)
    }

    /// The label at a grip force.
    pub fn at(&self, grip_force_n: f64) -> f64 {
        self.at_zero_n + self.slope * grip_force_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_not_moved_by_a_few_wild_pulls() {
        // 2 x 0.15 F + 1, with a scatter of 1 % of F, and one pull in ten far off.
        let pulls: Vec<(f64, f64)> = (0..200)
            .map(|i| {
                let force = 20.0 + f64::from(i % 50);
                let noise = [0.01, -0.01, 0.004, -0.004, 0.0][i as usize % 5];
                let wild = if i % 10 == 7 { 0.3 * force } else { 0.0 };
                (force, 1.0 + 0.3 * force + noise * force + wild)
            })
            .collect();
        let found = RobustLine::of(&pulls).unwrap();
        assert!((found.slope - 0.3).abs() < 0.01 && (found.at_zero_n - 1.0).abs() < 0.3, "{found:?}");
        assert!((0.003..0.02).contains(&found.scatter), "{found:?}");
        assert_eq!(RobustLine::of(&pulls[..MIN_PULLS - 1]), None);
        // One level of force: the median, or near it.
        let level: Vec<(f64, f64)> = (0..9).map(|i| (40.0, 12.0 + 0.1 * f64::from(i))).collect();
        let found = RobustLine::of(&level).unwrap();
        assert!((found.at(40.0) - 12.4).abs() < 0.1, "{found:?}");
    }
}
