//! The pipeline on a graphics processor, through wgpu: batches of images from poses.
//!
//! Meshes, sensors and tables stay on the device; a batch uploads a pose, a force and a noise key for each image and
//! brings back packed RGB. Every stage is one WGSL file in `shaders/`, with the name of its twin on the processor.
//! Results are within a tolerance of those of [`crate::Renderer`], not equal to the bit: the surface within 1e-4 pixels,
//! and at most 0.05 % of the image's values more than one grey level apart.

mod batch;
mod buffers;
mod cast;
mod colour;
mod device;
mod encode;
mod layout;
mod mesh;
mod pipelines;
mod readback;
mod regression;
mod source;
#[cfg(test)]
mod source_tests;
#[cfg(test)]
mod tests;

pub use crate::gpu_types::{AdapterChoice, GpuAdapter, GpuError, GpuImage, makes};

/// A part pressed into a gel on the device.
pub type GpuPress<'a> = crate::gpu_types::Press<&'a GpuMesh>;

/// One image to make on the device.
pub type GpuRequest<'a> = crate::gpu_types::Request<&'a GpuMesh>;
pub use batch::{GpuMesh, GpuSensor};
pub use source::Variant;

use crate::grid::Plane;
use crate::indent::{IndentError, nothing_in_front};
use crate::sensor::Sensor;
use device::Device;
use encode::Run;
use gripgen_twin::{Gel, TactileImage, TriMesh};
use layout::{HAS_NOISE, HAS_PART, Outcome, PressInput};
use pipelines::Pipelines;

/// Values that a thread makes on a software adapter. 40 are a tenth faster and take three times as long to build.
const SOFTWARE_RUN: u32 = 16;

/// Images of a batch on a graphics processor where nobody asks for more.
pub const BATCH: usize = 64;

/// An open graphics processor.
pub struct GpuRenderer {
    device: Device,
    pipelines: Pipelines,
}

impl GpuRenderer {
    /// Opens an adapter.
    pub fn new(choice: &AdapterChoice) -> Result<Self, GpuError> {
        let device = Device::open(choice)?;
        let software = device.adapter.software;
        let variant = if software { Variant::Texture { run: SOFTWARE_RUN } } else { Variant::Tile };
        Ok(Self { device, pipelines: Pipelines::new(variant) })
    }

    /// The same with the kernels of the other class of adapters, to compare them.
    #[must_use]
    pub fn with_variant(self, variant: Variant) -> Self {
        Self { pipelines: Pipelines::new(variant), ..self }
    }

    /// Which adapter it is.
    pub fn adapter(&self) -> &GpuAdapter {
        &self.device.adapter
    }

    /// Puts a mesh on the device.
    pub fn mesh(&self, mesh: &TriMesh) -> Result<GpuMesh, GpuError> {
        GpuMesh::new(&self.device, mesh)
    }

    /// Puts a sensor with its gel on the device, with room for a batch of [`BATCH`] images.
    pub fn sensor(&self, sensor: &Sensor, gel: &Gel) -> Result<GpuSensor, GpuError> {
        self.sensor_for(sensor, gel, BATCH)
    }

    /// The same for batches of `most` images, or what the device binds; software adapters have their own number. An image of
    /// 320 x 240 pixels takes some 5 MB, 7 with shadows.
    pub fn sensor_for(&self, sensor: &Sensor, gel: &Gel, most: usize) -> Result<GpuSensor, GpuError> {
        GpuSensor::new(&self.device, &self.pipelines, sensor, gel, most.max(1))
    }

    /// Makes images, any number of them in any order of meshes, and hands them out with their place in `requests`.
    /// Three batches are under way at a time.
    pub fn render(
        &self,
        sensor: &mut GpuSensor,
        requests: &[GpuRequest<'_>],
        mut on_image: impl FnMut(usize, Result<GpuImage<'_>, IndentError>),
    ) -> Result<(), GpuError> {
        let order = by_mesh(requests);
        let (pixel_bytes, image_bytes) = (3 * sensor.grid.len(), sensor.image_bytes);
        let (grid, thickness_m) = (sensor.grid, sensor.thickness_m);
        let mut deliver = |bytes: &[u8], (first, count): (usize, usize)| {
            for (i, &place) in order[first..first + count].iter().enumerate() {
                let at = count * image_bytes + i * size_of::<Outcome>();
                let outcome = bytemuck::pod_read_unaligned(&bytes[at..at + size_of::<Outcome>()]);
                let rgb = &bytes[i * image_bytes..][..pixel_bytes];
                let press = requests[place].press.as_ref();
                let result = judge(&outcome, press, &grid, thickness_m)
                    .map(|press_depth_m| GpuImage { rgb, press_depth_m });
                on_image(place, result);
            }
        };
        let mut first = 0;
        for batch in order.chunks(sensor.batch) {
            if sensor.ring.is_full() {
                sensor.ring.take(&self.device, &mut deliver)?;
            }
            let mut encoder = self.encode(sensor, requests, batch);
            sensor.copy_out(&mut encoder, batch.len());
            let submission = self.device.queue.submit([encoder.finish()]);
            sensor.ring.put(submission, (first, batch.len()));
            first += batch.len();
        }
        while sensor.ring.take(&self.device, &mut deliver)? {}
        Ok(())
    }

    /// Makes images, in the order of `requests`.
    pub fn images(
        &self,
        sensor: &mut GpuSensor,
        requests: &[GpuRequest<'_>],
    ) -> Result<Vec<Result<TactileImage, IndentError>>, GpuError> {
        let (width_px, height_px) = (sensor.grid.width_px as u32, sensor.grid.height_px as u32);
        let mut images: Vec<Option<Result<TactileImage, IndentError>>> = vec![None; requests.len()];
        self.render(sensor, requests, |place, image| {
            images[place] = Some(image.map(|i| TactileImage { width_px, height_px, rgb: i.rgb.to_vec() }));
        })?;
        Ok(images.into_iter().map(|i| i.expect("every request is answered")).collect())
    }

    /// Makes images and leaves them on the device, where the next batch replaces them: for measurements.
    pub fn render_resident(
        &self,
        sensor: &mut GpuSensor,
        requests: &[GpuRequest<'_>],
    ) -> Result<(), GpuError> {
        for batch in by_mesh(requests).chunks(sensor.batch) {
            let encoder = self.encode(sensor, requests, batch);
            self.device.queue.submit([encoder.finish()]);
        }
        self.device.wait(None)
    }

    /// The gel surfaces of up to one batch of requests, in pixels towards the camera: the result of stage `deform`.
    pub fn surfaces(
        &self,
        sensor: &mut GpuSensor,
        requests: &[GpuRequest<'_>],
    ) -> Result<Vec<Plane>, GpuError> {
        let mut surfaces: Vec<Option<Plane>> = vec![None; requests.len()];
        for batch in by_mesh(requests).chunks(sensor.batch) {
            let encoder = self.encode(sensor, requests, batch);
            self.device.queue.submit([encoder.finish()]);
            for (&place, plane) in batch.iter().zip(sensor.read_surfaces(&self.device, batch.len())?) {
                surfaces[place] = Some(plane);
            }
        }
        Ok(surfaces.into_iter().map(|s| s.expect("every request is answered")).collect())
    }

    /// Seconds by `clock_s` that each stage takes of the first batch of requests: the mean of `repeats`, by its name and in order.
    pub fn stage_seconds(
        &self,
        sensor: &mut GpuSensor,
        requests: &[GpuRequest<'_>],
        repeats: u32,
        clock_s: &dyn Fn() -> f64,
    ) -> Result<Vec<(&'static str, f64)>, GpuError> {
        let order = by_mesh(requests);
        let batch = &order[..sensor.batch.min(order.len())];
        let (presses, runs) = inputs(sensor, requests, batch);
        sensor.stage_seconds(&self.device, &presses, &runs, repeats.max(1), clock_s)
    }

    fn encode(
        &self,
        sensor: &GpuSensor,
        requests: &[GpuRequest<'_>],
        batch: &[usize],
    ) -> wgpu::CommandEncoder {
        let (presses, runs) = inputs(sensor, requests, batch);
        sensor.encode(&self.device, &presses, &runs)
    }
}

/// What a batch uploads, and its runs of images that show the same mesh.
fn inputs<'a>(
    sensor: &GpuSensor,
    requests: &[GpuRequest<'a>],
    batch: &[usize],
) -> (Vec<PressInput>, Vec<Run<'a>>) {
    let presses: Vec<PressInput> = batch.iter().map(|&i| press_of(&requests[i], &sensor.grid)).collect();
    let mut runs: Vec<Run<'a>> = vec![];
    for (i, &place) in batch.iter().enumerate() {
        let Some(press) = &requests[place].press else { continue };
        match runs.last_mut() {
            Some((_, count, mesh)) if std::ptr::eq(*mesh, press.mesh) => *count += 1,
            _ => runs.push((i, 1, press.mesh)),
        }
    }
    (presses, runs)
}

/// Places of the requests, those with the same mesh one after another.
fn by_mesh(requests: &[GpuRequest<'_>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..requests.len()).collect();
    order.sort_by_key(|&i| requests[i].press.as_ref().map(|p| std::ptr::from_ref(p.mesh).addr()));
    order
}

fn press_of(request: &GpuRequest<'_>, grid: &crate::Grid) -> PressInput {
    let mut press: PressInput = bytemuck::Zeroable::zeroed();
    if let Some(part) = &request.press {
        part.mesh.steps.place(&part.gel_from_mesh, grid, &mut press);
        let a = grid.metres_per_px;
        press.wanted_px3 = (part.imprint_m3_per_n * part.force_n / (a * a * a)) as f32;
        press.flags |= HAS_PART;
    }
    if let Some(key) = request.noise_key {
        press.key = [key as u32, (key >> 32) as u32];
        press.flags |= HAS_NOISE;
    }
    press
}

/// The press depth, or why there is none.
fn judge(
    outcome: &Outcome,
    press: Option<&GpuPress<'_>>,
    grid: &crate::Grid,
    thickness_m: f64,
) -> Result<f64, IndentError> {
    let a = grid.metres_per_px;
    match (outcome.status, press) {
        (1, _) => Err(nothing_in_front(grid)),
        (2, Some(press)) => Err(IndentError::ThroughTheGel {
            force_n: press.force_n,
            wanted_mm3: press.imprint_m3_per_n * press.force_n * 1e9,
            thickness_mm: thickness_m * 1e3,
            available_mm3: f64::from(outcome.available_px3) * a * a * a * 1e9,
        }),
        _ => Ok(f64::from(outcome.press_px) * a),
    }
}
