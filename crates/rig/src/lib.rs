//! The real experiment: the protocols of robot, gripper and cameras.
//!
//! Sessions are without sockets: bytes in, events and bytes out, so that every moment of a connection can be tested. What is here
//! so far are the clients of RTDE, the robot's data exchange, and of GCL, the gripper's text interface; sockets, cameras and the
//! experiment itself follow.

pub mod gcl;
pub mod rtde;
