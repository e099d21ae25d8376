//! Which label is expected of a grip of a part at a grip force, and how far a pull is from it.

use super::rows::Rows;
use std::collections::BTreeMap;

/// Pulls of a grip that a line is fitted to, at least.
const FEW: usize = 8;
/// Deviations beyond which a pull pulls a line less (Huber's 95 % efficiency).
const HUBER: f64 = 1.345;
/// Rounds of the reweighting; it has settled long before.
const ROUNDS: usize = 20;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// Scatter that a label has at least, as a share of the grip force: without it a table of rounded numbers has wonders.
const LEAST: f64 = 1e-3;

/// The line of a grip of a part: label = `at_zero_n + slope` times grip force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) at_zero_n: f64,
    pub(super) slope: f64,
    /// Scatter of labels as a share of the grip force.
    pub(super) scatter: f64,
}

/// What is expected of a pull, and how far it is from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// Label that its grip has at its force.
    pub(super) label_n: f64,
    /// Standard deviations of the grip by which its label is above that.
    pub(super) deviations: f64,
}

/// Lines by part and grip, and what they say of each row.
pub(super) struct ExpectedLabels {
    pub(super) lines: BTreeMap<(String, String), Line>,
    rows: Vec<Option<Expected>>,
}

impl ExpectedLabels {
    pub(super) fn of_row(&self, row: usize) -> Option<Expected> {
        self.rows[row]
    }
}

/// Fits a line to the slipped pulls of each grip of each part, relative to the grip force and little moved by single pulls (iteratively
/// reweighted least squares with Huber's weights).
pub(super) fn expected(rows: &Rows<'_>) -> ExpectedLabels {
    let key = |row: usize| (rows.part(row).to_string(), rows.grip(row));
    let mut of_grip: BTreeMap<(String, String), Vec<(f64, f64)>> = BTreeMap::new();
    let pull = |row: usize| {
        let (force, label) = (rows.force_n(row), rows.label_n(row));
        (force > 0.0 && force.is_finite() && label.is_finite()).then_some((force, label))
    };
    for row in (0..rows.len()).filter(|&row| rows.status(row) == "slipped") {
        if let Some(pull) = pull(row) {
            of_grip.entry(key(row)).or_default().push(pull);
        }
    }
    let lines: BTreeMap<(String, String), Line> =
        of_grip.iter().filter_map(|(grip, pulls)| Some((grip.clone(), line(pulls)?))).collect();
    let of_row = |row: usize| {
        let line = lines.get(&key(row))?;
        // A lower bound, or nothing, is no deviation.
        let (force, label) = pull(row).filter(|_| ["slipped", "suspect"].contains(&rows.status(row)))?;
        let expected = line.at_zero_n + line.slope * force;
        Some(Expected { label_n: expected, deviations: (label - expected) / (line.scatter * force) })
    };
    ExpectedLabels { rows: (0..rows.len()).map(of_row).collect(), lines }
}

/// The line through pulls (grip force, label); `None` for too few.
fn line(pulls: &[(f64, f64)]) -> Option<Line> {
    if pulls.len() < FEW {
        return None;
    }
    let mut weights = vec![1.0; pulls.len()];
    let mut found = Line { at_zero_n: 0.0, slope: 0.0, scatter: LEAST };
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
        let at_zero_n =
            if xx > 1e-9 * n * mean_x * mean_x { sum(&|x, y| (x - mean_x) * (y - mean_y)) / xx } else { 0.0 };
        found.at_zero_n = at_zero_n;
        found.slope = mean_y - at_zero_n * mean_x;
        let residuals: Vec<f64> = pulls
            .iter()
            .map(|(force, label)| (label - at_zero_n - found.slope * force).abs() / force)
            .collect();
        found.scatter = (NORMAL * median(&residuals)).max(LEAST);
        for (weight, residual) in weights.iter_mut().zip(&residuals) {
            *weight = (HUBER * found.scatter / residual.max(1e-300)).min(1.0);
        }
    }
    Some(found)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
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
        let found = line(&pulls).unwrap();
        assert!((found.slope - 0.3).abs() < 0.01 && (found.at_zero_n - 1.0).abs() < 0.3, "{found:?}");
        assert!((0.003..0.02).contains(&found.scatter), "{found:?}");
        assert_eq!(line(&pulls[..FEW - 1]), None);
        // One level of force: the median, or near it.
        let level: Vec<(f64, f64)> = (0..9).map(|i| (40.0, 12.0 + 0.1 * f64::from(i))).collect();
        let found = line(&level).unwrap();
        assert!((found.at_zero_n + 40.0 * found.slope - 12.4).abs() < 0.1, "{found:?}");
    }
}
