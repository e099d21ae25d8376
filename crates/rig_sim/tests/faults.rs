//! Faults of every kind at every moment of a pull, on the virtual rig over loopback.
//!
//! After each: the call has come back, the virtual arm stands and stays so, the jaws hold what they held, and either the label
//! is right or the pull has none and says why. `GRIPGEN_FAULTS=200` makes so many injections; 40 of the first 200 are the
//! default. `GRIPGEN_FAULT=17` makes one of them alone.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

#[path = "faults/bench_tests.rs"]
mod bench_tests;
#[path = "faults/injection.rs"]
mod injection;
#[path = "faults/verdict.rs"]
mod verdict;
#[path = "faults/watch.rs"]
mod watch;

use gripgen_rig::experiment::PullOutcome;
use gripgen_rig_sim::faults::Device;
use injection::{ALL, Injection, injections};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use verdict::{Ended, Report, verdict};

/// Rigs at once.
const RIGS: usize = 4;
/// What is made where nothing is asked: every fifth of so many, which leaves no device out.
const DEFAULT: usize = 200;

fn chosen() -> Vec<Injection> {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<usize>().ok());
    match (number("GRIPGEN_FAULT"), number("GRIPGEN_FAULTS")) {
        (Some(one), _) => injections(one + 1).split_off(one),
        (None, Some(all)) => injections(all),
        (None, None) => injections(DEFAULT).into_iter().step_by(5).collect(),
    }
}

/// The robot is lost when the label is complete: everything is stopped, and the label stays.
#[test]
fn a_label_that_was_complete_survives_a_lost_connection() {
    for device in [Device::Rtde, Device::Gripper, Device::Script] {
        let pull = bench_tests::pull_and_lose(device, "releasing");
        let stopped = pull.stopped.as_ref().unwrap_or_else(|| panic!("{device:?}: nothing was stopped"));
        assert!(stopped.steps.len() >= 4, "{device:?}: {stopped:?}");
        let PullOutcome::Labelled(label) = &pull.outcome else { panic!("{device:?}: {:?}", pull.outcome) };
        assert!((label.max_pull_force_n - 10.25).abs() < 0.01 && !label.censored, "{device:?}: {label:?}");
        assert!(pull.trace.is_some() && pull.images.is_some(), "{device:?}");
        // Lost in the middle of the pull there is none.
        let pull = bench_tests::pull_and_lose(device, "pulling");
        assert!(matches!(pull.outcome, PullOutcome::Failed { .. }), "{device:?}: {:?}", pull.outcome);
    }
}

/// Makes an injection and checks how it ended; what is wrong is a line of text.
fn tried(injection: &Injection) -> Result<Report, String> {
    catch_unwind(AssertUnwindSafe(|| verdict(injection, bench_tests::make(injection)))).map_err(|panic| {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        words.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic").to_string()
    })
}

#[test]
fn whatever_goes_wrong_the_arm_stops_and_no_pull_is_labelled_from_it() {
    let (list, next) = (chosen(), AtomicUsize::new(0));
    let made: Mutex<Vec<(usize, Result<Report, String>)>> = Mutex::default();
    // What is wrong is told with its injection.
    std::panic::set_hook(Box::new(|_| ()));
    std::thread::scope(|scope| {
        for _ in 0..RIGS {
            scope.spawn(|| {
                while let Some(injection) = list.get(next.fetch_add(1, Ordering::SeqCst)) {
                    let result = tried(injection);
                    let words = match &result {
                        Ok(report) => report.to_string(),
                        Err(problem) => format!("WRONG: {problem}"),
                    };
                    println!("{injection}: {words}");
                    made.lock().unwrap().push((injection.number, result));
                }
            });
        }
    });
    let _ = std::panic::take_hook();
    let made = made.into_inner().unwrap();
    table(&list, &made);
    let wrong: Vec<_> = made.iter().filter_map(|(number, r)| Some((number, r.as_ref().err()?))).collect();
    assert!(wrong.is_empty(), "{} of {} injections: {wrong:#?}", wrong.len(), made.len());
    assert_eq!(made.len(), list.len());
}

/// A line for each kind.
fn table(list: &[Injection], made: &[(usize, Result<Report, String>)]) {
    let of: BTreeMap<usize, _> = made.iter().map(|(number, result)| (*number, result)).collect();
    println!("{:<22} {:>4} {:>9} {:>7} {:>5} {:>10}", "kind", "n", "labelled", "failed", "dead", "longest s");
    for kind in ALL {
        let results: Vec<_> =
            list.iter().filter(|i| i.kind == kind).filter_map(|i| of.get(&i.number)).collect();
        let reports: Vec<&Report> = results.iter().filter_map(|r| r.as_ref().ok()).collect();
        let count = |ended: fn(&Ended) -> bool| reports.iter().filter(|r| ended(&r.ended)).count();
        let longest_s = reports.iter().map(|r| r.seconds).fold(0.0, f64::max);
        println!(
            "{:<22} {:>4} {:>9} {:>7} {:>5} {longest_s:>10.2}",
            kind.to_string(),
            results.len(),
            count(|e| matches!(e, Ended::Labelled(_))),
            count(|e| matches!(e, Ended::Failed(_))),
            count(|e| matches!(e, Ended::Dead)),
        );
    }
}
