//! Whether an injection ended as it must.

use super::bench_tests::{LONGEST_S, Made};
use super::injection::{Injection, Kind, Moment};
use gripgen_rig::experiment::PullOutcome;
use gripgen_rig::experiment::pull::ExecutedPull;
use gripgen_rig_sim::faults::{Device, Fault};
use gripgen_twin::PerJaw;
use std::fmt::{Display, Formatter};

/// At this pull the part slips: the plant's own number.
const SLIPS_N: f64 = 10.25;
/// The plant has no noise.
const TOLERANCE_N: f64 = 0.01;
/// A pull that nothing disturbs is over by then, as [`LONGEST_S`] is counted.
const UNDISTURBED_S: f64 = 15.0;
/// Control step of the robot.
const STEP_S: f64 = 0.002;

/// How a pull ended.
pub enum Ended {
    /// With this label.
    Labelled(f64),
    /// Without one.
    Failed(String),
    /// Its thread died.
    Dead,
}

/// What is said of an injection.
pub struct Report {
    pub ended: Ended,
    /// From the injection until the arm stood and the call had come back.
    pub seconds: f64,
}

impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match &self.ended {
            Ended::Labelled(force_n) => write!(f, "labelled {force_n:.2} N")?,
            Ended::Failed(reason) => write!(f, "failed: {reason}")?,
            Ended::Dead => write!(f, "dead")?,
        }
        write!(f, " ({:.2} s)", self.seconds)
    }
}

pub fn verdict(injection: &Injection, made: Made) -> Report {
    let Injection { kind, moment, .. } = *injection;
    assert!(made.came, "the moment never came: {:?}", made.pull.map(|pull| pull.outcome));
    let stood_s = made.stood_s.expect("the arm does not stand");
    assert!(made.stayed, "the arm does not stay where it is");
    assert_eq!(made.let_go.filter(|_| kind != Kind::Rig(Fault::PartLost)), None);
    let seconds = made.returned_s.max(stood_s);
    // A machine that is busy makes the injection late: whether a label may come of it is asked at the moment that it hit.
    let both =
        |is: fn(Kind, Moment) -> bool| is(kind, moment) && made.moment.is_none_or(|moment| is(kind, moment));
    let ended = match &made.pull {
        None => Ended::Dead,
        Some(pull) => outcome(pull, kind, both(must_stop), both(must_fail)),
    };
    let stopped = made.pull.as_ref().is_none_or(|pull| pull.stopped.is_some());
    let limit_s = if stopped { LONGEST_S } else { UNDISTURBED_S };
    assert!(seconds < limit_s, "it took {seconds:.2} s");
    // What spoils only what is said next, or weighs only on the way back, is noticed when the part is let go already.
    let late = match kind {
        Kind::Rig(fault) => {
            matches!(fault, Fault::Truncate(_) | Fault::Garble(_) | Fault::PartLost | Fault::Hang(_))
        }
        other => other == Kind::Touch,
    };
    if !matches!(ended, Ended::Labelled(_)) && !late {
        assert!(made.held.1 || !made.held.0, "the jaws held, and do not any more");
    }
    if let Some(again) = made.again {
        let again = again.unwrap_or_else(|e| panic!("the next pull: {e}"));
        let PullOutcome::Labelled(_) = again.outcome else { panic!("the next pull: {:?}", again.outcome) };
        check_data(&again);
    }
    Report { ended, seconds }
}

/// The outcome of a pull, which has to be one of those that this fault may have.
fn outcome(pull: &ExecutedPull, kind: Kind, must_stop: bool, must_fail: bool) -> Ended {
    assert!(pull.stopped.is_some() || !must_stop, "nothing was stopped");
    match &pull.outcome {
        PullOutcome::Labelled(label) => {
            assert!(!must_fail, "a pull is labelled that was disturbed");
            check_data(pull);
            Ended::Labelled(label.max_pull_force_n)
        }
        PullOutcome::NoContact => panic!("there was a part between the jaws"),
        PullOutcome::Failed { reason } => {
            let words = causes(kind);
            assert!(
                words.iter().any(|word| reason.contains(word)),
                "the reason names none of {words:?}: {reason}"
            );
            let stopped = pull.stopped.as_ref().expect("a pull that failed was stopped");
            assert!(stopped.reason == *reason && stopped.steps.len() >= 4, "{stopped:?}");
            // Only a robot that nobody can hear may be in doubt.
            let deaf = kind.device() == Some(Device::Rtde) && !matches!(kind, Kind::Rig(Fault::Drop(_)));
            assert!(stopped.still || deaf, "{stopped:?}");
            Ended::Failed(reason.clone())
        }
    }
}

/// Label, trace and images are those of the plant.
fn check_data(pull: &ExecutedPull) {
    let PullOutcome::Labelled(label) = &pull.outcome else { return };
    assert!(
        (label.max_pull_force_n - SLIPS_N).abs() < TOLERANCE_N && !label.censored,
        "the part slips at {SLIPS_N} N: {label:?}"
    );
    let trace = pull.trace.as_ref().expect("a label comes from a trace");
    let pulled: Vec<f64> = trace.time_s.iter().copied().filter(|t| *t >= 0.0).collect();
    for pair in pulled.windows(2) {
        assert!((pair[1] - pair[0] - STEP_S).abs() < 1e-6, "the trace has a gap: {pair:?}");
    }
    // The plant's images are of one colour each: 20 with open jaws, 120 with the part.
    for (images, level) in [(&pull.rest, 20), (&pull.images, 120)] {
        let PerJaw { left, right } = images.as_ref().expect("a labelled pull has its images");
        for (image, level) in [(left, level), (right, level + 1)] {
            assert!(image.rgb.iter().all(|x| x.abs_diff(level) <= 3), "{} instead of {level}", image.rgb[0]);
        }
    }
}

/// Faults that a pull cannot have a label after, this early: from the moment at which the jaws slide its program may end by itself,
/// and a label that is complete stays.
fn must_fail(kind: Kind, moment: Moment) -> bool {
    moment < Moment::Sliding && must_stop(kind, moment)
}

/// Faults that stop everything, this early.
fn must_stop(kind: Kind, moment: Moment) -> bool {
    use Device::{CameraLeft, CameraRight, Dashboard, Gripper, Rtde, Script};
    if kind.is_short() {
        return false;
    }
    let before = match kind {
        Kind::Rig(Fault::EmergencyStop | Fault::ProtectiveStop) | Kind::Interrupt | Kind::Death => {
            Moment::Retract
        }
        Kind::Rig(Fault::Drop(d) | Fault::Refuse(d) | Fault::Truncate(d) | Fault::Delay(d, _)) => match d {
            Rtde => Moment::Retract,
            Gripper => Moment::Sliding,
            CameraLeft | CameraRight => Moment::Settling,
            // Its last words can be lost; it is not asked anything.
            Script if matches!(kind, Kind::Rig(Fault::Drop(_) | Fault::Refuse(_))) => Moment::Release,
            Script | Dashboard => return false,
        },
        Kind::Rig(Fault::Garble(Rtde)) => Moment::Retract,
        Kind::Rig(Fault::Freeze(_)) => Moment::Settling,
        Kind::Rig(Fault::PartLost) => return (Moment::Settling..Moment::NearSlip).contains(&moment),
        Kind::Rig(Fault::Hang(_)) => {
            return matches!(moment, Moment::Approach | Moment::Dwell | Moment::MidPull);
        }
        Kind::Touch => return moment == Moment::MidPull,
        // The program waits for its go; a host that does not look at its robot has no heartbeat.
        Kind::Stuck => return (Moment::Zeroing..=Moment::Dwell).contains(&moment),
        _ => return false,
    };
    moment < before
}

/// What a reason has to name.
fn causes(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Rig(Fault::EmergencyStop) => &["ROBOT_EMERGENCY_STOP"],
        Kind::Rig(Fault::ProtectiveStop) => &["PROTECTIVE_STOP"],
        Kind::Rig(Fault::PartLost) => &["the gripper is in state 3", "no part at this width"],
        Kind::Rig(Fault::Hang(_)) | Kind::Touch => {
            &["more force than is allowed", "something else", "preload", "tolerance"]
        }
        Kind::Interrupt => &["interrupted"],
        Kind::Stuck => &["program ended"],
        Kind::Death | Kind::SlowReader => &[],
        Kind::Rig(Fault::Freeze(_)) => match kind.device() {
            Some(Device::CameraLeft) => &["the left camera is frozen"],
            _ => &["the right camera is frozen"],
        },
        _ => match kind.device() {
            Some(Device::Rtde) => &["the robot"],
            Some(Device::Script) => &["the primary interface"],
            Some(Device::Gripper) => &["the gripper"],
            Some(Device::CameraLeft) => &["the left camera"],
            Some(Device::CameraRight) => &["the right camera"],
            // The pull itself does not need the dashboard.
            Some(Device::Dashboard) | None => &[],
        },
    }
}
