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
mod bench;
mod beyond;
mod cache;
mod calibrate;
mod campaign;
mod catalogue;
mod compare;
mod compare_images;
mod diagnose;
mod expect;
mod film;
mod generate;
mod gpu;
mod gripped;
mod hold;
mod imprint;
mod imprint_set;
mod init;
mod library;
mod location;
mod measured;
mod mesh_file;
mod paper;
mod parallel;
mod picture;
mod plan;
mod plant;
mod predict;
mod predictive;
mod press_columns;
mod presses;
mod priors;
mod project;
mod render;
mod resolve;
mod rig_run;
mod sample;
mod schema;
mod simulator;
mod stream;
mod sweep;
mod try_part;
mod twin_edits;
mod twin_project;
mod unmeasured;
mod unvaried;
mod version;

pub use bench::{BenchError, BenchOptions, BenchRate, BenchReport, bench};
pub use beyond::{Beyond, beyond};
pub use calibrate::{CalibratePullsError, calibrate_twin, with_few_density};
pub use campaign::{SimulateCampaignError, simulate_campaign};
pub use catalogue::{EffectCurve, effect_curve};
pub use compare::{LabelErrors, PullComparison, compare_pulls, compare_pulls_with};
pub use compare_images::{CompareImagesError, ImageComparison, ImageScore, compare_images};
pub use diagnose::{
    Diagnosed, MeasuredPresses, NextPulls, PressCovariate, PressDiagnosisInput, PressValues,
    PullDiagnoseOptions, calibrate_imprint_table, calibrate_sensor_table, compare_imprint_table,
    compare_sensor_table, diagnose_imprint_table, diagnose_measured_presses, diagnose_presses,
    diagnose_pull_table, diagnose_sensor_table, given_model, imprint_calibration_edits, is_sensor_table,
    load_sensor_table, measured_presses, sensor_calibration_edits,
};
pub use film::Film;
pub use generate::{GripImprints, StartedPull, generate, generate_filmed, press_only, simulate, start_pull};
pub use gpu::Gpu;
pub use gripgen_identify as identify;
pub use gripgen_physics as physics;
pub use gripgen_record as record;
pub use gripgen_tactile as tactile;
pub use gripgen_twin as twin;
pub use imprint::{
    CalibrateImprintsError, ImprintCalibration, ImprintCalibrations, ImprintImagesError, calibrate_imprints,
};
pub use imprint_set::{ImprintSet, LoadImprintsError, imprint_data, is_imprint_set, load_imprint_set};
pub use init::{
    BenchmarkStarter, InitError, NoGrip, PartOptions, PartStarter, Proposal, StarterFile, Varied,
    benchmark_starter, part_starter, rasterise, starter,
};
pub use library::{Library, LibraryError};
pub use location::{Location, ReadFileError};
pub use measured::{
    ImplausibleLabels, LoadPullsError, LoadedPulls, Suspects, is_pulls, load_pulls, load_pulls_of,
    load_pulls_with,
};
pub use mesh_file::MeshFileError;
pub use paper::{PaperError, PaperReport, paper_report};
pub use parallel::in_parallel;
pub use plan::{Plan, Probe, TriedGrip, plan};
pub use plant::{Fixture, OpenPlantError, TwinPlant};
pub use predict::PullPredictor;
pub use predictive::posterior_twins;
pub use press_columns::{PressColumns, load_press_columns, presses_sha256};
pub use presses::{
    FoundCircles, LoadPressesError, LoadSensorError, PressGeometry, find_circles_with_sensor,
    find_missing_circles, is_press_set, load_presses, load_sensor, load_twin_sensor,
};
pub use priors::{pull_priors, shipped_priors};
pub use project::{BASELINE_TWIN, LoadError, Project, load_twin_document};
pub use render::{RenderError, RenderOptions, is_height_map, render_file, render_surface};
pub use rig_run::{plain_campaign, rig_run_differences, rig_run_toml};
pub use sample::{SampleError, SimulateOptions};
pub use schema::{campaign_schema, rosbag_schema, sweep_schema, twin_schema};
pub use simulator::{Draw, Simulator};
pub use stream::{SampleStream, StreamError, StreamOptions, Streamed, StreamedSample};
pub use sweep::{SweepError, SweepEvent, SweepOptions, SweepSummary, prepare_run, run_info, sweep};
pub use try_part::{TryOptions, TryPartError, try_part};
pub use twin_edits::{EditedValue, TwinEdits, WriteTwinError, edited_twin, edited_twin_toml, write_twin};
pub use unmeasured::unmeasured;
pub use unvaried::{Unvaried, unvaried};
pub use version::VERSION;
