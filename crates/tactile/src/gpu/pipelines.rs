//! Compute pipelines, built when they are first needed.

use super::GpuError;
use super::device::Device;
use super::source::{self, Blur, BlurShape, Ceiling, Sampling, Shade, Step, Variant};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// A pipeline; its bind group layout follows from the source.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub(super) pipeline: wgpu::ComputePipeline,
    /// The stage of the pipeline that it is part of.
    pub(super) name: &'static str,
    /// How a blur shares the image.
    pub(super) shape: Option<BlurShape>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Key {
    RasterTop,
    RasterFill(Sampling),
    Steps,
    Indent(Sampling),
    Blur(Blur),
    Around(Step),
    Image(Shade, bool, Option<Ceiling>),
    ShadowRays(bool),
    ShadowMerge(Shade, bool, Ceiling),
    ShadowBlur,
}

impl Key {
    fn stage(self) -> &'static str {
        match self {
            Key::RasterTop | Key::RasterFill(Sampling::Centres) => "raster",
            Key::RasterFill(Sampling::Points) => "raster of points",
            Key::Steps => "steps",
            Key::Indent(_) => "indent",
            Key::Blur(_) => "deform",
            Key::Around(_) => "surroundings",
            Key::Image(..) => "shade and noise",
            Key::ShadowRays(_) | Key::ShadowMerge(..) | Key::ShadowBlur => "shadow",
        }
    }
}

/// All pipelines of a renderer.
pub(super) struct Pipelines {
    variant: Variant,
    built: Mutex<HashMap<Key, Stage>>,
}

impl Pipelines {
    pub(super) fn new(variant: Variant) -> Self {
        Self { variant, built: Mutex::default() }
    }

    pub(super) fn variant(&self) -> Variant {
        self.variant
    }

    pub(super) fn raster_top(&self, device: &Device) -> Result<Stage, GpuError> {
        self.get(device, Key::RasterTop, "top", || Ok((source::raster(Sampling::Centres), None)))
    }

    pub(super) fn raster_fill(&self, device: &Device, sampling: Sampling) -> Result<Stage, GpuError> {
        self.get(device, Key::RasterFill(sampling), "fill", || Ok((source::raster(sampling), None)))
    }

    pub(super) fn steps(&self, device: &Device) -> Result<Stage, GpuError> {
        self.get(device, Key::Steps, "main", || Ok((source::steps(self.variant), None)))
    }

    pub(super) fn indent(&self, device: &Device, sampling: Sampling) -> Result<Stage, GpuError> {
        let most = device.device.limits().max_compute_invocations_per_workgroup;
        // A power of two, as its sums want.
        let threads = if self.variant == Variant::Tile && most >= 1024 { 1024 } else { 256 };
        let source = || Ok((source::indent(self.variant, sampling, threads), None));
        self.get(device, Key::Indent(sampling), "main", source)
    }

    pub(super) fn image(
        &self,
        device: &Device,
        shade: Shade,
        domed: bool,
        shadows: Option<Ceiling>,
    ) -> Result<Stage, GpuError> {
        let source = || Ok((source::image(self.variant, shade, domed, shadows), None));
        self.get(device, Key::Image(shade, domed, shadows), "main", source)
    }

    pub(super) fn shadow_rays(&self, device: &Device, domed: bool) -> Result<Stage, GpuError> {
        let source = || Ok((source::shadow_rays(self.variant, domed), None));
        self.get(device, Key::ShadowRays(domed), "main", source)
    }

    pub(super) fn shadow_merge(
        &self,
        device: &Device,
        shade: Shade,
        domed: bool,
        kind: Ceiling,
    ) -> Result<Stage, GpuError> {
        let source = || Ok((source::shadow_merge(self.variant, shade, domed, kind), None));
        self.get(device, Key::ShadowMerge(shade, domed, kind), "main", source)
    }

    pub(super) fn shadow_blur(&self, device: &Device) -> Result<Stage, GpuError> {
        self.get(device, Key::ShadowBlur, "main", || Ok((source::shadow_blur(), None)))
    }

    /// A step of the surroundings of colours by regression.
    pub(super) fn around(&self, device: &Device, step: Step) -> Result<Stage, GpuError> {
        let source = || Ok((source::around(self.variant, step), None));
        self.get(device, Key::Around(step), step.entry_point(), source)
    }

    pub(super) fn blur(&self, device: &Device, blur: Blur) -> Result<Stage, GpuError> {
        self.get(device, Key::Blur(blur), "main", || {
            let workgroup_bytes = device.device.limits().max_compute_workgroup_storage_size;
            let (source, shape) = source::blur(self.variant, blur, workgroup_bytes)
                .ok_or(GpuError::Kernel { kernel_px: blur.kernel_px, workgroup_bytes })?;
            Ok((source, Some(shape)))
        })
    }

    fn get(
        &self,
        device: &Device,
        key: Key,
        entry: &str,
        source: impl FnOnce() -> Result<(String, Option<BlurShape>), GpuError>,
    ) -> Result<Stage, GpuError> {
        let mut built = self.built.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(stage) = built.get(&key) {
            return Ok(stage.clone());
        }
        let label = format!("{key:?}");
        let (source, shape) = source()?;
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(&label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        };
        // Counters that end loops cost a fifth of the images. Bounds stay checked.
        let checks =
            wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
        // SAFETY: the sources are ours and have no loop without an end: each counts a whole number towards a bound, halves an
        // interval, or ends after MAX_STEPS.
        let module = unsafe { device.device.create_shader_module_trusted(descriptor, checks) };
        let pipeline = device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&label),
            layout: None,
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        });
        device.check()?;
        let stage = Stage { pipeline, name: key.stage(), shape };
        built.insert(key, stage.clone());
        Ok(stage)
    }
}
