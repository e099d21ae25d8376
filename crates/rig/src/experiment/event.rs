//! What an experiment tells, and what comes of it.

use super::film::FilmedFrame;
use super::robot::RobotRow;
use crate::camera::CameraFrame;
use gripgen_twin::{Jaw, PerJaw, PlannedPull, PullTrace, SlipLabel, TactileImage};
use std::fmt::{Display, Formatter};
use std::sync::Arc;
use std::time::Instant;

/// What happens, for somebody who looks on.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum RigEvent {
    /// A pull of a campaign begins, or what comes before it.
    PullStarted {
        /// Its place among the pulls.
        place: u64,
        /// What is asked.
        planned: PlannedPull,
    },
    /// Images of both jaws were taken.
    Images {
        /// What for: `rest`, `grip` or `clock`.
        what: &'static str,
        /// The images, as their views turn them.
        images: PerJaw<TactileImage>,
    },
    /// A pull of a campaign is over, with or without a label.
    PullFinished {
        /// Its place among the pulls.
        place: u64,
        /// All that came of it.
        pull: Box<ExecutedPull>,
    },
    /// Everything was stopped.
    Stopped(Stopped),
    /// The robot stands still after a fault, and is connected again.
    Reconnecting {
        /// The fault.
        reason: String,
    },
    /// What is done now.
    Step(&'static str),
    /// A reading during the pull.
    Reading {
        /// Time since the pull began.
        time_s: f64,
        /// Commanded force.
        desired_n: f64,
        /// Measured force along the pull.
        measured_n: f64,
        /// Displacement.
        displacement_mm: f64,
    },
    /// A new frame of a camera as it came, where [`Experiment::show_frames`](super::Experiment::show_frames) asked for them.
    Frame {
        /// Which camera.
        jaw: Jaw,
        /// The frame.
        frame: Arc<CameraFrame>,
    },
    /// Words of a device.
    Said {
        /// Which.
        source: &'static str,
        /// What.
        text: String,
    },
}

/// Words that came, or were sent.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// When.
    pub at: Instant,
    /// Who.
    pub source: &'static str,
    /// What.
    pub text: String,
}

/// When a frame was taken and came.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameStamp {
    /// Which camera.
    pub jaw: Jaw,
    /// What it was taken for.
    pub what: &'static str,
    /// When it came.
    pub at: Instant,
    /// The camera's clock, where it has one.
    pub device_time_s: Option<f64>,
    /// The robot's clock when it came.
    pub robot_time_s: f64,
    /// The frame as it came.
    pub jpeg: Arc<CameraFrame>,
}

/// How a stop went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stopped {
    /// Why.
    pub reason: String,
    /// Whether the robot said itself that it stands still.
    pub still: bool,
    /// What was done, for the record.
    pub steps: Vec<String>,
    /// What to do about the reason, where that is known.
    pub hint: Option<&'static str>,
}

impl Display for Stopped {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let rest = match self.still {
            true => "the robot stands still",
            false => "NOBODY KNOWS WHETHER THE ROBOT STANDS STILL",
        };
        write!(f, "{}; {rest}, the gripper keeps what it holds", self.reason)
    }
}

/// What came of a pull.
#[derive(Debug, Clone, PartialEq)]
pub enum PullOutcome {
    /// The jaws slipped, or the pull ended before they did (`censored`).
    Labelled(SlipLabel),
    /// There was nothing between the jaws.
    NoContact,
    /// It has no label.
    Failed {
        /// Why.
        reason: String,
    },
}

/// A pull with all that came during it.
#[derive(Debug, Clone)]
pub struct ExecutedPull {
    /// What was asked.
    pub planned: PlannedPull,
    /// What came of it.
    pub outcome: PullOutcome,
    /// How everything was stopped, where something went wrong.
    pub stopped: Option<Stopped>,
    /// The force over time; rows before 0 are those without a load.
    pub trace: Option<PullTrace>,
    /// Grip images.
    pub images: Option<PerJaw<TactileImage>>,
    /// Images with open jaws.
    pub rest: Option<PerJaw<TactileImage>>,
    /// When the images came.
    pub frames: Vec<FrameStamp>,
    /// The film of both cameras from the closing of the jaws to the stop; empty where the rig does not film.
    pub film: Vec<PerJaw<FilmedFrame>>,
    /// Time from closing the jaws to the start of the pull, by the robot's clock.
    pub dwell_s: f64,
    /// The controller's clock at the start of the pull; that of the last reading where there was none.
    pub robot_time_s: f64,
    /// The same moment, in seconds since 1970 by this machine's clock.
    pub unix_s: f64,
    /// Force along the pull before it, N.
    pub preload_n: f64,
    /// Readings along the pull after it, jaws open and before anything moves or is zeroed again.
    pub no_load_after_n: Vec<f64>,
    /// How far the sensor's zero had moved along the pull when the jaws slipped; `None` without a label or without readings.
    pub zero_shift_n: Option<f64>,
    /// What the gripper said of the force of a jaw while it held, N.
    pub reported_force_n: Option<f64>,
    /// What is wrong with it beside its forces, a sentence each: its label is suspect.
    pub doubts: Vec<String>,
    /// Everything that the robot said.
    pub rows: Vec<RobotRow>,
    /// Seconds since 1970 of each row's arrival.
    pub rows_unix_s: Vec<f64>,
    /// Words of all devices, with seconds since 1970.
    pub log: Vec<(f64, LogLine)>,
}
