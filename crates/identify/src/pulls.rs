//! Pulls: calibration of the baseline and diagnosis.

pub mod answer;
pub mod calibrate;
pub mod candidates;
mod choose;
mod compete;
pub mod context;
pub mod curves;
pub mod data;
pub mod fitting;
pub mod heldout;
pub mod likelihood;
pub mod model;
pub mod observe;
pub mod power;
mod screen;
pub mod search;
mod simulate;
mod trace_residuals;
mod words;
