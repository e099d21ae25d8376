//! What a sample is made with, and why one fails.

use crate::library::LibraryError;
use gripgen_physics::{GripError, PullError};
use gripgen_tactile::gpu::GpuError;
use gripgen_tactile::{IndentError, SimdLevel};
use gripgen_twin::config::{Backend, ConfigError, ImageStorage, Mechanics, TraceStorage};
use gripgen_twin::{FrictionError, Jaw, LabelError, Sweep, rounded};

/// What a simulation is made with and for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimulateOptions {
    /// Which mechanics.
    pub mechanics: Mechanics,
    /// Whether images are wanted.
    pub images: bool,
    /// Whether images have the noise of the sensor; without it they are what is stored under `images = "clean"`.
    pub noise: bool,
    /// Whether the trace is wanted; without it the pull ends as soon as its label is decided, which leaves the label.
    pub trace: bool,
    /// Where images are made.
    pub backend: Backend,
    /// The vector unit of the image pipeline; the result does not depend on it.
    pub level: SimdLevel,
}

impl SimulateOptions {
    /// What the samples of a sweep are made with.
    pub fn of(sweep: &Sweep, level: SimdLevel) -> Self {
        Self {
            mechanics: sweep.mechanics,
            images: sweep.images != ImageStorage::None,
            noise: sweep.images != ImageStorage::Clean,
            trace: sweep.trace == TraceStorage::Full,
            backend: sweep.backend,
            level,
        }
    }
}

/// Why a sample failed. It keeps its place in the data set.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Drawn values that the twin or the scenario does not allow.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// The force loop would be unstable.
    #[error(
        "{damping_n_s_per_m} N s/m stop more than the arm's {mass_kg:.1} kg along the pull within one step of {step_s} s"
    )]
    Damping {
        /// Damping of the force loop.
        damping_n_s_per_m: f64,
        /// Mass that the arm has along the pull.
        mass_kg: f64,
        /// Time step.
        step_s: f64,
    },
    /// An effect leaves no grip force.
    #[error("the {jaw} jaw presses with {force_n:.4} N of the commanded {} N: nothing is gripped", rounded(*.commanded_n, &[]))]
    NoForce {
        /// Which jaw.
        jaw: Jaw,
        /// Its real force.
        force_n: f64,
        /// The commanded force.
        commanded_n: f64,
    },
    /// Jaws that miss the part in its middle, where it was measured to be held.
    #[error("the jaws miss the part")]
    Missed,
    /// The grip.
    #[error(transparent)]
    Grip(#[from] GripError),
    /// The imprint.
    #[error("{jaw} jaw: {source}")]
    Indent {
        /// Which jaw.
        jaw: Jaw,
        /// What is wrong.
        source: IndentError,
    },
    /// The graphics processor.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The friction law.
    #[error(transparent)]
    Friction(#[from] FrictionError),
    /// The pull.
    #[error(transparent)]
    Pull(#[from] PullError),
    /// The label.
    #[error(transparent)]
    Label(#[from] LabelError),
}
