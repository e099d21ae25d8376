//! Why a grip cannot be.

use gripgen_twin::Jaw;

/// Why a grip failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GripError {
    /// The part does not fit between the open jaws.
    #[error("the part reaches beyond the open {jaw} jaw: the gripper opens to {opening_mm:.1} mm")]
    TooWide {
        /// Jaw that the part overlaps.
        jaw: Jaw,
        /// Opening between the gels.
        opening_mm: f64,
    },
    /// The jaws did not come to rest.
    #[error(
        "the grip did not settle in {time_s} s: the {jaw} jaw presses with {normal_n:.4} N instead of {wanted_n} N"
    )]
    NotSettled {
        /// Jaw farthest from its force.
        jaw: Jaw,
        /// Its normal force.
        normal_n: f64,
        /// Commanded force.
        wanted_n: f64,
        /// Time given.
        time_s: f64,
    },
    /// The contact geometry is not supported by the engine.
    #[error("the contact shape cannot be gripped: {0}")]
    Shape(String),
    /// The engine lost a body to a non-finite number.
    #[error("{bodies} bodies became non-finite {time_s:.3} s into the grip")]
    NotFinite {
        /// Bodies concerned.
        bodies: usize,
        /// Time since the jaws began to close.
        time_s: f64,
    },
}
