//! The commanded pull: a force staircase.

use crate::PullTrace;

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

    /// The staircase that a trace carries: a step begins where its command does, within the time between two rows. `None` if
    /// the steps are those of this staircase as far as the rows can tell, or if the commands have another height or start.
    /// After the last row the steps go on with `step_s` until `duration_s`.
    pub fn of_trace(&self, trace: &PullTrace, step_s: f64, duration_s: f64) -> Option<Self> {
        let increment_n = self.increment_n;
        let rows: Vec<_> = trace.rows().filter(|row| row.time_s >= 0.0).collect();
        let first = rows.first()?;
        if (first.desired_force_n - self.start_n).abs() > 0.01 * increment_n {
            return None;
        }
        let (mut starts_s, mut nominal) = (vec![0.0], true);
        for pair in rows.windows(2) {
            let begun = ((pair[1].desired_force_n - self.start_n) / increment_n).round() + 1.0;
            if (self.command_n(begun.max(0.0) as usize) - pair[1].desired_force_n).abs() > 0.01 * increment_n
            {
                return None;
            }
            let new = begun - starts_s.len() as f64;
            if !(0.0..=1e4).contains(&new) {
                return None;
            }
            for k in 0..new as usize {
                let (low, high) = (pair[0].time_s, pair[1].time_s);
                let plain = starts_s.len() as f64 * step_s;
                nominal &= plain > low - 1e-6 && plain < high + 1e-6;
                // The length of a step where the rows allow it, else evenly between them.
                let after = starts_s[starts_s.len() - 1] + step_s;
                let evenly = low + (high - low) * (k as f64 + 1.0) / new;
                starts_s.push(if after > low && after <= high + 1e-9 { after } else { evenly });
            }
        }
        if nominal {
            return None;
        }
        let mut next = starts_s[starts_s.len() - 1] + step_s;
        while next < duration_s {
            starts_s.push(next);
            next += step_s;
        }
        Some(Self { increment_n, start_n: self.start_n, starts_s })
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
        let begun = self.starts_s.partition_point(|&start| start <= time_s + 1e-9);
        StaircaseCursor { staircase: self, begun, now_n: self.command_n(begun), next_s: self.start_s(begun) }
    }

    /// When a step begins, counted from 0; never, of one that there is not.
    fn start_s(&self, step: usize) -> f64 {
        self.starts_s.get(step).copied().unwrap_or(f64::INFINITY)
    }
}

/// A staircase that is walked up: the same forces as [`Staircase::desired_n`] without a search.
#[derive(Debug, Clone)]
pub struct StaircaseCursor<'a> {
    staircase: &'a Staircase,
    begun: usize,
    /// The command of the step that lasts.
    now_n: f64,
    /// When the next one begins.
    next_s: f64,
}

impl StaircaseCursor<'_> {
    /// The commanded force at `time_s`, which is not before the time asked for last.
    #[inline]
    pub fn desired_n(&mut self, time_s: f64) -> f64 {
        if self.next_s <= time_s + 1e-9 {
            self.climb(time_s);
        }
        self.now_n
    }

    /// The commanded force at ticks from `tick` on, at `time_s` of each of them, into `forces_n`; `rate_hz` are its ticks per second.
    pub fn fill(&mut self, forces_n: &mut [f64], tick: usize, rate_hz: f64, time_s: impl Fn(usize) -> f64) {
        let mut done = 0;
        while done < forces_n.len() {
            let now_s = time_s(tick + done);
            let force_n = self.desired_n(now_s);
            // The last tick of the step but for rounding, and what is left of it.
            let sure = (((self.next_s - now_s) * rate_hz) as usize).saturating_sub(2);
            let mut end = sure.saturating_add(done + 1).min(forces_n.len());
            while end < forces_n.len() && self.next_s > time_s(tick + end) + 1e-9 {
                end += 1;
            }
            forces_n[done..end].fill(force_n);
            done = end;
        }
    }

    #[cold]
    fn climb(&mut self, time_s: f64) {
        while self.next_s <= time_s + 1e-9 {
            self.begun += 1;
            self.next_s = self.staircase.start_s(self.begun);
        }
        self.now_n = self.staircase.command_n(self.begun);
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

    /// Filled at once as asked for tick by tick: steps that begin on a tick, between two and within less than one, and a second part that goes
    /// on where the first ended.
    #[test]
    fn filled_forces_are_those_of_each_tick() {
        let mut lengths = [0.13, 0.0007, 0.1, 0.0751].into_iter().cycle();
        let uneven = Staircase::from_steps(1.0, 3.0, || lengths.next().unwrap());
        for stairs in [Staircase::constant(1.0, 0.104, 3.0), uneven] {
            let time_s = |tick: usize| (tick as f64 / 500.0 - 0.014).max(0.0);
            let each: Vec<f64> = (0..2000).map(|tick| stairs.desired_n(time_s(tick))).collect();
            let (mut cursor, mut filled) = (stairs.from(0.0), vec![0.0; 2000]);
            let (first, second) = filled.split_at_mut(777);
            cursor.fill(first, 0, 500.0, time_s);
            cursor.fill(second, 777, 500.0, time_s);
            assert!(filled == each);
        }
    }

    /// A trace of rows every 10 ms brings steps that nobody planned, each begun between two rows; nominal steps are left alone.
    #[test]
    fn a_trace_brings_its_own_staircase() {
        let mut lengths = [0.13, 0.09, 0.1, 0.075].into_iter().cycle();
        let made = Staircase::from_steps(1.0, 3.0, || lengths.next().unwrap());
        let plain = Staircase::constant(1.0, 0.104, 3.0);
        let traced = |stairs: &Staircase| -> PullTrace {
            let row = |i: i32| {
                let time_s = 0.01 * f64::from(i);
                let desired_force_n = stairs.desired_n(time_s);
                crate::TraceRow { time_s, desired_force_n, measured_force_n: 0.0, displacement_m: 0.0 }
            };
            (0..200).map(row).collect()
        };
        assert_eq!(plain.of_trace(&traced(&plain), 0.104, 3.0), None);
        let found = plain.of_trace(&traced(&made), 0.104, 3.0).unwrap();
        for (a, b) in found.starts_s.iter().zip(&made.starts_s).take_while(|(_, b)| **b < 1.98) {
            assert!((a - b).abs() <= 0.0101, "{a} and {b}");
        }
        assert!(found.starts_s.last().unwrap() > &2.8, "it goes on after the trace");
        let other = Staircase::constant(0.7, 0.104, 3.0);
        assert_eq!(other.of_trace(&traced(&made), 0.104, 3.0), None, "no staircase of 0.7 N");
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
