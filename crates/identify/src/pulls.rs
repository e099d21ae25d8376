//! Pulls: calibration of the baseline and diagnosis.

pub mod answer;
mod bend;
pub mod calibrate;
pub mod candidates;
mod choose;
mod compete;
pub mod context;
pub mod curves;
pub mod data;
mod dynamics;
pub mod fitting;
pub mod heldout;
pub mod intervals;
pub mod likelihood;
pub mod model;
pub mod observe;
pub mod power;
mod scatter;
mod screen;
pub mod search;
mod simulate;
mod slide;
pub mod slip;
mod stated;
pub mod terms;
mod trace_residuals;
mod words;
