//! gripgen: a digital twin of grip, pull and slip, and an engine that runs it very fast.
//!
//! A part is gripped by two jaws with a tactile sensor each, two images are taken, and an arm pulls with a rising force
//! until the jaws slip; the force at slip is the label. [`Project::load`] reads the configuration of a sweep,
//! [`generate`] simulates one sample of it, [`sweep`] writes all of them into a run folder:
//!
//! ```
//! use gripgen::{generate, Location, Project};
//! use gripgen::tactile::SimdLevel;
//! use gripgen::twin::Outcome;
//!
//! let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &[])?;
//! let sample = generate(&project, 0, SimdLevel::best());
//! let Outcome::Pulled(pulled) = sample.outcome else { panic!("the quickstart has no failed sample") };
//! assert!(pulled.label.max_pull_force_n > 0.0);
//! # Ok::<(), gripgen::LoadError>(())
//! ```
//!
//! and [`record::ShardReader`] reads any of them back:
//!
//! ```
//! use gripgen::record::{RunFolder, ShardReader};
//! use gripgen::tactile::SimdLevel;
//! use gripgen::{sweep, Location, Project, SweepOptions};
//! use std::sync::atomic::AtomicBool;
//!
//! let sets = [("vary.grip_force_n", "[40]"), ("vary.grip_pose", "[0]"), ("vary.grip_angle_deg", "[0]")]
//!     .map(|(key, value)| (key.to_string(), value.to_string()));
//! let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets)?;
//! let out = tempfile::tempdir()?;
//! let options = SweepOptions { jobs: 1, slice: None, simd: SimdLevel::best() };
//! sweep(&project, out.path(), options, &AtomicBool::new(false), |_| {})?;
//!
//! let folder = RunFolder::open(out.path())?;
//! let record = ShardReader::open(&folder.shard_path(0))?.record(2)?;
//! assert_eq!(record.sample.grip_force_n, 40.0);
//! assert_eq!(record.images.unwrap().left.width_px, 320);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A sample depends on (version, resolved configuration, seed, index) and on nothing else.

pub mod assets;
mod film;
mod generate;
mod gripped;
mod library;
mod location;
mod parallel;
mod project;
mod resolve;
mod sample;
mod simulator;
mod sweep;
mod version;

pub use film::Film;
pub use generate::{
    GripImprints, StartedPull, drawn_scenario, generate, generate_filmed, press_only, pull_gripped,
    pull_session, simulate, start_pull,
};
pub use gripgen_physics as physics;
pub use gripgen_record as record;
pub use gripgen_tactile as tactile;
pub use gripgen_twin as twin;
pub use gripped::{
    Contact, Gripped, Indenter, answering_mass_kg, held, jaw_forces_n, placed_parts, try_grip,
};
pub use library::{Library, LibraryError};
pub use location::{Location, ReadFileError, path_from};
pub use parallel::in_parallel;
pub use project::{BASELINE_TWIN, LoadError, Project, load_twin_document};
pub use resolve::Files;
pub use sample::{SampleError, SimulateOptions};
pub use simulator::{Draw, Simulator};
pub use sweep::differences;
pub use sweep::{
    SweepError, SweepEvent, SweepOptions, SweepSummary, encode_filmed, encode_options, guarded, noise_rgb,
    prepare_run, run_info, sweep,
};
pub use version::VERSION;
