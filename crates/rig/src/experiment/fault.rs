//! What ends a pull before its end.

use crate::camera::{CameraWaitError, DecodeFrameError, ViewError};
use crate::dashboard::DashboardError;
use crate::gcl::{GclLinkError, GclSendError};
use crate::primary::{PrimaryLinkError, ScriptError};
use crate::program::{ProgramLimitError, StopReason};
use crate::robot_state::{RobotMode, SafetyStatus};
use crate::rtde::{LinkError, WriteError};
use gripgen_twin::Jaw;

/// Why an experiment was stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// Somebody pressed Ctrl-C.
    #[error("interrupted")]
    Interrupted,
    /// A question for a column was not answered.
    #[error("`{name}` was asked for, and the input ended without an answer")]
    Unanswered {
        /// The column.
        name: String,
    },
    /// The safety system.
    #[error("the robot is in {}", .status.name())]
    Safety {
        /// What it says.
        status: SafetyStatus,
    },
    /// Power or brakes.
    #[error("the robot is {}, it must be RUNNING", .mode.name())]
    Mode {
        /// What it is.
        mode: RobotMode,
    },
    /// A number of the robot that is not known.
    #[error("the robot says {what} {number}, which nobody knows")]
    Unknown {
        /// Which.
        what: &'static str,
        /// Its value.
        number: i32,
    },
    /// The speed slider.
    #[error(
        "the robot is slowed down: speed slider at {slider_percent:.0} %, trajectory limiter at {limiter_percent:.0} %, a pull \
         needs 100 % of both"
    )]
    Speed {
        /// What the slider says.
        slider_percent: f64,
        /// What the limiter says.
        limiter_percent: f64,
    },
    /// The robot's connection ended.
    #[error("the robot: {0}")]
    Robot(#[from] LinkError),
    /// It cannot be written to.
    #[error("the robot: {0}")]
    Write(#[from] WriteError),
    /// It says nothing.
    #[error("the robot said nothing for {silent_s:.3} s, {limit_s:.3} s are allowed")]
    Silent {
        /// For how long.
        silent_s: f64,
        /// The longest that is allowed.
        limit_s: f64,
    },
    /// It speaks, and its clock stands.
    #[error(
        "the robot's clock stands at {time_s:.3} s for {stood_s:.3} s now, {limit_s:.3} s are allowed: its readings say nothing new"
    )]
    ClockStands {
        /// Where it stands.
        time_s: f64,
        /// For how long.
        stood_s: f64,
        /// The longest that is allowed.
        limit_s: f64,
    },
    /// Data of it are missing.
    #[error("{gap_s:.3} s are missing between two readings of the robot, {limit_s:.3} s are allowed")]
    Gap {
        /// How much.
        gap_s: f64,
        /// The most that is allowed.
        limit_s: f64,
    },
    /// The primary interface, without which no program can be sent.
    #[error("the primary interface: {0}")]
    Primary(#[from] PrimaryLinkError),
    /// A rehearsal that cannot go on.
    #[error("{problem}")]
    Rehearsal {
        /// What is wrong, with its numbers.
        problem: String,
    },
    /// A force that neither the command nor a slip explains.
    #[error(
        "something else moved the tool: {measured_n:.1} N were measured at a command of {desired_n:.1} N, {low_n:.1} to {high_n:.1} N \
         can come of it"
    )]
    Disturbed {
        /// What was measured along the pull.
        measured_n: f64,
        /// What was commanded.
        desired_n: f64,
        /// Least that is believed.
        low_n: f64,
        /// Most that is believed.
        high_n: f64,
    },
    /// The reading is the mirror image of the command.
    #[error(
        "the force reads the wrong way: a newton of command reads {gain:.2} N with `robot.force_sign` = {sign:?}; {fits:?} fits this pull"
    )]
    ForceSign {
        /// `robot.force_sign` of the rig's file.
        sign: f64,
        /// The one that fits.
        fits: f64,
        /// What a newton of command reads as.
        gain: f64,
    },
    /// Something pulls at the tool already.
    #[error(
        "the preload is {preload_n:.1} N along the pull, {max_n} N are allowed: something else pulls at the tool"
    )]
    Preload {
        /// What was measured before the first step.
        preload_n: f64,
        /// The most that is allowed, in either direction.
        max_n: f64,
    },
    /// A program that could not be sent.
    #[error("the primary interface: {0}")]
    Script(#[from] ScriptError),
    /// A program of somebody else runs.
    #[error("the robot runs a program that nobody here has sent; {waited_s:.1} s were waited for its end")]
    Busy {
        /// For how long it was waited.
        waited_s: f64,
    },
    /// A program with a number that no program may have.
    #[error("the program: {0}")]
    Program(#[from] ProgramLimitError),
    /// The program ended, or is paused, where it should run.
    #[error("the robot's program ended in {what}{}", .said.as_ref().map(|s| format!(": {s}")).unwrap_or_default())]
    Ended {
        /// What it was doing.
        what: &'static str,
        /// What the controller says to it.
        said: Option<String>,
    },
    /// It broke itself off.
    #[error("{what} was broken off: {}", .reason.meaning())]
    BrokenOff {
        /// What it was doing.
        what: &'static str,
        /// Its reason.
        reason: StopReason,
    },
    /// Something took too long.
    #[error("{what} took {waited_s:.1} s, {limit_s:.1} s are allowed")]
    Late {
        /// What.
        what: &'static str,
        /// For how long.
        waited_s: f64,
        /// The longest that is allowed.
        limit_s: f64,
    },
    /// The gripper's connection.
    #[error("the gripper: {0}")]
    Gripper(#[from] GclLinkError),
    /// It was not sent a command.
    #[error("the gripper: {0}")]
    GripperSend(#[from] GclSendError),
    /// It refuses, or fails.
    #[error("the gripper answers `{line}`: {meaning}")]
    GripperFailed {
        /// Its line.
        line: String,
        /// What its status means.
        meaning: &'static str,
    },
    /// It answers something that is no answer.
    #[error("the gripper answers `{line}` to {asked}?, which cannot be read")]
    GripperUnread {
        /// What was asked.
        asked: &'static str,
        /// What came.
        line: String,
    },
    /// It moves no more, and did not say that it has finished.
    #[error("the gripper is in state {state} ({}), and never said that {command} is done", grip_state_name(*.state))]
    Unfinished {
        /// What was asked.
        command: &'static str,
        /// Its state.
        state: f64,
    },
    /// It does not hold the part any more.
    #[error("the gripper is in state {state} ({}) where it should hold the part", grip_state_name(*.state))]
    NotHolding {
        /// Its state.
        state: f64,
    },
    /// A camera.
    #[error("the {jaw} camera: {source}")]
    Camera {
        /// Which.
        jaw: Jaw,
        /// What is wrong.
        source: CameraWaitError,
    },
    /// A camera that sends one picture again and again, with new stamps.
    #[error(
        "the {jaw} camera is frozen: its frame in the grip is that of the open jaws {passed_s:.1} s before, byte by byte ({bytes} \
         bytes)"
    )]
    SameBytes {
        /// Which.
        jaw: Jaw,
        /// Time between both.
        passed_s: f64,
        /// Size of the frame.
        bytes: usize,
    },
    /// A camera that shows the past.
    #[error("the {jaw} camera is frozen: its frame of {time_s:.3} s by its own clock came again")]
    Frozen {
        /// Which.
        jaw: Jaw,
        /// The stamp.
        time_s: f64,
    },
    /// A camera whose frames come late: they show what was before.
    #[error(
        "the {jaw} camera shows the past: what comes now was taken {late_s:.3} s before it was asked for"
    )]
    Past {
        /// Which.
        jaw: Jaw,
        /// How long before.
        late_s: f64,
    },
    /// A frame that is none.
    #[error("the {jaw} camera: {source}")]
    Frame {
        /// Which.
        jaw: Jaw,
        /// What is wrong.
        source: DecodeFrameError,
    },
    /// A frame that does not fit its view.
    #[error("the {jaw} camera: {source}")]
    View {
        /// Which.
        jaw: Jaw,
        /// What is wrong.
        source: ViewError,
    },
    /// The dashboard.
    #[error("the dashboard: {0}")]
    Dashboard(#[from] DashboardError),
    /// A pose outside the box.
    #[error(
        "the tool would go to {axis} = {value_mm:.1} mm, the workspace goes from {low_mm} to {high_mm} mm"
    )]
    Workspace {
        /// x, y or z.
        axis: char,
        /// Where it would be.
        value_mm: f64,
        /// Where the box begins.
        low_mm: f64,
        /// Where it ends.
        high_mm: f64,
    },
}

impl Fault {
    /// What to do about it, where that is known.
    pub fn hint(&self) -> Option<&'static str> {
        Some(match self {
            Self::ForceSign { .. } => {
                "`gripgen rig check --mass-kg 1.0` finds the sign with a known mass; put it into the rig's file"
            }
            Self::Unanswered { .. } => {
                "`--ask` needs somebody at the keyboard; `--column NAME=VALUE` notes one value for all pulls"
            }
            Self::Speed { .. } => "move the speed slider of the teach pendant to 100 %",
            Self::Busy { .. } => "wait for its end, or stop it on the teach pendant; nothing was moved",
            Self::GripperUnread { .. } => {
                "is this the text interface (GCL) of a WSG 50? `gripgen rig check` asks it again"
            }
            _ => return None,
        })
    }
}

fn grip_state_name(state: f64) -> String {
    crate::gcl::GripState::from_number(state).map_or("unknown".into(), |s| format!("{s:?}"))
}
