//! Diagnoses: measurements and a twin in, an answer and a better twin out. One file per channel.

mod decisive;
mod measured_presses;
mod next;
mod presses;
mod pull_report;
mod pulls;
mod sensor;

pub use measured_presses::{MeasuredPresses, diagnose_measured_presses, measured_presses};
pub use next::NextPulls;
pub use presses::{PressCovariate, PressDiagnosisInput, PressValues, diagnose_presses};
pub use pulls::{PullDiagnoseOptions, PullTwinError, UnknownPartError, diagnose_pull_table, given_model};
pub(crate) use pulls::{check_fit, check_parts, pull_values};
pub use sensor::{
    calibrate_sensor_table, compare_sensor_table, diagnose_sensor_table, is_sensor_table, load_sensor_table,
    sensor_calibration_edits,
};
