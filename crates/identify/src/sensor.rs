//! Diagnosis of a force sensor that was read beside a reference.
//!
//! `measured = offset + gain * chain(reference) + noise`, offset and gain of each session always free: they are the
//! baseline, not effects. `chain` is the effects in the units of the reference (N), the functions that the simulator
//! uses too, so that a sensor which reads in other units (a gain of 1/30, or below 0) has the same effects with the same
//! values. `docs/diagnosis-sensor.md` describes the method.

mod answer;
mod calibrate;
mod candidates;
mod choose;
mod detect;
mod errors;
mod moments;
mod noise;
mod prepare;
mod refine;
mod search;
#[cfg(test)]
mod tests;
mod words;

pub use answer::{SensorBlock, SensorDiagnosis, SensorRow, diagnose_sensor};
pub use calibrate::{
    SensorCalibration, SensorComparison, SessionCalibration, calibrate_sensor, compare_sensor,
};
pub use words::SensorEvidence;

use crate::permutation::Covariate;

/// A table of a force sensor beside a reference. All columns have one value per row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SensorData {
    /// Time, rising within a session.
    pub time_s: Vec<f64>,
    /// What acted.
    pub reference_force_n: Vec<f64>,
    /// What the sensor said.
    pub measured_force_n: Vec<f64>,
    /// Session of each row: an index into `sessions`.
    pub session: Vec<usize>,
    /// Names of the sessions.
    pub sessions: Vec<String>,
    /// Further columns, of unknown meaning.
    pub extra: Vec<(String, Covariate)>,
}

/// How a diagnosis is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorOptions {
    /// Seed of simulated data.
    pub seed: u64,
    /// Data sets without effect that are simulated to calibrate the threshold.
    pub simulations: usize,
    /// Chance of a first effect where there is none.
    pub false_alarm: f64,
    /// Rows that are worked with; more are averaged in groups.
    pub max_rows: usize,
}

impl Default for SensorOptions {
    fn default() -> Self {
        Self { seed: 1, simulations: 300, false_alarm: 0.02, max_rows: 12_000 }
    }
}
