//! A build without the feature `gpu`: no adapter can be opened, so that there is no value of any type of a device.

pub use crate::gpu_types::{AdapterChoice, GpuAdapter, GpuError, GpuImage, makes};

/// A part pressed into a gel on the device.
pub type GpuPress<'a> = crate::gpu_types::Press<&'a GpuMesh>;

/// One image to make on the device.
pub type GpuRequest<'a> = crate::gpu_types::Request<&'a GpuMesh>;

use crate::indent::IndentError;
use crate::sensor::Sensor;
use gripgen_twin::{Gel, TriMesh};
use std::convert::Infallible;

/// A mesh on the device.
pub struct GpuMesh(Infallible);

/// A sensor with its gel on the device.
pub struct GpuSensor(Infallible);

impl GpuSensor {
    /// Images that are computed at once.
    pub fn batch(&self) -> usize {
        match self.0 {}
    }
}

/// An open graphics processor.
pub struct GpuRenderer(Infallible);

impl GpuRenderer {
    /// Opens no adapter.
    ///
    /// # Errors
    ///
    /// Always [`GpuError::NotBuilt`].
    pub fn new(_: &AdapterChoice) -> Result<Self, GpuError> {
        Err(GpuError::NotBuilt)
    }

    /// Which adapter it is.
    pub fn adapter(&self) -> &GpuAdapter {
        match self.0 {}
    }

    /// Puts a mesh on the device.
    pub fn mesh(&self, _: &TriMesh) -> Result<GpuMesh, GpuError> {
        match self.0 {}
    }

    /// Puts a sensor with its gel on the device.
    pub fn sensor(&self, _: &Sensor, _: &Gel) -> Result<GpuSensor, GpuError> {
        match self.0 {}
    }

    /// The same for batches of a size.
    pub fn sensor_for(&self, _: &Sensor, _: &Gel, _: usize) -> Result<GpuSensor, GpuError> {
        match self.0 {}
    }

    /// Makes images and hands them out.
    pub fn render(
        &self,
        _: &mut GpuSensor,
        _: &[GpuRequest<'_>],
        _: impl FnMut(usize, Result<GpuImage<'_>, IndentError>),
    ) -> Result<(), GpuError> {
        match self.0 {}
    }

    /// Makes images and leaves them on the device.
    pub fn render_resident(&self, _: &mut GpuSensor, _: &[GpuRequest<'_>]) -> Result<(), GpuError> {
        match self.0 {}
    }

    /// Seconds of each stage.
    pub fn stage_seconds(
        &self,
        _: &mut GpuSensor,
        _: &[GpuRequest<'_>],
        _: u32,
        _: &dyn Fn() -> f64,
    ) -> Result<Vec<(&'static str, f64)>, GpuError> {
        match self.0 {}
    }
}
