//! How much of the traces is used.

use gripgen_twin::{MeasuredPull, PullTrace};

/// Traces that are always used, and the share of them beyond that. The model of arm and loop is good to about a hundredth: with
/// the traces of all pulls a diagnosis is sure of what the model does not have, and calls it an effect.
const FEW_TRACES: usize = 24;
const SHARE_OF_TRACES: usize = 4;

/// Takes away all traces but so many, evenly spread, and says so.
pub(super) fn fewer_traces(pulls: &mut [MeasuredPull], notes: &mut Vec<String>) {
    let traced = pulls.iter().filter(|p| p.trace.is_some()).count();
    let kept = FEW_TRACES.max(pulls.len() / SHARE_OF_TRACES);
    if traced <= kept {
        return;
    }
    let with_trace = pulls.iter_mut().filter(|p| p.trace.is_some());
    for (i, pull) in with_trace.enumerate() {
        // The first of each stretch of `traced / kept`.
        if i * kept % traced >= kept {
            pull.trace = None;
        }
    }
    notes.push(format!("traces of {kept} of {traced} pulls are used: more of them would say more of the arm than its model knows"));
}

/// Time between the readings of a trace that are used. The force loop feeds noise back with its lag, so readings that are
/// closer say the same again; taken as new ones they make a diagnosis too sure of itself.
const READING_STEP_S: f64 = 0.01;

/// Every so many rows of a trace, its first row of the pull among them.
pub(super) fn thinned(trace: &PullTrace) -> PullTrace {
    let begun = trace.time_s.partition_point(|&t| t < 0.0);
    let pulled = trace.time_s.get(begun..).unwrap_or_default();
    let step_s = match pulled {
        [first, .., last] => (last - first) / (pulled.len() - 1) as f64,
        _ => return trace.clone(),
    };
    let every = (READING_STEP_S / step_s).round().max(1.0) as usize;
    trace.rows().enumerate().filter(|(i, _)| i % every == begun % every).map(|(_, row)| row).collect()
}

#[cfg(test)]
pub(in crate::load) mod tests {
    use super::*;
    use gripgen_twin::{Covariates, TraceRow};

    pub(in crate::load) fn pull(i: usize) -> MeasuredPull {
        MeasuredPull {
            id: i.to_string(),
            part: "p".into(),
            grip_pose: 0,
            grip_force_n: 10.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.1,
            covariates: Covariates::default(),
            max_pull_force_n: 3.0,
            zero_shift_n: 0.0,
            trace: Some(PullTrace::default()),
        }
    }

    #[test]
    fn of_many_traces_some_are_used_and_all_of_a_few() {
        for (n, kept) in [(5, 5), (24, 24), (25, 24), (60, 24), (120, 30), (1000, 250)] {
            let (mut pulls, mut notes): (Vec<_>, Vec<_>) = ((0..n).map(pull).collect(), vec![]);
            fewer_traces(&mut pulls, &mut notes);
            assert_eq!(pulls.iter().filter(|p| p.trace.is_some()).count(), kept, "of {n}");
            assert_eq!(notes.len(), usize::from(kept < n));
            let last = pulls.iter().rposition(|p| p.trace.is_some()).unwrap();
            assert!(last + 5 >= n - 1, "evenly spread: the last of {n} is {last}");
        }
    }

    #[test]
    fn traces_keep_a_reading_every_ten_milliseconds_and_the_first_of_the_pull() {
        let at = |time_s: f64| TraceRow {
            time_s,
            desired_force_n: 1.0,
            measured_force_n: time_s,
            displacement_m: 0.0,
        };
        // 500 per second, some before the pull, with a gap.
        let before = (0..21).map(|i| at(-3.0 + 0.002 * f64::from(i)));
        let trace: PullTrace = before.chain((0..501).map(|i| at(0.002 * f64::from(i)))).collect();
        let thin = thinned(&trace);
        let pulled: Vec<f64> = thin.time_s.iter().copied().filter(|t| *t >= 0.0).collect();
        assert_eq!(pulled.len(), 101);
        assert_eq!(pulled[0], 0.0);
        assert!(pulled.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-12));
        assert_eq!(thin.len() - pulled.len(), 4, "four or five of 21 before the pull");
        // What is as slow already stays as it is.
        assert_eq!(thinned(&thin), thin);
        assert_eq!(thinned(&PullTrace::default()), PullTrace::default());
    }
}
