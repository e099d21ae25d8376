//! The vocabulary of gripgen: what all its packages talk about.
//!
//! ```
//! use gripgen_twin::effects::LIBRARY;
//! use gripgen_twin::{PullTrace, TraceRow, slip_label};
//!
//! // A staircase of 5 N per step: the measured force follows the command up to 11 N, then the jaws slip.
//! let rows = [(0.0, 3.0, 2.0), (0.1, 8.0, 7.0), (0.2, 13.0, 11.0), (0.3, 18.0, 4.0)];
//! let trace: PullTrace = rows
//!     .map(|(time_s, desired_force_n, measured_force_n)| TraceRow {
//!         time_s, desired_force_n, measured_force_n, displacement_m: 0.0,
//!     })
//!     .into_iter()
//!     .collect();
//! let label = slip_label(&trace, 3.0, true)?;
//! assert_eq!((label.slip_time_s, label.max_pull_force_n), (0.2, 11.0));
//!
//! // What may stand between a simulated label and a measured one is in the library of effects.
//! assert!(LIBRARY.iter().any(|effect| effect.covariates == ["grip_force_n"]));
//! # Ok::<(), gripgen_twin::LabelError>(())
//! ```
//!
//! One experiment is simulated and measured: a gripper with a tactile sensor in each jaw grips a fixed part, two
//! images are taken, and the arm pulls with a rising force until the jaws slip. A [`Scenario`] is one such pull,
//! fully specified; a [`Twin`] is the rig and the parts it is made on; a [`Sweep`] says which scenario belongs to
//! which sample index; a [`Sample`] is what came out.
//!
//! This crate opens no file, reads no clock and starts no thread. Inside, all quantities are in SI units; names in
//! files carry their unit (`_n`, `_mm`, `_s`, `_deg`). Frames are described in [`frames`].

mod backbone;
mod campaign;
pub mod columns;
pub mod config;
pub mod draw;
pub mod effects;
pub mod frames;
mod friction;
mod grasp;
pub mod image;
mod jaw;
pub mod label;
mod measured;
mod mesh;
mod optics;
pub mod parts;
mod patch;
pub mod plant;
mod posterior;
pub mod predict;
mod pull_count;
pub mod random;
mod rounded;
mod sample;
mod scenario;
mod surface;
mod sweep;
mod table;
mod trace;
mod twin;
pub mod values;

pub use backbone::Backbone;
pub use campaign::{Campaign, PlannedPull, PullKind};
pub use config::{DEFAULTED_SECTIONS, is_twin_key};
pub use friction::{FrictionError, GripFriction, cell_friction, grip_friction};
pub use grasp::{Grasp, Proposal};
pub use image::TactileImage;
pub use image::film::{CameraStamp, CellShear, FilmFrame, FilmPace, SlipState};
pub use jaw::{Jaw, PerJaw};
pub use label::{LabelError, PullEnd, SlipLabel, slip_label};
pub use measured::{ExtraColumn, MeasuredPull, MeasuredPulls, POSSIBLE_LABEL_RATIO, median_label_ratio};
pub use mesh::{
    EXTENT_RANGE_M, MAX_TRIANGLES, MESH_FORMATS, MeshError, MeshLook, TriMesh, usual_scale_mm_per_unit,
    write_binary_stl,
};
pub use optics::{BACKGROUND_TERMS, FINER_TERMS, OpticsState};
pub use patch::{ContactPatch, ContactSlopes, PressureCell};
pub use posterior::{CAUSE_KEY, Posterior, PosteriorDraw, PosteriorError};
pub use pull_count::{PULLS_SINCE_REST, PullCount, SINCE_ZERO, ZEROED};
pub use rounded::rounded;
pub use sample::{ImprintSummary, Outcome, Pulled, Sample};
pub use scenario::keys::{can_be_drawn, is_own_column, pull_keys, scenario_keys};
pub use scenario::staircase::{Staircase, StaircaseCursor};
pub use scenario::{Covariates, PullSettings, Scenario};
pub use surface::{SURFACE_EFFECT, Surface, SurfaceAxis};
pub use sweep::{DEFAULT_GRIP_FORCE_N, MAX_SAMPLES, Sweep};
pub use table::{TABLE_EFFECT, Table, TableTarget};
pub use trace::{PullTrace, TraceRow};
pub use twin::{
    Elastic, Gel, Gripper, LARGEST_MU, NO_MESH, Optics, Part, Robot, RobotArm, TWIN_SCHEMA, Twin, Wrist,
};
pub use values::Values;
