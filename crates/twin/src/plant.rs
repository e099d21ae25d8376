//! What a virtual rig moves: the seam between its protocols and a simulator, neither of which knows the other.

use crate::frames::Pose;
use crate::{PerJaw, TactileImage};

/// A part that can be gripped, and the sensors that look at it.
pub trait Plant: Send + Sync {
    /// What the cameras see with the jaws open.
    fn rest_images(&self, time_s: f64) -> PerJaw<TactileImage>;

    /// The jaws close. May take its time: it is not called from the robot's clock.
    ///
    /// # Errors
    ///
    /// Where the simulator cannot say what they close on.
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

    /// The pull begins; gives its first reading.
    ///
    /// # Errors
    ///
    /// Where the simulator cannot pull so.
    fn begin_pull(&mut self, pull: &PullRequest) -> Result<PullReading, PlantError>;

    /// The arm pulls with this force along the pull for so long; gives the reading after it.
    ///
    /// # Errors
    ///
    /// Where the simulator cannot go on.
    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError>;
}

/// How a part is gripped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripRequest {
    /// Where the tool is.
    pub base_from_tool: Pose,
    /// Force of one jaw.
    pub force_per_jaw_n: f64,
    /// Clock of the rig.
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
    /// Clock of the rig.
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

/// Jaws that closed on each other.
#[derive(Debug, Clone, PartialEq)]
pub struct EmptyGrip {
    /// What the cameras see.
    pub images: PerJaw<TactileImage>,
}

impl Grip for EmptyGrip {
    fn width_mm(&self) -> f64 {
        0.0
    }

    fn holds(&self) -> bool {
        false
    }

    fn images(&self) -> &PerJaw<TactileImage> {
        &self.images
    }

    fn begin_pull(&mut self, _: &PullRequest) -> Result<PullReading, PlantError> {
        Ok(PullReading::default())
    }

    fn pull(&mut self, _: f64, _: f64) -> Result<PullReading, PlantError> {
        Ok(PullReading::default())
    }
}
