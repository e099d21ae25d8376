//! Diagnoses: measurements and a twin in, an answer and a better twin out. One file a channel.

mod pull_report;
mod pulls;

pub(crate) use pulls::pull_values;
pub use pulls::{PullDiagnoseOptions, UnknownPartError, diagnose_pull_table, given_model};
