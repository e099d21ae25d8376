//! Pulls that were measured, or simulated and taken as if they were.

use crate::config::Feedback;
use crate::{Covariates, PullTrace};

/// The columns of a pull table whose meaning is known, without `pull_id` and the label.
pub const KNOWN_COLUMNS: &[&str] = &[
    "part",
    "grip_force_n",
    "gel_id",
    "session",
    "force_increment_n",
    "step_time_s",
    "dwell_s",
    "pull_index",
    "time_s",
    "temperature_c",
    "grip_offset_mm",
    "grip_angle_deg",
    "pull_direction",
];

/// One measured pull.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPull {
    /// Its name.
    pub id: String,
    /// Name of the part.
    pub part: String,
    /// Grip force, per jaw.
    pub grip_force_n: f64,
    /// Height of a step of the staircase.
    pub increment_n: f64,
    /// Length of a step.
    pub step_s: f64,
    /// Circumstances; those that nobody wrote down have their defaults.
    pub covariates: Covariates,
    /// The label.
    pub max_pull_force_n: f64,
    /// The force over time. Rows before time 0 are the no-load reading.
    pub trace: Option<PullTrace>,
}

/// The values of a column whose meaning is not known.
#[derive(Debug, Clone, PartialEq)]
pub enum ExtraValues {
    /// Numbers; NaN where the cell is empty.
    Number(Vec<f64>),
    /// Words.
    Text(Vec<String>),
}

/// A column whose meaning is not known.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraColumn {
    /// Its name.
    pub name: String,
    /// One value a pull.
    pub values: ExtraValues,
}

/// A campaign of measured pulls, in the order in which they were made.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPulls {
    /// The pulls.
    pub pulls: Vec<MeasuredPull>,
    /// Those of [`KNOWN_COLUMNS`] that were written down.
    pub recorded: Vec<String>,
    /// Columns whose meaning is not known.
    pub extra: Vec<ExtraColumn>,
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
    /// Displacement at which a pull ends.
    pub stop_m: f64,
    /// What the force loop closed on, where it is known.
    pub feedback: Option<Feedback>,
    /// SHA-256 of the files it was read from.
    pub sha256: String,
}
