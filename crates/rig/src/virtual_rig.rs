//! The virtual rig: the devices' side of the same protocols, driven by a [`gripgen_twin::plant::Plant`].
//!
//! ```text
//! script, RTDE inputs, dashboard --> controller --> arm --> plant        GCL lines --> gripper --> plant
//!                 RTDE outputs, messages <--+                  answers <--------------+--> camera frames
//! ```
//!
//! Everything but [`server`] is without sockets and clocks: a control step is a call. The server listens on loopback alone.
//! No arbitrary program runs here: those of [`crate::program`] are known word for word, and of ur_rtde's the commands that a
//! test of the rig needs.

pub mod arm;
pub mod controller;
#[cfg(test)]
mod controller_tests;
pub mod dashboard;
#[cfg(test)]
mod dashboard_tests;
pub mod faults;
pub mod gripper;
#[cfg(test)]
mod gripper_tests;
pub mod mjpeg;
#[cfg(test)]
mod mjpeg_tests;
pub mod panel;
pub mod robot;
pub mod rtde;
mod rtde_control;
#[cfg(test)]
mod rtde_control_tests;
#[cfg(test)]
mod rtde_tests;
mod running;
pub mod script;
pub mod server;
mod wire;
pub mod world;
