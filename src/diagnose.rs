//! Diagnoses: measurements and a twin in, an answer and a better twin out. One file a channel.

mod presses;
mod pull_report;
mod pulls;

pub use presses::{PressCovariate, PressDiagnosisInput, PressValues, diagnose_presses, is_optics_effect};
pub(crate) use pulls::pull_values;
pub use pulls::{PullDiagnoseOptions, UnknownPartError, diagnose_pull_table, given_model};
