//! The diagnosis of pulls as one Gaussian model: effects, curves and noise in one likelihood, chosen by one evidence.
//!
//! The logarithm of the friction that each label shows ([`labels`]) is a sum of terms ([`terms`]) and noise ([`gaussian`]). A search adds,
//! exchanges and drops terms by the logarithm of evidence and prior ([`search`]); [`naming`] says what was found, [`answer`] puts the steps together.

mod answer;
mod features;
mod gaussian;
mod heldout;
mod labels;
mod naming;
mod process;
mod search;
mod settings;
mod sizes;
mod tables;
mod terms;

pub use answer::{ModelAnswer, ModelFit, describe_by_process, diagnose_by_model};
pub use heldout::rms_error_n;
pub use tables::LearntTable;
