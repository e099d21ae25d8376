//! The rows of a trace that a label is chosen from, and their noise.

use super::{Expected, LabelEvidence};
use crate::PullTrace;

/// Time over which readings are averaged.
pub(super) const WINDOW_S: f64 = 0.05;
/// Fewest rows that are averaged.
const WINDOW_ROWS: usize = 5;
/// Fewest rows without a load that say something of the noise.
const NOISE_ROWS: usize = 10;
/// The median of a normal distribution's magnitude, in its standard deviations.
pub(super) const MEDIAN_OF_NORMAL: f64 = 0.6745;
/// Rounding of files that hold two decimals.
pub(super) const ROUNDING_N: f64 = 6e-3;

/// The pull up to its displacement stop, as columns, beside the readings before it.
pub(super) struct Signal<'a> {
    pub(super) time_s: &'a [f64],
    pub(super) desired_n: &'a [f64],
    pub(super) measured_n: &'a [f64],
    pub(super) displacement_m: &'a [f64],
    pub(super) before_n: &'a [f64],
    /// Mean time between two rows.
    pub(super) spacing_s: f64,
    /// Standard deviation of a reading.
    pub(super) noise_n: f64,
    /// Rows that are averaged.
    pub(super) window: usize,
    /// Sums of the readings before each row.
    sums: Vec<f64>,
    /// The last row that the label rule accepts.
    pub(super) last: Option<usize>,
}

impl<'a> Signal<'a> {
    /// `None` if there are too few rows, or some that are no numbers.
    pub(super) fn of(
        trace: &'a PullTrace,
        evidence: &LabelEvidence<'_>,
        expected: &Expected,
    ) -> Option<Self> {
        let n = trace.len();
        let columns = [&trace.desired_force_n, &trace.measured_force_n, &trace.displacement_m];
        if columns.iter().any(|column| column.len() != n) {
            return None;
        }
        let from = trace.time_s.partition_point(|&t| t < 0.0);
        let stop = trace.displacement_m[from..].iter().position(|&d| d > evidence.stop_m);
        let to = stop.map_or(n, |i| from + i + 1);
        if to - from < WINDOW_ROWS {
            return None;
        }
        let (time_s, measured_n) = (&trace.time_s[from..to], &trace.measured_force_n[from..to]);
        let desired_n = &trace.desired_force_n[from..to];
        let spacing_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64;
        let mut sum = 0.0;
        let mut sums = Vec::with_capacity(measured_n.len() + 1);
        sums.push(sum);
        let mut last = None;
        for (i, (f, d)) in measured_n.iter().zip(desired_n).enumerate() {
            sum += f;
            sums.push(sum);
            if (f - d).abs() < evidence.tolerance_n {
                last = Some(i);
            }
        }
        if !(sum.is_finite() && spacing_s > 0.0 && spacing_s.is_finite()) {
            return None;
        }
        let before_n = &trace.measured_force_n[..from];
        let noise_n = expected.noise_n.unwrap_or_else(|| noise_n(before_n, measured_n));
        let displacement_m = &trace.displacement_m[from..to];
        let window = ((WINDOW_S / spacing_s).round() as usize).max(WINDOW_ROWS);
        Some(Self {
            time_s,
            desired_n,
            measured_n,
            displacement_m,
            before_n,
            spacing_s,
            noise_n,
            window,
            sums,
            last,
        })
    }

    /// Rows.
    pub(super) fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Mean of the readings of some rows, which are not empty.
    pub(super) fn mean_n(&self, from: usize, to: usize) -> f64 {
        (self.sums[to] - self.sums[from]) / (to - from) as f64
    }

    /// The largest mean of a window inside these rows, and the row in its middle.
    pub(super) fn largest_mean_n(&self, from: usize, to: usize) -> Option<(f64, usize)> {
        let (w, to) = (self.window, to.min(self.len()));
        if from + w > to {
            return None;
        }
        let ends = self.sums[from + w..=to].iter().zip(&self.sums[from..]);
        let (mut largest, mut at) = (f64::NEG_INFINITY, 0);
        for (i, (end, start)) in ends.enumerate() {
            if end - start > largest {
                (largest, at) = (end - start, i);
            }
        }
        Some((largest / w as f64, from + at + w / 2))
    }

    /// Height of the largest step of the command.
    pub(super) fn largest_step_n(&self) -> f64 {
        self.desired_n.windows(2).map(|d| d[1] - d[0]).fold(0.0, f64::max)
    }

    /// Rows in so much time.
    pub(super) fn rows(&self, seconds: f64) -> usize {
        (seconds / self.spacing_s).round() as usize
    }
}

/// Mean, 0 of nothing.
pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Noise of a reading: the scatter without a load, and what second differences of the pull say, whichever is more. Steps of
/// the command are in fewer than half of these, and a median does not see them.
fn noise_n(before_n: &[f64], pull_n: &[f64]) -> f64 {
    let mut second: Vec<f64> = pull_n.windows(3).map(|f| (f[0] - 2.0 * f[1] + f[2]).abs()).collect();
    let middle = second.len() / 2;
    let in_pull_n = match second.is_empty() {
        true => 0.0,
        // A second difference has sqrt(6) of a reading's.
        false => {
            *second.select_nth_unstable_by(middle, f64::total_cmp).1 / (MEDIAN_OF_NORMAL * 6.0_f64.sqrt())
        }
    };
    if before_n.len() < NOISE_ROWS {
        return in_pull_n;
    }
    let zero_n = mean(before_n);
    let squares: f64 = before_n.iter().map(|f| (f - zero_n) * (f - zero_n)).sum();
    in_pull_n.max((squares / (before_n.len() - 1) as f64).sqrt())
}
