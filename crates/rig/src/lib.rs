//! The real experiment: the protocols of robot, gripper and cameras.
//!
//! Sessions are without sockets: bytes in, events and bytes out, so that every moment of a connection can be tested. What is here
//! so far is the client of RTDE, the robot's data exchange; sockets, gripper, cameras and the experiment itself follow.

pub mod rtde;
