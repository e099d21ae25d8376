//! The staircase that traces show, held against the one that their table says or does not say.

use super::cells::STEADY_RISE;
use gripgen_twin::values::median;
use gripgen_twin::{MeasuredPulls, PullTrace, rounded};

/// Rates of a trace over those of its table that are one staircase: rows and the jitter of steps blur a rate by a few per cent.
const SAME: (f64, f64) = (0.8, 1.25);

/// Steps that show a staircase.
const MIN_RISES: usize = 3;

/// Height and length of the steps of a command, where its rows are fine enough to show them.
fn shown(trace: &PullTrace) -> Option<(f64, f64)> {
    let command = &trace.desired_force_n;
    let rises: Vec<usize> = (1..command.len()).filter(|&i| command[i] > command[i - 1]).collect();
    // From the first step of the pull on: that to the first command is none.
    let own: Vec<usize> = rises.into_iter().filter(|&i| command[i - 1] > 0.0).collect();
    if own.len() < MIN_RISES {
        return None;
    }
    let height_n = median(own.iter().map(|&i| command[i] - command[i - 1]).collect())?;
    // Rows that are hardly finer than steps show a step of one or two rows: their mean is right.
    let (first, last) = (own[0], own[own.len() - 1]);
    let rate = (command[last] - command[first]) / (trace.time_s[last] - trace.time_s[first]);
    let length_s = height_n / rate;
    Some((height_n, length_s))
}

/// Takes the staircase of the traces where the table says none, and names the traces that contradict their table.
pub(super) fn hold_against_traces(measured: &mut MeasuredPulls) -> Option<String> {
    let said = |name: &str| measured.recorded.iter().any(|column| column == name);
    let said = said("force_increment_n") || said("step_time_s");
    if !said && measured.pulls.iter().all(|pull| pull.trace.is_none()) {
        measured.pulls.iter_mut().for_each(|pull| (pull.increment_n, pull.step_s) = STEADY_RISE);
        return None;
    }
    let seen: Vec<(usize, (f64, f64))> = (measured.pulls.iter().enumerate())
        .filter_map(|(i, pull)| Some((i, shown(pull.trace.as_ref()?)?)))
        .collect();
    let other: Vec<&(usize, (f64, f64))> = seen
        .iter()
        .filter(|(i, (height_n, length_s))| {
            let pull = &measured.pulls[*i];
            let ratio = (height_n / length_s) / (pull.increment_n / pull.step_s);
            !(SAME.0..=SAME.1).contains(&ratio)
        })
        .collect();
    let traced = measured.pulls.iter().filter(|pull| pull.trace.is_some()).count();
    let described = other.first().map(|(i, (height_n, length_s))| {
        let pull = &measured.pulls[*i];
        let shown = format!(
            "in the traces of {} of {traced} pulls the command rises by {} N every {} s (pull {})",
            other.len(),
            rounded(*height_n, &[]),
            rounded(*length_s, &[]),
            pull.id,
        );
        (shown, pull.increment_n, pull.step_s)
    });
    if said {
        return described.map(|(shown, table_n, table_s)| {
            format!(
                "{shown}, the table says {table_n} N every {table_s} s: `force_increment_n` is in newtons and `step_time_s` in seconds"
            )
        });
    }
    let of = |get: fn(&(f64, f64)) -> f64| median(seen.iter().map(|(_, s)| get(s)).collect());
    let usual = (of(|s| s.0)?, of(|s| s.1)?);
    // A pull without a trace was made like the others, if most of them were made so.
    if 2 * seen.len() > traced {
        let without = measured.pulls.iter_mut().filter(|pull| pull.trace.is_none());
        without.for_each(|pull| (pull.increment_n, pull.step_s) = usual);
    }
    for (i, own) in &seen {
        let pull = &mut measured.pulls[*i];
        (pull.increment_n, pull.step_s) = *own;
    }
    let (shown, ..) = described?;
    Some(format!(
        "{shown}, and the table has neither `force_increment_n` nor `step_time_s`: the staircase of the traces was taken"
    ))
}
