//! Whether the model describes the data at all: its error on held-out pulls against the scatter of repetitions.

use super::data::PullData;
use std::collections::BTreeMap;

/// How many times the scatter of repetitions an error on held-out pulls may be. A model that is right reaches the scatter itself
/// within a few per cent; three times it is nine times its variance, which no campaign of a dozen pulls shows by chance.
const MOST: f64 = 3.0;

/// Settings with repetitions that show a scatter.
const MIN_GROUPS: usize = 5;

/// Rows between repetitions that are near in time: `gripgen campaign` makes a reference grip before every eight others.
const NEAR_ROWS: usize = 9;

/// An error that no scatter explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NotDescribed {
    /// Error on held-out pulls.
    pub rmse_n: f64,
    /// Pooled scatter of repetitions that are near in time.
    pub scatter_n: f64,
    /// Settings that they are of.
    pub groups: usize,
}

impl std::fmt::Display for NotDescribed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { rmse_n, scatter_n, groups } = self;
        write!(
            f,
            "the model does not describe these data: its error on held-out pulls is {rmse_n:.2} N, and repetitions near in time scatter by \
             {scatter_n:.2} N (of {groups} settings): are the columns and the traces what they should be, or does something vary that is not in \
             the table?"
        )
    }
}

/// Says so where the error on held-out pulls is beyond what repetitions near in time explain. `rows` are the pulls that count.
pub(super) fn not_described(data: &PullData<'_>, rows: &[usize], rmse_n: f64) -> Option<NotDescribed> {
    // The row before of each setting, and the sum of squares and number of its differences.
    let mut last: BTreeMap<usize, usize> = BTreeMap::new();
    let mut of_group: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
    for &row in rows {
        let group = data.group_of[row];
        if let Some(before) = last.insert(group, row).filter(|before| row - before <= NEAR_ROWS) {
            let difference_n = data.label_n[row] - data.label_n[before];
            let (square, count) = of_group.entry(group).or_default();
            *square += difference_n * difference_n;
            *count += 1;
        }
    }
    let (square, count) = of_group.values().fold((0.0, 0), |(s, n), (square, k)| (s + square, n + k));
    // A difference has twice the variance of a label.
    let scatter_n = (square / (2.0 * count.max(1) as f64)).sqrt();
    let beyond = of_group.len() >= MIN_GROUPS && rmse_n > MOST * scatter_n.max(ROUNDING_N);
    beyond.then_some(NotDescribed { rmse_n, scatter_n, groups: of_group.len() })
}

/// Scatter of labels that are written with two decimals.
const ROUNDING_N: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::{Covariates, MeasuredPull, MeasuredPulls};

    /// Settings of two repetitions each, one right after the other, whose labels differ by 0.2 N, and a drift.
    fn campaign(settings: usize, apart: usize, drift_n: f64) -> MeasuredPulls {
        let pull = |i: usize, setting: usize| MeasuredPull {
            id: i.to_string(),
            part: "rod".into(),
            grip_pose: 0,
            grip_force_n: 5.0 + 5.0 * setting as f64,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates::default(),
            max_pull_force_n: 2.0
                + setting as f64
                + if i.is_multiple_of(2) { 0.1 } else { -0.1 }
                + drift_n * i as f64,
            zero_shift_n: 0.0,
            trace: None,
        };
        let order: Vec<usize> = match apart {
            1 => (0..2 * settings).map(|i| i / 2).collect(),
            _ => (0..2 * settings).map(|i| i % settings).collect(),
        };
        MeasuredPulls {
            pulls: order.iter().enumerate().map(|(i, s)| pull(i, *s)).collect(),
            recorded: vec![],
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            sha256: String::new(),
        }
    }

    fn said(measured: &MeasuredPulls, rmse_n: f64) -> Option<NotDescribed> {
        let data = PullData::new(measured);
        let rows: Vec<usize> = (0..data.len()).collect();
        not_described(&data, &rows, rmse_n)
    }

    #[test]
    fn an_error_of_more_than_three_times_the_scatter_of_repetitions_is_said() {
        // Differences of 0.2 N: a scatter of 0.14 N.
        let good = campaign(6, 1, 0.0);
        assert_eq!(said(&good, 0.4), None);
        let found = said(&good, 0.45).unwrap();
        assert!((found.scatter_n - 0.2 / 2.0_f64.sqrt()).abs() < 1e-9 && found.groups == 6);
        assert!(found.to_string().contains("0.45 N") && found.to_string().contains("0.14 N"), "{found}");
        assert_eq!(said(&campaign(4, 1, 0.0), 5.0), None, "four settings are too few");
    }

    /// What drifts from one end of a campaign to the other is no scatter of repetitions.
    #[test]
    fn repetitions_far_apart_say_nothing() {
        assert_eq!(said(&campaign(20, 20, 1.0), 50.0), None);
        assert!(said(&campaign(20, 1, 0.01), 0.6).is_some());
    }
}
