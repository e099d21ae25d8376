//! What the virtual rig moves: the seam to a simulator, which this crate does not know.

use crate::program::TcpPose;
use gripgen_twin::{PerJaw, TactileImage};

/// A part that can be gripped, and the sensors that look at it.
pub trait Plant: Send + Sync {
    /// What the cameras see with the jaws open.
    fn rest_images(&self, time_s: f64) -> PerJaw<TactileImage>;

    /// The jaws close. May take its time: it is not called from the robot's clock.
    fn grip(&self, how: &GripRequest) -> Result<Box<dyn Grip>, PlantError>;

    /// What the wrist sensor says along +z without a load, before it is zeroed, in N: its offset at this time of the plant's
    /// clock.
    fn offset_n(&self, time_s: f64) -> f64;

    /// Noise of the wrist sensor at its reading number `tick`, in N.
    fn noise_n(&self, tick: u64) -> f64;
}

/// A closed grip.
pub trait Grip: Send {
    /// What the jaws closed on.
    fn width_mm(&self) -> f64;

    /// Whether there is a part between them.
    fn holds(&self) -> bool;

    /// What the cameras see.
    fn images(&self) -> &PerJaw<TactileImage>;

    /// The pull begins.
    fn begin_pull(&mut self, pull: &PullRequest) -> Result<PullReading, PlantError>;

    /// The arm pulls with this force for so long.
    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError>;
}

/// How a part is gripped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripRequest {
    /// Where the tool is.
    pub tcp: TcpPose,
    /// Force of one jaw.
    pub force_per_jaw_n: f64,
    /// Clock of the virtual rig.
    pub time_s: f64,
}

/// How it is pulled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullRequest {
    /// +1 up, -1 down.
    pub direction: f64,
    /// Height of a step.
    pub increment_n: f64,
    /// Length of a step.
    pub step_s: f64,
    /// Time since the jaws closed.
    pub dwell_s: f64,
    /// Clock of the virtual rig.
    pub time_s: f64,
}

/// The pull after a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PullReading {
    /// What the wrist sensor says along the pull, before it is zeroed.
    pub measured_n: f64,
    /// How far the tool has moved along the pull.
    pub displacement_m: f64,
    /// How fast it moves.
    pub speed_m_s: f64,
}

/// Why the simulator cannot go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the plant: {problem}")]
pub struct PlantError {
    /// What is wrong, with its numbers.
    pub problem: String,
}
