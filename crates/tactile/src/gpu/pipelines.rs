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

/// Which pipeline; all that its source depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Key {
    RasterTop,
    RasterFill(Sampling),
    Steps,
    Indent(Sampling),
    Core,
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
            Key::Core | Key::Blur(_) => "deform",
            Key::Around(_) => "surroundings",
            Key::Image(..) => "shade and noise",
            Key::ShadowRays(_) | Key::ShadowMerge(..) | Key::ShadowBlur => "shadow",
        }
    }

    fn entry_point(self) -> &'static str {
        match self {
            Key::RasterTop => "top",
            Key::RasterFill(_) => "fill",
            Key::Around(step) => step.entry_point(),
            _ => "main",
        }
    }

    /// The WGSL source, and how a blur shares the image.
    fn source(
        self,
        variant: Variant,
        limits: &wgpu::Limits,
    ) -> Result<(String, Option<BlurShape>), GpuError> {
        let source = match self {
            Key::RasterTop => source::raster(Sampling::Centres),
            Key::RasterFill(sampling) => source::raster(sampling),
            Key::Steps => source::steps(variant),
            Key::Indent(sampling) => {
                let most = limits.max_compute_invocations_per_workgroup;
                // A power of two, as its sums want.
                let threads = if variant == Variant::Tile && most >= 1024 { 1024 } else { 256 };
                source::indent(variant, sampling, threads)
            }
            Key::Core => source::core(variant),
            Key::Blur(blur) => {
                let workgroup_bytes = limits.max_compute_workgroup_storage_size;
                let (source, shape) = source::blur(variant, blur, workgroup_bytes)
                    .ok_or(GpuError::Kernel { kernel_px: blur.kernel_px, workgroup_bytes })?;
                return Ok((source, Some(shape)));
            }
            Key::Around(step) => source::around(variant, step),
            Key::Image(shade, domed, shadows) => source::image(variant, shade, domed, shadows),
            Key::ShadowRays(domed) => source::shadow_rays(variant, domed),
            Key::ShadowMerge(shade, domed, kind) => source::shadow_merge(variant, shade, domed, kind),
            Key::ShadowBlur => source::shadow_blur(),
        };
        Ok((source, None))
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

    /// The pipeline of a stage.
    pub(super) fn get(&self, device: &Device, key: Key) -> Result<Stage, GpuError> {
        let mut built = self.built.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(stage) = built.get(&key) {
            return Ok(stage.clone());
        }
        let label = format!("{key:?}");
        let (source, shape) = key.source(self.variant, &device.device.limits())?;
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
            entry_point: Some(key.entry_point()),
            compilation_options: Default::default(),
            cache: None,
        });
        device.check()?;
        let stage = Stage { pipeline, name: key.stage(), shape };
        built.insert(key, stage.clone());
        Ok(stage)
    }
}
