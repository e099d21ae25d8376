//! Forces of a pull in addition to its label: the peak while the jaws hold, and the friction of jaws that slide.
//!
//! Both are read from the trace alone, in the same way for simulated, imported and rig pulls. While the jaws hold, the tool moves
//! only as far as the force makes gel and arm yield; once they slip it moves on without a higher force. The peak is the largest
//! mean reading after which the tool moves on like that.

use crate::PullTrace;

/// Time over which readings are averaged.
const MEAN_S: f64 = 0.02;

/// How far past its place at the peak the tool has left the branch on which the jaws hold.
const LEFT_M: f64 = 1e-4;

/// Between these ways past that place jaws that slide are read. A mean that is higher within the second one is a higher peak.
const SLIDES_M: [f64; 2] = [2e-4, 1e-3];

/// On which branch of a pull its label was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LabelBranch {
    /// While the jaws held.
    Static,
    /// While the jaws held, and more than the tolerance of the rule below the peak: the loop trailed, or steps or noise were large, so that
    /// the rule was met for the last time before the slip.
    Early,
    /// After the tool had left that branch: the label is a friction of jaws that slide.
    Kinetic,
}

impl LabelBranch {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            LabelBranch::Static => "static",
            LabelBranch::Early => "early",
            LabelBranch::Kinetic => "kinetic",
        }
    }
}

/// Forces of a pull, in newtons along it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PullForces {
    /// Largest mean over 20 ms while the jaws hold; a lower bound where the pull ended before they slipped. `None` without
    /// displacements.
    pub peak_force_n: Option<f64>,
    /// Median reading from 0.2 to 1 mm past the peak's place; `None` if the pull ended before.
    pub kinetic_force_n: Option<f64>,
    /// When the tool had moved on by 0.1 mm; `None` if it did not.
    pub left_s: Option<f64>,
}

impl PullForces {
    /// Reads them from a trace.
    pub fn of(trace: &PullTrace) -> Self {
        let mut search = PeakSearch::default();
        for row in 0..trace.len() {
            if search.take(trace, row) {
                break;
            }
        }
        search.forces(trace)
    }

    /// The branch of a label that was read at `slip_time_s` by a rule with a tolerance; `None` without displacements.
    pub fn branch(&self, label_n: f64, slip_time_s: f64, tolerance_n: f64) -> Option<LabelBranch> {
        let peak_force_n = self.peak_force_n?;
        let kinetic = self.left_s.is_some_and(|left_s| slip_time_s > left_s);
        Some(match () {
            () if kinetic => LabelBranch::Kinetic,
            () if peak_force_n - label_n > tolerance_n => LabelBranch::Early,
            () => LabelBranch::Static,
        })
    }
}

/// The search for a peak, row by row, so that a simulated pull can end when it is known.
#[derive(Debug, Clone, Default)]
pub struct PeakSearch {
    /// First row of the pull, after readings without a load.
    start: usize,
    /// First row of the mean.
    first: usize,
    /// Row and mean of the highest one.
    highest: Option<(usize, f64)>,
}

impl PeakSearch {
    /// Takes the next row of a trace. True once the peak cannot change any more.
    pub fn take(&mut self, trace: &PullTrace, row: usize) -> bool {
        let time_s = trace.time_s[row];
        if time_s < 0.0 {
            (self.start, self.first) = (row + 1, row + 1);
            return false;
        }
        // Half a microsecond: times that were rounded to one are those of whole ticks.
        while trace.time_s[self.first] <= time_s - MEAN_S + 5e-7 {
            self.first += 1;
        }
        let place_m = trace.displacement_m[row];
        if self.first > self.start {
            let readings = &trace.measured_force_n[self.first..=row];
            let mean_n = readings.iter().sum::<f64>() / readings.len() as f64;
            if place_m.is_finite() && self.highest.is_none_or(|(_, highest_n)| mean_n > highest_n) {
                self.highest = Some((row, mean_n));
            }
        }
        self.highest.is_some_and(|(at, _)| place_m - trace.displacement_m[at] >= SLIDES_M[1])
    }

    /// What was found in the rows that were taken.
    pub fn forces(&self, trace: &PullTrace) -> PullForces {
        // A displacement that never changes was not measured.
        let moves = |&(at, _): &(usize, f64)| trace.displacement_m[at] != trace.displacement_m[self.start];
        let Some((at, peak_n)) = self.highest.filter(moves) else { return PullForces::default() };
        let past_m = |row: usize| trace.displacement_m[row] - trace.displacement_m[at];
        let end = (at..trace.len()).find(|&row| past_m(row) >= SLIDES_M[1]).unwrap_or(trace.len() - 1);
        let mut sliding_n: Vec<f64> = (at..=end)
            .filter(|&row| (SLIDES_M[0]..=SLIDES_M[1]).contains(&past_m(row)))
            .map(|row| trace.measured_force_n[row])
            .collect();
        sliding_n.sort_by(f64::total_cmp);
        let middle = sliding_n.len() / 2;
        let median_n = match sliding_n.len() {
            0 => None,
            n if n % 2 == 1 => Some(sliding_n[middle]),
            _ => Some(0.5 * (sliding_n[middle - 1] + sliding_n[middle])),
        };
        let left = (at..=end).find(|&row| past_m(row) >= LEFT_M);
        PullForces {
            peak_force_n: Some(peak_n),
            kinetic_force_n: median_n,
            left_s: left.map(|row| trace.time_s[row]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TraceRow;

    const RATE_HZ: f64 = 500.0;

    /// A pull at 10 N/s against 40 N/mm that holds 12 N, then slides at 20 mm/s under `kinetic_n`.
    fn pull(kinetic_n: f64, noise_n: impl Fn(usize) -> f64) -> PullTrace {
        let rows = (0..700).map(|i| {
            let time_s = i as f64 / RATE_HZ - 0.1;
            let desired_force_n = 10.0 * time_s.max(0.0);
            let slid_s = (time_s - 1.2).max(0.0);
            let held_n = if slid_s > 0.0 { kinetic_n } else { desired_force_n.min(12.0) };
            let displacement_m = held_n.max(if slid_s > 0.0 { 12.0 } else { 0.0 }) / 4e4 + 0.02 * slid_s;
            TraceRow { time_s, desired_force_n, measured_force_n: held_n + noise_n(i), displacement_m }
        });
        rows.collect()
    }

    #[test]
    fn peak_and_sliding_friction_are_those_of_the_pull() {
        let found = PullForces::of(&pull(9.0, |_| 0.0));
        // The mean of 20 ms of a ramp of 10 N/s lies 0.1 N below its end, less half a row.
        assert!((found.peak_force_n.unwrap() - 11.91).abs() < 0.011, "{found:?}");
        assert_eq!(found.kinetic_force_n, Some(9.0));
        assert!((found.left_s.unwrap() - 1.206).abs() < 0.003, "{found:?}");
        assert_eq!(found.branch(11.9, 1.19, 3.0), Some(LabelBranch::Static));
        assert_eq!(found.branch(8.8, 0.88, 3.0), Some(LabelBranch::Early));
        assert_eq!(found.branch(9.0, 1.3, 3.0), Some(LabelBranch::Kinetic));
    }

    /// Readings that alternate by 0.5 N average out over ten rows.
    #[test]
    fn noise_averages_out() {
        let found = PullForces::of(&pull(9.0, |i| if i % 2 == 0 { 0.5 } else { -0.5 }));
        assert!((found.peak_force_n.unwrap() - 11.91).abs() < 0.011, "{found:?}");
    }

    /// A tool that creeps at a level and is then pulled harder has not slipped there.
    #[test]
    fn creep_at_a_level_is_no_slip() {
        let mut trace = pull(9.0, |_| 0.0);
        for (row, time_s) in trace.time_s.clone().into_iter().enumerate() {
            trace.displacement_m[row] += 4e-4 * (time_s.clamp(0.4, 0.5) - 0.4) / 0.1;
        }
        assert!((PullForces::of(&trace).peak_force_n.unwrap() - 11.91).abs() < 0.011);
    }

    #[test]
    fn a_pull_that_holds_has_a_bound_and_one_without_displacements_nothing() {
        let mut trace = pull(9.0, |_| 0.0);
        let held = trace.time_s.partition_point(|&t| t < 1.0);
        let bound: PullTrace = (0..held).map(|row| trace.row(row)).collect();
        let found = PullForces::of(&bound);
        assert!(
            found.peak_force_n.unwrap() > 9.8 && found.kinetic_force_n.is_none() && found.left_s.is_none()
        );
        assert_eq!(found.branch(9.0, 0.9, 3.0), Some(LabelBranch::Static));
        trace.displacement_m.fill(0.0);
        assert_eq!(PullForces::of(&trace), PullForces::default());
        assert_eq!(PullForces::default().branch(1.0, 1.0, 3.0), None);
        assert_eq!(PullForces::of(&PullTrace::default()), PullForces::default());
    }
}
