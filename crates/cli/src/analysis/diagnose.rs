//! Diagnoses: measurements and a twin in, an answer and a better twin out. One file per channel.

mod diagnosed;
mod few;
mod imprints;
mod measured_presses;
mod model;
mod next;
mod presses;
mod pull_values;
mod pulls;
mod sensor;

pub use diagnosed::Diagnosed;
pub use imprints::{
    calibrate_imprint_table, compare_imprint_table, diagnose_imprint_table, imprint_calibration_edits,
};
pub use measured_presses::{MeasuredPresses, diagnose_measured_presses, measured_presses};
pub use next::NextPulls;
pub use presses::{PressCovariate, PressDiagnosisInput, PressValues, diagnose_presses};
pub(crate) use pull_values::pull_values;
pub use pulls::{
    Engine, PullDiagnoseOptions, PullTwinError, UnknownPartError, diagnose_pull_table, given_model,
};
pub(crate) use pulls::{check_fit, check_parts};
pub use sensor::{
    calibrate_sensor_table, compare_sensor_table, diagnose_sensor_table, is_sensor_table,
    sensor_calibration_edits,
};
