//! Pulls: calibration of the baseline and diagnosis.

pub mod candidates;
pub mod context;
pub mod curves;
pub mod data;
pub mod fitting;
pub mod likelihood;
pub mod model;
pub mod observe;
