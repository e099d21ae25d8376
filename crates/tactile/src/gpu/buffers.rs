//! Buffers, planes and bindings of the passes.

use super::device::Device;
use super::pipelines::Stage;
use super::source::Variant;
use crate::grid::Grid;
use wgpu::BufferUsages;

/// A plane for every image of a batch.
pub(super) enum Planes {
    Texture(wgpu::Texture, wgpu::TextureView),
    Buffer(wgpu::Buffer),
}

impl Planes {
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Planes::Texture(_, view) => wgpu::BindingResource::TextureView(view),
            Planes::Buffer(buffer) => buffer.as_entire_binding(),
        }
    }
}

/// A dispatch with what it is bound to. Its third dimension is the image.
pub(super) struct Pass {
    pub(super) stage: Stage,
    pub(super) bound: wgpu::BindGroup,
    pub(super) groups: [u32; 2],
}

pub(super) fn new_planes(device: &Device, variant: Variant, grid: &Grid, batch: u64) -> Planes {
    match variant {
        Variant::Tile => Planes::Buffer(empty(
            device,
            "planes",
            4 * batch * grid.len() as u64,
            BufferUsages::STORAGE | BufferUsages::COPY_SRC,
        )),
        Variant::Texture { .. } => {
            let texture = device.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("planes"),
                size: wgpu::Extent3d {
                    width: grid.width_px as u32,
                    height: grid.height_px as u32,
                    depth_or_array_layers: batch as u32,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::R32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            });
            Planes::Texture(texture, view)
        }
    }
}

pub(super) fn bind<'a>(
    device: &Device,
    stage: &Stage,
    resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    bind_at(device, stage, resources.into_iter().enumerate().map(|(i, r)| (i as u32, r)))
}

pub(super) fn bind_at<'a>(
    device: &Device,
    stage: &Stage,
    resources: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
) -> wgpu::BindGroup {
    let entries: Vec<_> =
        resources.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &stage.pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}

pub(super) fn empty(device: &Device, label: &str, bytes: u64, usage: BufferUsages) -> wgpu::Buffer {
    device.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes,
        usage,
        mapped_at_creation: false,
    })
}

pub(super) fn with_content(
    device: &Device,
    label: &str,
    content: &[u8],
    usage: BufferUsages,
) -> wgpu::Buffer {
    let buffer = empty(device, label, content.len() as u64, usage | BufferUsages::COPY_DST);
    device.queue.write_buffer(&buffer, 0, content);
    buffer
}

pub(super) fn resident<T: bytemuck::NoUninit>(device: &Device, label: &str, content: &[T]) -> wgpu::Buffer {
    with_content(device, label, bytemuck::cast_slice(content), BufferUsages::STORAGE)
}
