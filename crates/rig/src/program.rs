//! What the robot runs: the pull and the motions between grips, as programs of their own.
//!
//! A program carries its numbers as named assignments at its head; what follows them is always the same text. So a person can
//! read what will happen. What a text does is judged by `gripgen_rig_sim::program_check`, which runs it and knows only its numbers.
//!
//! The staircase runs on the controller, at its own rate: the commanded force arrives in the same packet as the measured one, and
//! nothing depends on the host being in time. The host only says go and keeps a heartbeat; when it stops, the controller
//! stops the program by itself. Functions of URScript are those of Universal Robots, "The URScript Programming Language"
//! for e-Series (5.x).
//!
//! **Not run on a robot yet.** What is tested is the text, on the virtual rig, whose controller interprets it
//! (`gripgen_rig_sim::urscript`): every limit, every way out, and that nothing goes on after the end.

mod head;
mod motion;
#[cfg(test)]
mod motion_tests;
mod pull;
#[cfg(test)]
mod pull_tests;

pub use motion::{MotionProgram, TcpPose};
pub use pull::PullProgram;

/// Rate at which the host has to write its heartbeat at least, or the controller stops the program.
pub const HEARTBEAT_LEAST_HZ: f64 = 10.0;
/// How long a program waits for the first heartbeat.
pub const HEARTBEAT_WAIT_S: f64 = 10.0;
/// How long a motion waits for its go.
pub const GO_WAIT_S: f64 = 2.0;
/// How long the sensor rests before it is zeroed.
pub const ZERO_REST_S: f64 = 0.5;
/// How long the preload is averaged.
pub const PRELOAD_S: f64 = 0.25;
/// Rest before force mode begins: it is entered from standstill.
pub const SETTLE_S: f64 = 0.05;
/// How long a stopped program waits for the host to take its go back.
pub const ACKNOWLEDGE_S: f64 = 2.0;
/// Deceleration of a stop, in m/s^2.
pub const STOP_DECELERATION_M_S2: f64 = 2.0;

/// What a program says of itself, in output register 24.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// It waits for the heartbeat.
    Started = 1,
    /// The sensor is zeroed with the hand open: now grip, then say go.
    Zeroed = 2,
    /// It pulls.
    Pulling = 3,
    /// It has stopped; the reason stands in register 27.
    Stopped = 4,
    /// It moves to another pose.
    Moving = 5,
    /// The pull or the motion is over and the tool comes to rest.
    Braking = 6,
}

impl Phase {
    /// The phase with this number.
    pub fn from_number(number: i32) -> Option<Self> {
        use Phase::{Braking, Moving, Pulling, Started, Stopped, Zeroed};
        [Started, Zeroed, Pulling, Stopped, Moving, Braking].into_iter().find(|phase| *phase as i32 == number)
    }
}

/// Why a program stopped, in output register 27.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The tool has moved as far as it should: the normal end of a pull.
    Displacement = 1,
    /// The command has reached its largest force.
    LargestCommand = 2,
    /// More force than is allowed was measured.
    Force = 3,
    /// The tool has moved aside.
    Lateral = 4,
    /// More torque than is allowed was measured.
    Torque = 5,
    /// The time is up.
    Time = 6,
    /// The host said stop, or never said go.
    Host = 7,
    /// The heartbeat never came.
    NoHeartbeat = 8,
    /// The pose is reached: the normal end of a motion.
    Arrived = 9,
    /// No joints carry the tool to the pose.
    Unreachable = 10,
}

impl StopReason {
    /// The reason with this number.
    pub fn from_number(number: i32) -> Option<Self> {
        use StopReason::{
            Arrived, Displacement, Force, Host, LargestCommand, Lateral, NoHeartbeat, Time, Torque,
            Unreachable,
        };
        let all = [
            Displacement,
            LargestCommand,
            Force,
            Lateral,
            Torque,
            Time,
            Host,
            NoHeartbeat,
            Arrived,
            Unreachable,
        ];
        all.into_iter().find(|reason| *reason as i32 == number)
    }

    /// The reason in words.
    pub fn meaning(self) -> &'static str {
        match self {
            StopReason::Displacement => "the tool has moved as far as it should",
            StopReason::LargestCommand => "the command has reached its largest force",
            StopReason::Force => "more force than is allowed was measured",
            StopReason::Lateral => "the tool has moved aside",
            StopReason::Torque => "more torque than is allowed was measured",
            StopReason::Time => "the time is up",
            StopReason::Host => "the host said stop, or never said go",
            StopReason::NoHeartbeat => "the heartbeat of the host never came",
            StopReason::Arrived => "the pose is reached",
            StopReason::Unreachable => "no joints of the arm carry the tool to the pose",
        }
    }
}

/// Registers that a program and the host meet in; 24 and up are for outside clients, below are fieldbuses.
pub mod registers {
    /// Input, integer: changes with every packet of the host.
    pub const HEARTBEAT: u8 = 24;
    /// Input, integer: the number of the run to go, [`STOP`] to stop, anything else to wait.
    pub const GO: u8 = 25;
    /// The go that stops a program in any of its phases.
    pub const STOP: i32 = -1;
    /// Output, integer: [`Phase`](super::Phase).
    pub const PHASE: u8 = 24;
    /// Output, integer: which step of the staircase.
    pub const STEP: u8 = 25;
    /// Output, integer: the number of the run.
    pub const RUN: u8 = 26;
    /// Output, integer: [`StopReason`](super::StopReason).
    pub const REASON: u8 = 27;
    /// Output, double: the commanded force, N.
    pub const DESIRED_FORCE: u8 = 24;
    /// Output, double: how far the tool has moved along the pull, m.
    pub const DISPLACEMENT: u8 = 25;
    /// Output, double: how far it has moved aside, m.
    pub const LATERAL: u8 = 26;
    /// Output, double: force along the pull before it began, N.
    pub const PRELOAD: u8 = 27;
}

/// A number that no program of this rig may have: nothing was sent.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value} {unit}, it must be from {least} to {most} {unit}")]
pub struct ProgramLimitError {
    /// Which number.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Smallest.
    pub least: f64,
    /// Largest.
    pub most: f64,
}

/// A number with its limits: what it is, its value, its unit, smallest, largest.
type Limit = (&'static str, f64, &'static str, f64, f64);

/// Checks every number; those that are none are outside.
fn check_limits(limits: &[Limit]) -> Result<(), ProgramLimitError> {
    match limits.iter().find(|(_, value, _, least, most)| !(value >= least && value <= most)) {
        Some(&(what, value, unit, least, most)) => Err(ProgramLimitError { what, value, unit, least, most }),
        None => Ok(()),
    }
}
