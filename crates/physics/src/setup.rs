//! What a grip depends on.

use crate::arm::PlacedArm;
use crate::shape::PartShape;
use gripgen_twin::config::Mechanics;
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gel, Gripper, Jaw, PerJaw, Robot, Wrist};

/// The arm of a grip.
#[derive(Debug, Clone, Copy)]
pub enum Arm<'a> {
    /// One body on a rail along the pull: the arm's inertia as one number, all other motion locked.
    Carriage,
    /// The whole arm, link by link. Its inertia comes from the model; `Robot::moving_mass_kg` is not used.
    Multibody(&'a PlacedArm),
}

/// How the part is held besides the jaws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mount {
    /// Fixed to the world, as in the experiment.
    Fixed,
    /// Free: only the jaws carry it against gravity, which acts along -z of `world`.
    Free {
        /// Its mass.
        mass_kg: f64,
        /// Strength of gravity.
        gravity_m_per_s2: f64,
    },
}

/// All that a grip depends on.
#[derive(Clone)]
pub struct GripSetup<'a> {
    /// What computes grip and pull.
    pub mechanics: Mechanics,
    /// The arm's body.
    pub arm: Arm<'a>,
    /// The arm's force loop.
    pub robot: Robot,
    /// The gripper.
    pub gripper: Gripper,
    /// The wrist sensor; its step is the time step.
    pub wrist: Wrist,
    /// The gels.
    pub gel: &'a PerJaw<Gel>,
    /// The part's contact shape.
    pub shape: &'a PartShape,
    /// Where the part is.
    pub world_from_part: Pose,
    /// Normal force of each jaw.
    pub grip_force_n: PerJaw<f64>,
    /// Unit vector of the pull, at right angles to the jaw axis (y of `world`).
    pub direction: [f64; 3],
    /// What else holds the part. The arm carries the gripper's own weight.
    pub mount: Mount,
}

/// Why a grip failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GripError {
    /// The part does not fit between the open jaws.
    #[error("the part reaches beyond the open {jaw} jaw: the gripper opens to {opening_mm:.1} mm")]
    TooWide {
        /// Jaw that the part overlaps.
        jaw: Jaw,
        /// Opening between the gels.
        opening_mm: f64,
    },
    /// The jaws did not come to rest.
    #[error(
        "the grip did not settle in {time_s} s: the {jaw} jaw presses with {normal_n:.4} N instead of {wanted_n} N"
    )]
    NotSettled {
        /// Jaw farthest from its force.
        jaw: Jaw,
        /// Its normal force.
        normal_n: f64,
        /// Commanded force.
        wanted_n: f64,
        /// Time given.
        time_s: f64,
    },
    /// The contact geometry is not supported by the engine.
    #[error("the contact shape cannot be gripped: {0}")]
    Shape(String),
    /// The engine lost a body to a non-finite number.
    #[error("{bodies} bodies became non-finite {time_s:.3} s into the grip")]
    NotFinite {
        /// Bodies concerned.
        bodies: usize,
        /// Time since the jaws began to close.
        time_s: f64,
    },
}
