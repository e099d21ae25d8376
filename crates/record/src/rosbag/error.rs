//! What is wrong with a bag or its mapping.

use std::path::{Path, PathBuf};

/// Why a bag could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}{problem}", .path.display(), if .path.as_os_str().is_empty() { "" } else { ": " })]
pub struct RosbagError {
    /// The file; empty where the problem names it.
    pub path: PathBuf,
    /// What is wrong, with the numbers.
    pub problem: String,
    /// What to do about it; empty where nobody knows.
    pub hint: String,
}

impl RosbagError {
    pub(super) fn new(path: &Path, problem: impl std::fmt::Display) -> Self {
        Self { path: path.into(), problem: problem.to_string(), hint: String::new() }
    }

    pub(super) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }
}
