//! One sensor on the device: what stays there, and the passes of a batch.

use super::GpuError;
use super::buffers::{Pass, Planes, bind, bind_at, empty, new_planes, resident, with_content};
use super::cast::{Cast, Scene, ceiling};
use super::colour::Colours;
use super::device::Device;
use super::layout::{Cluster, Frame, Outcome, PressInput};
use super::mesh::{Clusters, Steps};
use super::pipelines::{Key, Pipelines, Stage};
use super::readback::Ring;
use super::regression::Around;
use super::source::{Axis, Blur, Restored, Sampling, Variant};
use crate::convolve::mirrored;
use crate::deform::{FINAL_KERNEL_PX, gaussian};
use crate::grid::{Grid, Plane};
use crate::render::Renderer;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use gripgen_twin::image::pixel_noise::levels;
use gripgen_twin::{Gel, TriMesh};
use wgpu::BufferUsages;

/// Images of a batch. More planes than a processor's cache holds make a software adapter slower.
const SOFTWARE_BATCH: u64 = 8;

/// Where an image has pixels beside steps: `TILES` words of `layout.wgsl`.
pub(super) const TILE_BYTES: u64 = 4 * 32;

/// A mesh on the device.
pub struct GpuMesh {
    pub(super) clusters: wgpu::Buffer,
    pub(super) vertices: wgpu::Buffer,
    pub(super) triangles: wgpu::Buffer,
    pub(super) count: u32,
    pub(super) steps: Steps,
}

impl GpuMesh {
    pub(super) fn new(device: &Device, mesh: &TriMesh) -> Result<Self, GpuError> {
        let made = Clusters::new(mesh);
        let bytes = (made.vertices.len() * 4).max(made.clusters.len() * size_of::<Cluster>()) as u64;
        let limits = device.device.limits();
        let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > allowed {
            return Err(GpuError::TooLarge { what: "mesh", bytes, allowed });
        }
        Ok(Self {
            clusters: resident(device, "clusters", &made.clusters),
            vertices: resident(device, "vertices", &made.vertices),
            triangles: resident(device, "triangles", &made.triangles),
            count: made.clusters.len() as u32,
            steps: made.steps,
        })
    }
}

/// A sensor with its gel on the device: rest frame, colours, blurs, and the planes of one batch.
pub struct GpuSensor {
    pub(super) grid: Grid,
    pub(super) thickness_m: f64,
    pub(super) batch: usize,
    pub(super) image_bytes: usize,
    pub(super) ring: Ring,
    pub(super) raster: [Stage; 3],
    pub(super) frame: wgpu::Buffer,
    pub(super) presses: wgpu::Buffer,
    pub(super) tops: wgpu::Buffer,
    pub(super) heights: wgpu::Buffer,
    /// Pixels beside steps, heights at their points, and in which tiles an image has any.
    pub(super) steps: wgpu::Buffer,
    pub(super) points: wgpu::Buffer,
    pub(super) stepped: wgpu::Buffer,
    pub(super) outcomes: wgpu::Buffer,
    /// What the rays of shadows leave; 0 at the start of a batch.
    pub(super) lowest: Option<wgpu::Buffer>,
    pub(super) packed: wgpu::Buffer,
    pub(super) surface: Planes,
    /// Press by centres, find steps, press by points.
    pub(super) indent: [Pass; 3],
    /// Between the stages `indent` and `gradient`: the blurs, the surroundings of colours by regression, shadows.
    pub(super) between: Vec<Pass>,
    pub(super) image: Pass,
}

impl GpuSensor {
    /// Images that are computed at once.
    pub fn batch(&self) -> usize {
        self.batch
    }

    pub(super) fn new(
        device: &Device,
        pipelines: &Pipelines,
        sensor: &Sensor,
        gel: &Gel,
        most: usize,
    ) -> Result<Self, GpuError> {
        let grid = sensor.grid;
        let pixels = grid.len() as u64;
        let image_words = pixels.div_ceil(4) * 3;
        let limits = device.device.limits();
        let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = if device.adapter.software { SOFTWARE_BATCH } else { most as u64 };
        let colours = Colours::new(sensor, gel)?;
        // The heights at nine points of each pixel are the largest of the planes that all sensors have.
        let floats = (9 * pixels).max(colours.regression.map_or(0, |r| u64::from(r.image_floats)));
        let batch = most.min(allowed / (4 * floats)).min(u64::from(limits.max_texture_array_layers));
        let image_groups = pixels.div_ceil(4).div_ceil(64);
        if batch == 0 || image_groups > u64::from(limits.max_compute_workgroups_per_dimension) {
            return Err(GpuError::TooLarge { what: "image", bytes: 4 * floats, allowed });
        }
        let on_processor = Renderer { sensor, gel, level: SimdLevel::best() };
        let (kernels_px, restore_depth_fraction) = on_processor.pyramid();
        let rest_px = sensor.gel_shape.rest_px(&grid);
        let shape = RestShape::new(rest_px, &grid, kernels_px, on_processor.blurs_whole_gel());
        let frame = Frame {
            width_px: grid.width_px as u32,
            height_px: grid.height_px as u32,
            image_words: image_words as u32,
            bins: colours.bins,
            thickness_px: (gel.thickness_m / grid.metres_per_px) as f32,
            reach_px: (gel.thickness_m / grid.metres_per_px + shape.sag_px + 1.0) as f32,
            restore_depth_fraction: restore_depth_fraction as f32,
            noise_red: sensor.noise_rgb[0],
            noise_green: sensor.noise_rgb[1],
            noise_blue: sensor.noise_rgb[2],
        };
        let frame = with_content(device, "frame", bytemuck::bytes_of(&frame), BufferUsages::UNIFORM);
        let gel_at_rest = resident(device, "gel at rest", &shape.rest_px);
        let rest = resident(device, "rest frame", &colours.rest);
        let colour = bytemuck::cast_slice(&colours.coefficients);
        let colour = with_content(device, "colours", colour, BufferUsages::STORAGE | BufferUsages::UNIFORM);
        let noise = resident(device, "noise", levels());
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffer = |label, bytes: u64| empty(device, label, batch * bytes, storage);
        let presses = buffer("presses", size_of::<PressInput>() as u64);
        let tops = buffer("tops", 4);
        let heights = buffer("heights", 4 * pixels);
        let steps = buffer("steps", 4 * pixels);
        let points = buffer("points", 36 * pixels);
        let stepped = buffer("stepped", TILE_BYTES);
        let outcomes = buffer("outcomes", size_of::<Outcome>() as u64);
        let packed = buffer("packed images", 4 * image_words);
        let planes = || new_planes(device, pipelines.variant(), &grid, batch);
        let (contact, half_way, surface) = (planes(), planes(), planes());
        let (core, share) = (planes(), planes());

        let press = |sampling| -> Result<Pass, GpuError> {
            let stage = pipelines.get(device, Key::Indent(sampling))?;
            let all = [&frame, &presses, &heights, &outcomes].map(wgpu::Buffer::as_entire_binding);
            let all = all.into_iter().chain([contact.binding(), gel_at_rest.as_entire_binding()]);
            let of_points = [&steps, &points, &stepped].map(wgpu::Buffer::as_entire_binding);
            let all = all.chain(of_points.into_iter().filter(|_| sampling == Sampling::Points));
            let bound = bind(device, &stage, all);
            Ok(Pass { stage, bound, groups: [1, 1] })
        };
        let find_steps = {
            let stage = pipelines.get(device, Key::Steps)?;
            let all = [&frame, &steps, &points, &stepped].map(wgpu::Buffer::as_entire_binding);
            let bound = bind(device, &stage, all.into_iter().chain([contact.binding()]));
            Pass { stage, bound, groups: [pixels.div_ceil(64) as u32, 0] }
        };
        let indent = [press(Sampling::Centres)?, find_steps, press(Sampling::Points)?];
        let mut between = Vec::new();
        let whole_pixels = on_processor.blurs_whole_gel();
        let restored = if whole_pixels { Restored::Whole } else { Restored::Share(on_processor.follow()) };
        if !whole_pixels {
            let stage = pipelines.get(device, Key::Core)?;
            let all = [&frame, &outcomes, &steps, &points, &gel_at_rest].map(wgpu::Buffer::as_entire_binding);
            let all = all.into_iter().chain([&contact, &core, &share].map(Planes::binding));
            let bound = bind(device, &stage, all);
            between.push(Pass { stage, bound, groups: [pixels.div_ceil(64) as u32, 1] });
        }
        let mut reach_px = [0; 2];
        for (i, (kernel_px, restore)) in
            kernels_px.iter().map(|&k| (k, Some(restored))).chain([(FINAL_KERNEL_PX, None)]).enumerate()
        {
            let from = if i == 0 { &contact } else { &surface };
            let lift = shape.lift_px.get(i).map(|lift| resident(device, "lift", lift));
            let ways = [(Axis::Y, from, &half_way, None), (Axis::X, &half_way, &surface, restore)];
            for (axis, source, blurred, restore) in ways {
                let lift = lift.as_ref().filter(|_| axis == Axis::X);
                reach_px[usize::from(axis == Axis::Y)] += kernel_px / 2;
                let blur = Blur { kernel_px, axis, restore, lifted: lift.is_some(), reach_px };
                let stage = pipelines.get(device, Key::Blur(blur))?;
                let all = [frame.as_entire_binding(), outcomes.as_entire_binding()];
                let all = all.into_iter().chain([source.binding(), blurred.binding()]);
                let all = all.enumerate().map(|(i, r)| (i as u32, r));
                let all: Vec<_> = all
                    .chain(restore.iter().flat_map(|restored| match restored {
                        Restored::Whole => vec![(4, contact.binding())],
                        Restored::Share(_) => vec![(4, core.binding()), (6, share.binding())],
                    }))
                    .chain(lift.map(|lift| (5, lift.as_entire_binding())))
                    .collect();
                let bound = bind_at(device, &stage, all);
                let (w, h) = (grid.width_px as u32, grid.height_px as u32);
                let (along, across) = if axis == Axis::X { (w, h) } else { (h, w) };
                let shape = stage.shape.expect("blurs have one");
                let (along, across) = (along.div_ceil(shape.span), across.div_ceil(shape.lines));
                let sideways = axis == Axis::Y && matches!(pipelines.variant(), Variant::Texture { .. });
                let groups = if sideways { [across, along] } else { [along, across] };
                between.push(Pass { stage, bound, groups });
            }
        }
        let around = Around::new(device, pipelines, &colours, &frame, &surface, batch)?;
        // What stage `shade` reads beside the surface.
        let regression = around.iter().flat_map(|a| [(8, &a.regression), (9, &a.cells)]);
        let shading = [(2, &rest), (3, &colour)].into_iter().chain(regression);
        let shading: Vec<_> = shading.map(|(i, buffer)| (i, buffer.as_entire_binding())).collect();
        let cast = match &colours.shadows {
            None => None,
            Some(shadow) => {
                let scene = Scene {
                    grid: &grid,
                    frame: &frame,
                    outcomes: &outcomes,
                    surface: &surface,
                    contact: &contact,
                    gel: shape.domed.then_some(&gel_at_rest),
                    shade: colours.shade,
                    shading: shading.clone(),
                };
                Some(Cast::new(device, pipelines, shadow, scene, batch)?)
            }
        };
        let image = {
            // Colours by regression look at the displacement alone.
            let domed = shape.domed && around.is_none();
            let shadows = colours.shadows.as_deref().map(ceiling);
            let stage = pipelines.get(device, Key::Image(colours.shade, domed, shadows))?;
            let own = [(0, &frame), (1, &presses), (4, &noise), (5, &packed)];
            let own = own.into_iter().chain(domed.then_some((7, &gel_at_rest)));
            let own = own.chain(cast.as_ref().map(|c| (10, &c.dark)));
            let own = own.map(|(i, buffer)| (i, buffer.as_entire_binding()));
            let all = own.chain([(6, surface.binding())]).chain(shading);
            let bound = bind_at(device, &stage, all);
            Pass { stage, bound, groups: [image_groups as u32, 0] }
        };
        between.extend(around.map(|a| a.passes).unwrap_or_default());
        let lowest = cast.as_ref().map(|c| c.lowest.clone());
        between.extend(cast.map(|c| c.passes).unwrap_or_default());
        device.check()?;
        Ok(Self {
            grid,
            thickness_m: gel.thickness_m,
            batch: batch as usize,
            image_bytes: 4 * image_words as usize,
            ring: Ring::new(device, batch * (4 * image_words + size_of::<Outcome>() as u64)),
            raster: [
                pipelines.get(device, Key::RasterTop)?,
                pipelines.get(device, Key::RasterFill(Sampling::Centres))?,
                pipelines.get(device, Key::RasterFill(Sampling::Points))?,
            ],
            frame,
            presses,
            tops,
            heights,
            steps,
            points,
            stepped,
            outcomes,
            lowest,
            packed,
            surface,
            indent,
            between,
            image,
        })
    }

    /// Adds the copy of a batch's images, then outcomes, to the ring's buffer.
    pub(super) fn copy_out(&self, encoder: &mut wgpu::CommandEncoder, images: usize) {
        let bytes = (images * self.image_bytes) as u64;
        let outcomes = (images * size_of::<Outcome>()) as u64;
        encoder.copy_buffer_to_buffer(&self.packed, 0, self.ring.buffer(), 0, bytes);
        encoder.copy_buffer_to_buffer(&self.outcomes, 0, self.ring.buffer(), bytes, outcomes);
    }

    /// The gel surfaces of the last batch.
    pub(super) fn read_surfaces(&self, device: &Device, images: usize) -> Result<Vec<Plane>, GpuError> {
        let (w, h) = (self.grid.width_px, self.grid.height_px);
        let mut encoder = device.device.create_command_encoder(&Default::default());
        // Rows of a texture are copied to multiples of 256 bytes.
        let row_bytes = match self.surface {
            Planes::Texture(..) => (4 * w).next_multiple_of(256),
            Planes::Buffer(_) => 4 * w,
        };
        let bytes = (images * h * row_bytes) as u64;
        let staging = empty(device, "surfaces", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        match &self.surface {
            Planes::Buffer(buffer) => encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes),
            Planes::Texture(texture, _) => encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &staging,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(row_bytes as u32),
                        rows_per_image: Some(h as u32),
                    },
                },
                wgpu::Extent3d { width: w as u32, height: h as u32, depth_or_array_layers: images as u32 },
            ),
        }
        device.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |_| {});
        device.wait(None)?;
        let view = staging.get_mapped_range(..).map_err(|e| GpuError::Device {
            adapter: device.adapter.to_string(),
            problem: format!("reading back: {e}"),
        })?;
        let planes = view.chunks_exact(h * row_bytes).map(|image| Plane {
            width: w,
            height: h,
            values: image
                .chunks_exact(row_bytes)
                .flat_map(|row| row[..4 * w].chunks_exact(4))
                .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                .collect(),
        });
        Ok(planes.collect())
    }
}

/// A gel that is not flat at rest: its surface, and how far each blur moves it. CPU twin: `BlurredRest` in src/deform.rs, where the
/// formulas are.
struct RestShape {
    /// Heights towards the part in pixels, at most 0.
    rest_px: Vec<f32>,
    /// Deepest of them below 0.
    sag_px: f64,
    /// Whether it is not flat.
    domed: bool,
    /// After each blur what is added: `G_0 - G_i` to the core, after the last blur `G_n - G_0` to all. None if it is
    /// flat, or the blurs work on the displacement alone.
    lift_px: Vec<Vec<f32>>,
}

impl RestShape {
    /// `whole_gel`: whether the blurs work on the whole gel (`Renderer::blurs_whole_gel`).
    fn new(rest: Option<Plane>, grid: &Grid, kernels_px: &[u32], whole_gel: bool) -> Self {
        let Some(rest) = rest else {
            return Self { rest_px: vec![0.0; grid.len()], sag_px: 0.0, domed: false, lift_px: vec![] };
        };
        let first: Vec<f64> = rest.values.iter().map(|&h| -f64::from(h)).collect();
        let mut blurred = first.clone();
        let mut lift_px = vec![];
        for &kernel_px in kernels_px.iter().chain([&FINAL_KERNEL_PX]).take_while(|_| whole_gel) {
            blurred = blur(&blurred, grid, &gaussian(kernel_px));
            lift_px.push(first.iter().zip(&blurred).map(|(g0, g)| (g0 - g) as f32).collect::<Vec<f32>>());
        }
        if let Some(last) = lift_px.last_mut() {
            last.iter_mut().for_each(|l| *l = -*l);
        }
        let sag_px = first.iter().fold(0.0, |m: f64, &s| m.max(s));
        Self { rest_px: rest.values, sag_px, domed: true, lift_px }
    }
}

/// A blur along both axes with mirrored borders.
fn blur(values: &[f64], grid: &Grid, weights: &[f32]) -> Vec<f64> {
    let (w, h) = (grid.width_px, grid.height_px);
    let half = weights.len() as isize / 2;
    let along = |from: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        (0..w * h)
            .map(|i| {
                let (x, y) = ((i % w) as isize, (i / w) as isize);
                weights.iter().enumerate().fold(0.0, |sum, (k, &weight)| {
                    let o = k as isize - half;
                    let at = mirrored(y + o * dy, h) * w + mirrored(x + o * dx, w);
                    sum + f64::from(weight) * from[at]
                })
            })
            .collect()
    };
    along(&along(values, 0, 1), 1, 0)
}
