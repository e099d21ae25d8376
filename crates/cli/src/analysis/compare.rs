//! How far a twin is from measured pulls.

use crate::analysis::diagnose::{UnknownPartError, check_parts};
use crate::analysis::expect::{Expectations, QuietTwin};
use gripgen::Library;
use gripgen::in_parallel;
use gripgen_identify::share_below;
use gripgen_twin::{MeasuredPull, MeasuredPulls, PullTrace, Twin};
use std::collections::{BTreeMap, BTreeSet};

/// Errors of predicted labels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LabelErrors {
    /// Pulls.
    pub n: usize,
    /// Root of the mean squared error.
    pub rmse_n: f64,
    /// Mean of the absolute error as a share of the label.
    pub mape_pct: f64,
    /// Mean of predicted less measured.
    pub bias_n: f64,
}

/// A twin against measured pulls.
#[derive(Debug, Clone, PartialEq)]
pub struct PullComparison {
    /// All labels.
    pub pulls: LabelErrors,
    /// Labels by part.
    pub by_part: BTreeMap<String, LabelErrors>,
    /// Share of the labels inside their predictive 90 % interval: over scatter and noise, and the posterior of the twin where it has one.
    pub coverage90: f64,
    /// Pulls outside the grip forces on which an effect was fitted; they count all the same.
    pub outside_fit: usize,
    /// Traces, and the root of the mean squared difference of their readings.
    pub traces: (usize, f64),
    /// Label predicted for each pull.
    pub label_n: Vec<f64>,
    /// Readings predicted for the rows of each pull's trace from time 0 on, as far as the pull lasts; empty without a trace.
    pub trace_n: Vec<Vec<f64>>,
}

impl LabelErrors {
    fn of(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut sums = (0.0, 0.0, 0.0);
        let mut n = 0;
        for (measured, predicted) in pairs {
            let e = predicted - measured;
            sums = (sums.0 + e * e, sums.1 + e.abs() / measured.abs().max(0.1), sums.2 + e);
            n += 1;
        }
        let count = n.max(1) as f64;
        Self { n, rmse_n: (sums.0 / count).sqrt(), mape_pct: 100.0 * sums.1 / count, bias_n: sums.2 / count }
    }
}

/// Predicts every pull of a campaign through the simulator, with expected values over scatter and noise, and compares.
/// `library` holds the files of the twin.
///
/// # Errors
///
/// A part that the twin lacks.
pub fn compare_pulls(
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    jobs: usize,
) -> Result<PullComparison, UnknownPartError> {
    compare_pulls_with(measured, twin, &[], library, jobs)
}

/// The same for a twin with a posterior, for which the twins of `draws` stand: they make its intervals wider.
///
/// # Errors
///
/// A part that the twin lacks.
pub fn compare_pulls_with(
    measured: &MeasuredPulls,
    twin: &Twin,
    draws: &[Twin],
    library: &Library,
    jobs: usize,
) -> Result<PullComparison, UnknownPartError> {
    check_parts(measured, twin)?;
    let as_measured = |twin: &Twin| {
        let mut twin = twin.clone();
        twin.robot.feedback = measured.feedback.unwrap_or(twin.robot.feedback);
        twin
    };
    let twin = as_measured(twin);
    let quiet = QuietTwin::new(&twin);
    let drawn: Vec<QuietTwin> = draws.iter().map(|draw| QuietTwin::new(&as_measured(draw))).collect();
    let expectations = Expectations::new(measured, library);
    let n = measured.pulls.len();
    let predicted = in_parallel(n, jobs, |row| {
        let label_n = measured.pulls[row].max_pull_force_n;
        let (expected, curve) = expectations.expected_curve(&quiet, row, 1.0);
        let of = |draw| share_below(&expectations.expected_curve(draw, row, 1.0).1, label_n);
        let shares: Vec<f64> = drawn.iter().map(of).collect();
        let below = match shares.len() {
            0 => share_below(&curve, label_n),
            count => shares.iter().sum::<f64>() / count as f64,
        };
        (expected.label_n, (0.05..=0.95).contains(&below))
    });
    let inside = predicted.iter().filter(|(_, inside)| *inside).count();
    let label_n: Vec<f64> = predicted.into_iter().map(|(label_n, _)| label_n).collect();
    let traced: Vec<(usize, &PullTrace)> =
        measured.pulls.iter().enumerate().filter_map(|(i, p)| Some((i, p.trace.as_ref()?))).collect();
    let traces = in_parallel(traced.len(), jobs, |k| {
        let (row, trace) = traced[k];
        let readings = expectations.readings(&quiet, row, 1.0).measured_n;
        let at = |time_s: f64| readings.get((time_s * twin.wrist.rate_hz).round() as usize).copied();
        trace.time_s.iter().filter(|t| **t >= 0.0).map_while(|&t| at(t)).collect::<Vec<f64>>()
    });
    let mut trace_n = vec![vec![]; n];
    let (mut square, mut readings) = (0.0, 0);
    for (&(row, trace), predicted) in traced.iter().zip(traces) {
        let pulled = &trace.measured_force_n[trace.time_s.partition_point(|t| *t < 0.0)..];
        square += predicted.iter().zip(pulled).map(|(p, m)| (p - m) * (p - m)).sum::<f64>();
        readings += predicted.len();
        trace_n[row] = predicted;
    }
    let all = || measured.pulls.iter().zip(&label_n);
    let names: BTreeSet<&str> = measured.pulls.iter().map(|p| p.part.as_str()).collect();
    let by_part = names
        .into_iter()
        .map(|name| {
            let own = all().filter(|(p, _)| p.part == name).map(|(p, l)| (p.max_pull_force_n, *l));
            (name.to_string(), LabelErrors::of(own))
        })
        .collect();
    let outside = |p: &MeasuredPull| {
        twin.effects.iter().any(|e| {
            let range = e.fitted_grip_force_n.filter(|_| e.spec.is_load_law() && e.acts_on(&p.part));
            range.is_some_and(|(low, high)| !(low..=high).contains(&p.grip_force_n))
        })
    };
    Ok(PullComparison {
        pulls: LabelErrors::of(all().map(|(p, l)| (p.max_pull_force_n, *l))),
        by_part,
        coverage90: inside as f64 / n.max(1) as f64,
        outside_fit: measured.pulls.iter().filter(|p| outside(p)).count(),
        traces: (traced.len(), (square / readings.max(1) as f64).sqrt()),
        label_n,
        trace_n,
    })
}
