//! Tactile images: from a part in front of a gel to what the camera behind it sees.
//!
//! ```
//! use gripgen_tactile::{Grid, PressedGel, indent};
//!
//! // A ball of 4 mm radius in front of a gel: heights in pixels, one per pixel of 160 x 200.
//! let grid = Grid { width_px: 200, height_px: 160, metres_per_px: 5e-5 };
//! let ball_m = |x_m: f64, y_m: f64| (4e-3_f64.powi(2) - x_m * x_m - y_m * y_m).max(0.0).sqrt() - 7e-3;
//! let heights = grid.plane(|x_m, y_m| ball_m(x_m, y_m) / grid.metres_per_px);
//! // 5 N displace 5 mm3 of gel: the cap of a ball, pi d^2 (R - d / 3).
//! let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
//! let imprint = indent(&heights, &grid, &gel, 5.0)?;
//! let d_m = imprint.press_depth_m;
//! let cap_m3 = std::f64::consts::PI * d_m * d_m * (4e-3 - d_m / 3.0);
//! assert!((cap_m3 / 5e-9 - 1.0).abs() < 5e-3);
//! assert!((imprint.patch.normal_force_n() - 5.0).abs() < 1e-9, "the pressure integrates to the force");
//! # Ok::<(), gripgen_tactile::IndentError>(())
//! ```
//!
//! One stage a file: [`raster`] (mesh to height map), [`indent`] (press depth and pressure), [`deform`] (the gel
//! around the contact), [`gradient`], [`shade`] (colour), [`shadow()`] (what a contact
//! keeps from the light), [`finish`] (noise and rounding). For an elastic gel
//! [`press_elastic`] takes the place of `indent` and `deform`. [`draw_markers`] moves the dots of a gel. [`Renderer`]
//! runs them.
//!
//! Heights are in pixels, relative to the gel surface at rest: deeper contact and steeper slopes do not lose bits to
//! an offset, and a flat gel is exactly 0. Colours are a change against the frame at rest, so that a grip without
//! contact gives the rest frame itself. All stages give the same bits on every processor.
//!
//! This crate knows no mechanics and no forces over time.

mod appearance;
mod colour;
mod convolve;
mod deform;
mod elastic;
mod fft;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(not(feature = "gpu"))]
#[path = "gpu_absent.rs"]
pub mod gpu;
mod gpu_types;
mod gradient;
mod grid;
mod indent;
mod layer;
mod markers;
pub mod metrics;
mod noise;
pub mod npz;
mod optics;
mod patch;
pub mod presses;
mod raster;
#[cfg(test)]
mod reference;
mod render;
mod sensor;
mod shading;
mod shadow;
mod simd;
mod slopes;
#[cfg(test)]
mod testing;
mod volume;

pub use appearance::appearance;
pub use colour::{ColourModel, Lambert, Light, Regressor, TableReading, TaximTable, shade};
pub use convolve::Follow;
pub use deform::{BlurredRest, Edges, deform};
pub use elastic::{Base, ElasticGel, LINEAR_PRESSURE_SHARE, press_elastic};
pub use gradient::gradient;
pub use grid::{Grid, Plane};
pub use indent::{ElasticField, Imprint, IndentError, PressedGel, indent};
pub use markers::{
    Dot, MarkerGel, Markers, Shear, draw_markers, find_dots, follow_dots, marker_displacements,
    marker_displacements_by_cell, marker_displacements_by_surface, print_markers, without_markers,
};
pub use noise::finish;
pub use patch::{CellMap, CellPlaces};
pub use raster::{ClusteredMesh, raster};
pub use render::{Pad, Renderer};
pub use sensor::{GelShape, Pyramid, SENSOR_VERSION, Sensor, SensorError, SensorFiles};
pub use shadow::{BallPress, Relief, Shadow, ShadowKind, ShadowTable, shadow, shadow_from_presses};
pub use simd::SimdLevel;
pub use slopes::contact_slopes;
pub use volume::{VolumeError, VolumeReader};
