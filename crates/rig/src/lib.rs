//! The real experiment: the protocols of robot, gripper and cameras.
//!
//! Sessions are without sockets: bytes in, events and bytes out, so that every moment of a connection can be tested. Clients
//! on sockets have a reader thread each. [`experiment`] is the pull itself, [`program`] what the robot runs of it,
//! [`virtual_rig`] the devices' side of the same protocols for a machine without any.

pub mod camera;
pub mod dashboard;
pub mod experiment;
pub mod gcl;
pub mod link;
pub mod primary;
pub mod program;
pub mod robot_state;
pub mod rtde;
pub mod virtual_rig;
