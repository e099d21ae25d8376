//! Gripping and pulling a part, in Rapier.
//!
//! ```
//! use gripgen_physics::{LimitCell, free_twist_capacity_n};
//!
//! // Two contact cells 4 mm apart across the pull, which hold 5 N each.
//! let cell = |across_m| LimitCell { across_m, along_m: 0.0, limit_n: 5.0 };
//! let patch = [cell(-2e-3), cell(2e-3)];
//! assert!((free_twist_capacity_n(&patch, 0.0) - 10.0).abs() < 1e-6);
//! // A pull 8 mm beside the middle turns the part about the far cell: 5 N at 4 mm balance it at 10 mm.
//! let turned_n = free_twist_capacity_n(&patch, 8e-3);
//! assert!((turned_n - 2.0).abs() < 1e-6, "{turned_n}");
//! ```
//!
//! [`grip`] closes the jaws on a part and lets them settle; the [`Held`] part says where it lies in each gel.
//! [`Held::pull`] starts a [`PullSession`], whose [`PullSession::step`] is the one primitive of every pull: the
//! force staircase ([`pull_staircase`]), a policy or a rig are loops over it.
//!
//! What Rapier decides and what it does not: it decides pose, normal forces and motion. How much tangential force
//! a jaw can hold is decided by the pressure on its contact patch and the friction law, and is written into Rapier
//! as friction on the jaw total. Gel shear is quasi-static and in series with the jaws: the tool moves by
//! `F / (k_left + k_right)` before anything slips.
//!
//! The gripper hangs on a carriage or on a robot arm ([`Arm`]); the arm comes from the text of a URDF ([`ArmModel`]) and
//! stands as the twin says ([`PlacedArm`]).
//!
//! This crate knows no images and no files.

mod arm;
mod bristles;
mod cache;
mod cells;
mod contact;
mod convert;
mod force_loop;
mod grip;
mod grip_capacity;
mod jaw_friction;
mod limit_surface;
mod predict;
mod quasi_static;
mod rapier_pull;
mod reduced;
mod scenario;
mod scene;
mod session;
mod setup;
mod shape;
mod staircase;
mod surface;
mod touch;
mod twist;
mod urdf;
mod world;

pub use arm::{ArmError, ArmJoint, ArmMesh, ArmModel, LinkInertia, PlacedArm, UrdfError};
pub use bristles::slip_onset_force_n;
pub use cache::Cache;
pub use cells::PullCells;
pub use grip::{Grip, Held, grip};
pub use grip_capacity::PatchFriction;
pub use jaw_friction::{FrictionCell, JawFriction};
pub use limit_surface::{LimitCell, free_twist_capacity_n};
pub use predict::{PullPredictor, SimulatePulls, campaign_staircases, speed_limit_m_per_s};
pub use quasi_static::{QuasiStatic, RimTable, SlipPull, SlipRun, StuckPull};
pub use scenario::{creep_of, grip_point, pull_direction, sensor_chain};
pub use session::{Command, PullError, PullSession, PullState, Signals};
pub use setup::{Arm, GripError, GripSetup, Mount};
pub use shape::{PartShape, ShapeError};
pub use staircase::{StaircaseResult, Until, pull_staircase, pull_staircase_seen, staircase_of};
pub use surface::{LineHit, Surface, Window};
pub use twist::{TwistCell, compliant_twist_capacity_n};

#[cfg(test)]
mod tests;
