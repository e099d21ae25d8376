//! The version of gripgen.

/// Version of gripgen, part of every run.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
