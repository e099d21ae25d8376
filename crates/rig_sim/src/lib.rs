//! The virtual rig: the devices' side of the same protocols, driven by a [`gripgen_twin::plant::Plant`].
//!
//! ```text
//! script, RTDE inputs, dashboard --> controller --> arm --> plant        GCL lines --> gripper --> plant
//!                 RTDE outputs, messages <--+                  answers <--------------+--> camera frames
//! ```
//!
//! Everything but [`server`] is without sockets and clocks: a control step is a call. The server listens on loopback alone.
//! Programs are not known here: [`urscript`] makes of their text what a controller would make of it.

pub mod arm;
mod body;
pub mod controller;
#[cfg(test)]
mod controller_tests;
pub mod dashboard;
pub mod faults;
mod fields;
pub mod gripper;
#[cfg(test)]
mod gripper_tests;
pub mod kinematics;
pub mod mjpeg;
#[cfg(test)]
mod mjpeg_tests;
pub mod program_check;
pub mod robot;
pub mod rtde;
#[cfg(test)]
mod rtde_tests;
pub mod script;
pub mod server;
pub mod spring;
pub mod urscript;
mod wire;
pub mod world;
