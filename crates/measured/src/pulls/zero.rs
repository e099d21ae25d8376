//! Where time 0 of a trace is: at the first step of its command.

use gripgen_twin::{MeasuredPull, PullTrace};

/// The staircase that a table says of a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plan {
    /// Command of the first step.
    pub(super) start_n: f64,
    pub(super) increment_n: f64,
    pub(super) step_s: f64,
}

impl Plan {
    pub(super) fn of(pull: &MeasuredPull) -> Self {
        let start_n = pull.start_n.unwrap_or(pull.increment_n);
        Self { start_n, increment_n: pull.increment_n, step_s: pull.step_s }
    }
}

/// A trace whose command is no staircase: where it begins is not known.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "its command never rises, from {from_s} s on it is {command_n} N while the sensor reads up to {reading_n} N; the staircase of \
     the table begins with {start_n} N and rises by {increment_n} N"
)]
pub(super) struct CommandNeverRises {
    from_s: f64,
    command_n: f64,
    reading_n: f64,
    start_n: f64,
    increment_n: f64,
}

/// The time of a trace at which its command begins; 0 where the rows say that it begins at 0.
pub(super) fn find_zero(trace: &PullTrace, plan: Plan) -> Result<f64, CommandNeverRises> {
    let command = &trace.desired_force_n;
    let first = command.iter().position(|&n| n > 0.0);
    // Rows between which the command rises.
    let rises: Vec<usize> = (1..command.len()).filter(|&i| command[i] > command[i - 1]).collect();
    let at_once =
        |i: usize| rises.iter().all(|&rise| rise <= i) && command[i] > plan.start_n + 1.5 * plan.increment_n;
    let never = |row: usize| CommandNeverRises {
        from_s: trace.time_s[row],
        command_n: command[row],
        reading_n: trace.measured_force_n.iter().copied().fold(0.0, f64::max),
        start_n: plan.start_n,
        increment_n: plan.increment_n,
    };
    let first = match first {
        Some(i) if at_once(i) => return Err(never(i)),
        Some(i) => i,
        None => return Err(never(0)),
    };
    let time_s = &trace.time_s;
    // A staircase that begins with 0 N shows itself one step later.
    let later_s = if plan.start_n > 0.0 { 0.0 } else { plan.step_s };
    let mut high_s = time_s[first] - later_s;
    let usual_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1).max(1) as f64;
    let mut low_s = match first.checked_sub(1) {
        Some(before) => time_s[before] - later_s,
        // The first row is somewhere in the first step.
        None => high_s - plan.step_s,
    };
    if (low_s - usual_s..=high_s + usual_s).contains(&0.0) {
        return Ok(0.0);
    }
    let after = rises.iter().filter(|&&rise| rise > first).zip(1..);
    for (&rise, step) in after {
        let since_s = later_s + f64::from(step) * plan.step_s;
        let (low, high) = (low_s.max(time_s[rise - 1] - since_s), high_s.min(time_s[rise] - since_s));
        if low >= high {
            break;
        }
        (low_s, high_s) = (low, high);
    }
    Ok(high_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::TraceRow;

    const PLAN: Plan = Plan { start_n: 1.0, increment_n: 1.0, step_s: 0.104 };

    /// A staircase that begins at `zero_s`, with a row every `row_s` from `before_s` before it.
    fn staircase(plan: Plan, zero_s: f64, row_s: f64, before_s: f64) -> PullTrace {
        let row = |i: usize| {
            let since_s = i as f64 * row_s - before_s;
            let steps = (since_s / plan.step_s + 1e-9).floor();
            let command = if since_s < -1e-9 { 0.0 } else { plan.start_n + plan.increment_n * steps };
            TraceRow {
                time_s: zero_s + since_s,
                desired_force_n: command,
                measured_force_n: command,
                displacement_m: 0.0,
            }
        };
        (0..(2.0 / row_s) as usize).map(row).collect()
    }

    #[test]
    fn a_trace_that_begins_at_0_is_left_alone() {
        let from_0 = Plan { start_n: 0.0, ..PLAN };
        for (plan, row_s) in [(PLAN, 0.002), (PLAN, 0.01), (PLAN, 0.1), (from_0, 0.002), (from_0, 0.05)] {
            for before_s in [0.3, 0.3 + 0.7 * row_s, 0.0] {
                let found = find_zero(&staircase(plan, 0.0, row_s, before_s), plan);
                assert_eq!(found, Ok(0.0), "{plan:?}, {row_s} s, {before_s} s");
            }
        }
    }

    /// Seconds of the recording, a clock that is late, times since 1970: found to a row, and better where steps narrow it down.
    #[test]
    fn a_trace_with_another_clock_is_moved_to_the_first_step() {
        let from_0 = Plan { start_n: 0.0, ..PLAN };
        for zero_s in [0.3, 5.0, -1.25, 1.7e9] {
            for (plan, row_s, within_s) in
                [(PLAN, 0.002, 0.0021), (PLAN, 0.1, 0.031), (from_0, 0.002, 0.0021)]
            {
                let trace = staircase(plan, zero_s, row_s, 0.31);
                let found = find_zero(&trace, plan).unwrap();
                assert!((found - zero_s).abs() <= within_s, "{zero_s} s, {row_s} s: {found}");
            }
        }
        // Without a row before the pull.
        let found = find_zero(&staircase(PLAN, 5.0, 0.002, 0.0), PLAN).unwrap();
        assert!((found - 5.0).abs() < 0.0021, "{found}");
    }

    #[test]
    fn a_command_that_never_rises_is_refused_with_both_numbers() {
        let mut trace = staircase(PLAN, 0.0, 0.01, 0.1);
        trace.desired_force_n.iter_mut().for_each(|n| *n = 0.0);
        let said = find_zero(&trace, PLAN).unwrap_err().to_string();
        assert!(said.contains("from -0.1 s on it is 0 N while the sensor reads up to 19 N"), "{said}");
        let jump = |n: &mut f64| *n = if *n > 0.0 { 20.0 } else { 0.0 };
        let mut trace = staircase(PLAN, 0.0, 0.01, 0.1);
        trace.desired_force_n.iter_mut().for_each(jump);
        let said = find_zero(&trace, PLAN).unwrap_err().to_string();
        assert!(said.contains("it is 20 N") && said.contains("begins with 1 N and rises by 1 N"), "{said}");
    }
}
