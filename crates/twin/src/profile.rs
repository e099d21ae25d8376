//! The commanded pull: a force staircase.

/// A staircase `F_des(t) = F0 + (i - 1) dF` with steps that need not be equally long (Wucherer et al. 2023, who count
/// steps from 0).
///
/// Step `i` (counted from 1) begins at the end of step `i - 1`; step 1 begins at time 0 and already commands the
/// start force F0: one increment, as in the measured campaigns, unless [`Staircase::starting_at`] says otherwise.
/// Forces are in newtons along the pull, times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Staircase {
    increment_n: f64,
    start_n: f64,
    /// Start of each step; strictly increasing, the first at 0.
    starts_s: Vec<f64>,
}

impl Staircase {
    /// A staircase of constant steps that covers `duration_s`.
    pub fn constant(increment_n: f64, step_s: f64, duration_s: f64) -> Self {
        let steps = (duration_s / step_s).ceil().max(1.0) as usize;
        Self { increment_n, start_n: increment_n, starts_s: (0..steps).map(|i| i as f64 * step_s).collect() }
    }

    /// A staircase whose step lengths come from `step_s` (called once per step) until `duration_s` is covered.
    pub fn from_steps(increment_n: f64, duration_s: f64, mut step_s: impl FnMut() -> f64) -> Self {
        let mut starts_s = vec![0.0];
        let mut end = step_s();
        while end < duration_s {
            starts_s.push(end);
            end += step_s();
        }
        Self { increment_n, start_n: increment_n, starts_s }
    }

    /// The same steps from another start force; `None` leaves it at one increment.
    #[must_use]
    pub fn starting_at(self, start_n: Option<f64>) -> Self {
        Self { start_n: start_n.unwrap_or(self.increment_n), ..self }
    }

    /// The command while the last of `begun` steps lasts.
    fn command_n(&self, begun: usize) -> f64 {
        if begun == 0 {
            return 0.0;
        }
        // Not `start + (begun - 1) increment`, which rounds to other bits.
        if self.start_n == self.increment_n {
            return begun as f64 * self.increment_n;
        }
        self.start_n + (begun - 1) as f64 * self.increment_n
    }

    /// Height of one step.
    pub fn increment_n(&self) -> f64 {
        self.increment_n
    }

    /// The commanded force at `time_s`: 0 before the pull begins, the last step's force after the last start.
    pub fn desired_n(&self, time_s: f64) -> f64 {
        // A start that rounding puts a hair after the tick still belongs to the tick.
        let begun = self.starts_s.partition_point(|&start| start <= time_s + 1e-9);
        self.command_n(begun)
    }

    /// For commands at times that never fall, the first of them at `time_s`.
    pub fn from(&self, time_s: f64) -> StaircaseCursor<'_> {
        StaircaseCursor {
            staircase: self,
            begun: self.starts_s.partition_point(|&start| start <= time_s + 1e-9),
        }
    }
}

/// A staircase that is walked up: the same forces as [`Staircase::desired_n`] without a search.
#[derive(Debug, Clone)]
pub struct StaircaseCursor<'a> {
    staircase: &'a Staircase,
    begun: usize,
}

impl StaircaseCursor<'_> {
    /// The commanded force at `time_s`, which is not before the time asked for last.
    pub fn desired_n(&mut self, time_s: f64) -> f64 {
        let starts_s = &self.staircase.starts_s;
        while self.begun < starts_s.len() && starts_s[self.begun] <= time_s + 1e-9 {
            self.begun += 1;
        }
        self.staircase.command_n(self.begun)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn desired_force_follows_the_steps() {
        let s = Staircase::constant(0.5, 0.104, 1.0);
        for (time, force) in [(-0.1, 0.0), (0.0, 0.5), (0.103, 0.5), (0.104, 1.0), (0.52, 3.0)] {
            assert_eq!(s.desired_n(time), force, "at {time} s");
        }
    }

    #[test]
    fn the_start_force_shifts_the_first_step_and_all_after_it() {
        let plain = Staircase::constant(0.7, 0.1, 2.0);
        for (start_n, increment_n) in [(5.0, 0.7), (0.0, 0.7), (0.2, 1.5)] {
            let s = Staircase::constant(increment_n, 0.1, 2.0).starting_at(Some(start_n));
            assert_eq!(s.desired_n(-1e-3), 0.0, "before the pull");
            let mut cursor = s.from(0.0);
            for i in 0..20 {
                let time_s = f64::from(i) * 0.1 + 0.05;
                // The paper's formula, its steps counted from 0.
                let wanted = start_n + f64::from(i) * increment_n;
                assert!((s.desired_n(time_s) - wanted).abs() < 1e-12, "{time_s} s");
                assert_eq!(cursor.desired_n(time_s), s.desired_n(time_s), "{time_s} s");
            }
        }
        for same in [plain.clone().starting_at(None), plain.clone().starting_at(Some(0.7))] {
            for i in 0..40 {
                let time_s = f64::from(i) * 0.05;
                assert_eq!(same.desired_n(time_s).to_bits(), plain.desired_n(time_s).to_bits(), "{time_s} s");
            }
        }
    }

    #[test]
    fn uneven_steps_keep_their_lengths_and_never_fall() {
        let mut lengths = [0.1, 0.3, 0.05].into_iter().cycle();
        let s = Staircase::from_steps(2.0, 1.0, || lengths.next().unwrap());
        assert_eq!(s.desired_n(0.09), 2.0);
        assert_eq!(s.desired_n(0.35), 4.0);
        assert_eq!(s.desired_n(0.41), 6.0);
        let forces: Vec<f64> = (0..100).map(|i| s.desired_n(f64::from(i) * 0.01)).collect();
        assert!(forces.windows(2).all(|w| w[0] <= w[1]));
        for first in [-20, 0, 37, 250] {
            let mut cursor = s.from(f64::from(first) * 0.01);
            for i in first..300 {
                let time_s = f64::from(i) * 0.01;
                assert_eq!(cursor.desired_n(time_s), s.desired_n(time_s), "{time_s} s");
            }
        }
    }
}
