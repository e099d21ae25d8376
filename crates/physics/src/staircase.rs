//! The pull of the experiment: a force staircase until the jaws slip.

use crate::session::{Command, PullError, PullSession, PullState};
use gripgen_twin::label::forces::{PeakSearch, PullForces};
use gripgen_twin::random::Stream;
use gripgen_twin::{PullEnd, PullSettings, PullTrace, Staircase, TraceRow};

/// A finished pull.
#[derive(Debug, Clone, PartialEq)]
pub struct StaircaseResult {
    /// Every reading of the wrist sensor, up to and including the one beyond the displacement stop.
    pub trace: PullTrace,
    /// What ended the pull.
    pub end: PullEnd,
    /// Whether the jaws slid on the part, or crept along it to the stop; if not, the label is a lower bound.
    pub slid: bool,
    /// Peak and sliding friction.
    pub forces: PullForces,
}

/// How far a pull goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// To the displacement stop, for its trace.
    Stopped,
    /// Until its label and its forces cannot change any more: the same numbers, about a third of the steps less.
    Decided,
}

/// The staircase of a pull; `jitter` is asked only if the steps vary.
pub fn staircase_of(pull: &PullSettings, jitter: &mut Stream) -> Staircase {
    if pull.step_jitter == 0.0 {
        return Staircase::constant(pull.increment_n, pull.step_s, pull.max_time_s).starting_at(pull.start_n);
    }
    Staircase::from_steps(pull.increment_n, pull.max_time_s, || {
        pull.step_s * (1.0 + pull.step_jitter * (2.0 * jitter.uniform() - 1.0))
    })
    .starting_at(pull.start_n)
}

/// Runs `session` up the staircase until displacement, force or time ends it.
///
/// A row holds the command and the reading at its time; the command then acts until the next row. The first row,
/// at time 0, is the reading before the pull.
///
/// # Errors
///
/// As [`PullSession::step`].
pub fn pull_staircase(
    session: &mut PullSession,
    staircase: &Staircase,
    pull: &PullSettings,
    until: Until,
) -> Result<StaircaseResult, PullError> {
    pull_staircase_seen(session, staircase, pull, until, |_| {})
}

/// The same; `see` is called with the state of each row.
///
/// # Errors
///
/// As [`PullSession::step`].
pub fn pull_staircase_seen(
    session: &mut PullSession,
    staircase: &Staircase,
    pull: &PullSettings,
    until: Until,
    mut see: impl FnMut(&PullState),
) -> Result<StaircaseResult, PullError> {
    let mut trace = PullTrace::default();
    let (mut search, mut is_found) = (PeakSearch::default(), false);
    let rate_hz = session.rate_hz();
    let mut tick = 0_u64;
    let end = loop {
        let time_s = tick as f64 / rate_hz;
        let desired_force_n = staircase.desired_n(time_s);
        let state = session.state();
        see(&state);
        trace.push(TraceRow {
            time_s,
            desired_force_n,
            measured_force_n: state.measured_force_n,
            displacement_m: state.displacement_m,
        });
        is_found = is_found || search.take(&trace, tick as usize);
        if state.displacement_m > pull.stop_m {
            break PullEnd::Displacement;
        }
        // The measured force stays below what the jaws hold, the command only rises.
        let undecided = desired_force_n - pull.label_tolerance_n <= session.largest_reading_n();
        if until == Until::Decided && session.has_slid() && !undecided && is_found {
            break PullEnd::Decided;
        }
        if pull.max_force_n.is_some_and(|limit| desired_force_n > limit) {
            break PullEnd::ForceLimit;
        }
        if (tick + 1) as f64 / rate_hz > pull.max_time_s {
            break PullEnd::TimeLimit;
        }
        session.step(Command::ForceN(desired_force_n), 1.0 / rate_hz)?;
        tick += 1;
    };
    // Creep as far as the stop is the part lost, as slip is; gels whose shear alone reaches it still hold.
    let crept = end == PullEnd::Displacement && session.crept_m() > 0.5 * pull.stop_m;
    let forces = search.forces(&trace);
    Ok(StaircaseResult { trace, end, slid: session.has_slid() || crept, forces })
}
