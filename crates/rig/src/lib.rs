//! The real experiment: the protocols of robot, gripper and cameras.
//!
//! Sessions are without sockets: bytes in, events and bytes out, so that every moment of a connection can be tested. What is here
//! so far are the clients of RTDE (the robot's data exchange), of GCL (the gripper's text interface) and of the cameras'
//! streams, RTDE's socket, and the pull as a program for the robot; the experiment itself follows.

pub mod camera;
pub mod dashboard;
pub mod gcl;
pub mod primary;
pub mod program;
pub mod robot_state;
pub mod rtde;
pub mod stamped;
pub mod virtual_rig;
