//! The real experiment: the protocols of robot, gripper and cameras.
//!
//! ```
//! use gripgen_rig::gcl::{GclCommand, SHIPPED_LIMITS};
//!
//! // Grip forces are those of one jaw; the gripper counts both.
//! let grip = |force_per_jaw_n| GclCommand::Grip { force_per_jaw_n, part_width_mm: None, speed_mm_s: None };
//! assert_eq!(grip(20.0).line(&SHIPPED_LIMITS)?, "GRIP(40)\n");
//! assert!(grip(60.0).line(&SHIPPED_LIMITS).is_err(), "the gripper ends at 40 N per jaw");
//! # Ok::<(), gripgen_rig::gcl::LimitError>(())
//! ```
//!
//! Sessions are without sockets: bytes in, events and bytes out, so that every moment of a connection can be tested. Clients
//! on sockets have a reader thread each. [`experiment`] is the pull itself, [`program`] what the robot runs of it.
//! The devices' side of the same protocols, and a checker of programs, are in `gripgen-rig-sim`.

pub mod camera;
pub mod dashboard;
pub mod experiment;
pub mod gcl;
pub mod link;
pub mod primary;
pub mod program;
pub mod robot_state;
pub mod rtde;
