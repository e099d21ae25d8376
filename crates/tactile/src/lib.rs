//! Tactile images: from a part in front of a gel to what the camera behind it sees.
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
pub mod gpu;
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

pub use appearance::appearance;
pub use colour::{ColourModel, Lambert, Light, Regressor, TaximTable, shade};
pub use deform::{BlurredRest, deform};
pub use elastic::{Base, ElasticGel, press_elastic};
pub use gradient::gradient;
pub use grid::{Grid, Plane};
pub use indent::{ElasticField, Imprint, IndentError, PressedGel, indent};
pub use markers::{
    MarkerGel, Markers, Shear, draw_markers, marker_displacements, print_markers, without_markers,
};
pub use noise::finish;
pub use raster::{ClusteredMesh, raster};
pub use render::Renderer;
pub use sensor::{GelShape, Pyramid, SENSOR_VERSION, Sensor, SensorError, SensorFiles};
pub use shadow::{BallPress, Relief, Shadow, ShadowKind, ShadowTable, shadow, shadow_from_presses};
pub use simd::SimdLevel;
