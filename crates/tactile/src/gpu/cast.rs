//! Shadows on the device. CPU twin: src/shadow.rs.

use super::GpuError;
use super::buffers::{Pass, Planes, bind_at, empty, resident, with_content};
use super::device::Device;
use super::layout::{ShadowBlur, Shadows};
use super::pipelines::{Key, Pipelines};
use super::source::{Ceiling, Shade};
use crate::grid::Grid;
use crate::shadow::blur::Border;
use crate::shadow::{Shadow, ShadowKind};
use wgpu::{BindingResource, BufferUsages};

/// What the values of a table are to the device.
pub(super) fn ceiling(shadow: &Shadow) -> Ceiling {
    match (shadow.table().kind, &shadow.base) {
        (ShadowKind::Darkening, _) => Ceiling::Added,
        (ShadowKind::Ceiling, None) => Ceiling::Relative,
        (ShadowKind::Ceiling, Some(_)) => Ceiling::Taxim,
    }
}

/// A value of a ray as an integer that is larger for smaller values; 0 for none.
fn code(value: f32) -> u32 {
    let bits = value.to_bits();
    if value == f32::INFINITY {
        0
    } else if bits < 0x8000_0000 {
        !(bits | 0x8000_0000)
    } else {
        bits
    }
}

/// Where a target lies, 16 bits per axis. Images are not that large.
fn packed([dx, dy]: [i32; 2]) -> u32 {
    (dx.clamp(-0x8000, 0x7fff) as u32 & 0xffff) | (dy.clamp(-0x8000, 0x7fff) as u32) << 16
}

/// What the passes of the shadows read.
pub(super) struct Scene<'a> {
    pub(super) grid: &'a Grid,
    pub(super) frame: &'a wgpu::Buffer,
    pub(super) outcomes: &'a wgpu::Buffer,
    pub(super) surface: &'a Planes,
    pub(super) contact: &'a Planes,
    /// The surface of a gel that is not flat.
    pub(super) gel: Option<&'a wgpu::Buffer>,
    pub(super) shade: Shade,
    /// What stage `shade` reads beside the surface: bindings and resources.
    pub(super) shading: Vec<(u32, BindingResource<'a>)>,
}

/// The shadows of one sensor with room for a batch.
pub(super) struct Cast {
    /// Has to be 0 at the start of a batch.
    pub(super) lowest: wgpu::Buffer,
    pub(super) dark: wgpu::Buffer,
    pub(super) passes: Vec<Pass>,
}

impl Cast {
    pub(super) fn new(
        device: &Device,
        pipelines: &Pipelines,
        shadow: &Shadow,
        scene: Scene<'_>,
        batch: u64,
    ) -> Result<Self, GpuError> {
        let bytes = 12 * batch * scene.grid.len() as u64;
        let lowest = empty(device, "rays", bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let plane = |label| empty(device, label, bytes, BufferUsages::STORAGE);
        let (dark, half_way) = (plane("shadows"), plane("shadows half way"));
        let groups = [scene.grid.width_px.div_ceil(16) as u32, scene.grid.height_px.div_ceil(4) as u32];
        let mut passes = vec![];

        let rays = &shadow.rays;
        let borders: Vec<[f32; 2]> = rays.sectors.borders().iter().map(|b| b.map(|x| x as f32)).collect();
        let uniform = Shadows {
            rim_px: shadow.rim_px as u32,
            heights: rays.heights as u32,
            directions: borders.len() as u32,
            held: u32::from(rays.clamped),
            first_px: rays.first_px as f32,
            per_px: rays.per_px as f32,
        };
        let uniform =
            with_content(device, "shadow table", bytemuck::bytes_of(&uniform), BufferUsages::UNIFORM);
        let fans: Vec<[u32; 2]> = rays.fans.iter().map(|&(from, to, _)| [from as u32, to as u32]).collect();
        let mut targets: Vec<[u32; 4]> = rays
            .targets
            .iter()
            .map(|t| [packed([t.dx, t.dy]), code(t.value[0]), code(t.value[1]), code(t.value[2])])
            .collect();
        // A binding is never empty.
        targets.push([0; 4]);
        let allowed = device.device.limits().max_storage_buffer_binding_size;
        let bytes = size_of_val(&targets[..]) as u64;
        if bytes > allowed {
            return Err(GpuError::TooLarge { what: "shadow table", bytes, allowed });
        }
        let borders = resident(device, "sectors", &borders);
        let fans = resident(device, "fans", &fans);
        let targets = resident(device, "targets", &targets);
        let stage = pipelines.get(device, Key::ShadowRays(scene.gel.is_some()))?;
        let bound = [scene.frame, &uniform, scene.outcomes, &borders, &fans, &targets];
        let bound = bound.into_iter().enumerate().map(|(i, b)| (i as u32, b.as_entire_binding()));
        let planes = [(6, scene.surface.binding()), (8, scene.contact.binding())];
        let bound = bound.chain(planes).chain(scene.gel.map(|gel| (7, gel.as_entire_binding())));
        let bound = bind_at(device, &stage, bound.chain([(9, lowest.as_entire_binding())]));
        passes.push(Pass { stage, bound, groups });

        let kind = ceiling(shadow);
        // Colours by regression look at the displacement alone.
        let domed = scene.gel.is_some() && scene.shade != Shade::Regressor;
        let stage = pipelines.get(device, Key::ShadowMerge(scene.shade, domed, kind))?;
        let mut bound = vec![(0, scene.frame.as_entire_binding())];
        bound.extend([(10, lowest.as_entire_binding()), (11, dark.as_entire_binding())]);
        // The source has `rest` in every kind, and nothing of the stage `shade` where values are added.
        bound
            .extend(scene.shading.into_iter().filter(|(binding, _)| *binding == 2 || kind != Ceiling::Added));
        if kind != Ceiling::Added {
            bound.push((6, scene.surface.binding()));
            bound.extend(scene.gel.filter(|_| domed).map(|gel| (7, gel.as_entire_binding())));
        }
        passes.push(Pass { bound: bind_at(device, &stage, bound), stage, groups });

        for one in &shadow.blurs {
            let weights_px = resident(device, "weights", &one.weights);
            for (down, from, to) in [(0, &dark, &half_way), (1, &half_way, &dark)] {
                let radius = one.weights.len() as i32 - 1;
                let edge_once = u32::from(one.border == Border::EdgeOnce);
                let blur = ShadowBlur { radius, edge_once, down };
                let blur = with_content(device, "blur", bytemuck::bytes_of(&blur), BufferUsages::UNIFORM);
                let stage = pipelines.get(device, Key::ShadowBlur)?;
                let bound = [scene.frame, &blur, &weights_px, from, to].into_iter().enumerate();
                let bound = bind_at(device, &stage, bound.map(|(i, b)| (i as u32, b.as_entire_binding())));
                passes.push(Pass { stage, bound, groups });
            }
        }
        Ok(Self { lowest, dark, passes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_grow_as_values_fall_and_none_is_0() {
        let values = [f32::INFINITY, 1e30, 3.0, 1e-30, 0.0, -1e-30, -2.5, -1e30];
        let codes = values.map(code);
        assert!(codes[0] == 0 && codes.windows(2).all(|c| c[0] < c[1]), "{codes:x?}");
        assert_eq!(packed([-1, 2]), 0x0002_ffff);
        assert_eq!(packed([3, -4]), 0xfffc_0003);
    }
}
