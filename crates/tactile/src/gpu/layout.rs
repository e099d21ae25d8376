//! What host and device share: the structs of `shaders/shared/layout.wgsl`, field by field. A test compares every
//! offset with naga's.

use bytemuck::{Pod, Zeroable};

/// One sensor with its gel.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Frame {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    pub(super) image_words: u32,
    pub(super) bins: u32,
    pub(super) thickness_px: f32,
    pub(super) reach_px: f32,
    pub(super) restore_depth_fraction: f32,
    pub(super) noise_red: f32,
    pub(super) noise_green: f32,
    pub(super) noise_blue: f32,
}

/// One image.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PressInput {
    pub(super) matrix: [i32; 9],
    pub(super) shift: [u32; 6],
    pub(super) fraction_bits: u32,
    pub(super) bound_px: i32,
    pub(super) wanted_px3: f32,
    pub(super) pixels_per_step: f32,
    pub(super) flags: u32,
    pub(super) key: [u32; 2],
}

/// [`PressInput::flags`]: a part is there.
pub(super) const HAS_PART: u32 = 1;
/// [`PressInput::flags`]: the image has noise.
pub(super) const HAS_NOISE: u32 = 2;

/// How a press ended.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Outcome {
    pub(super) status: u32,
    pub(super) press_px: f32,
    pub(super) available_px3: f32,
    pub(super) core_px: f32,
    pub(super) low_x: u32,
    pub(super) low_y: u32,
    pub(super) high_x: u32,
    pub(super) high_y: u32,
}

/// A piece of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cluster {
    pub(super) first_vertex: u32,
    pub(super) vertices: u32,
    pub(super) first_triangle: u32,
    pub(super) triangles: u32,
    pub(super) centre: [i32; 3],
    pub(super) half: [f32; 3],
}

/// The images that show one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Group {
    pub(super) first_image: u32,
    pub(super) clusters: u32,
}

/// Colours by regression.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Regression {
    pub(super) mm_per_px: f32,
    pub(super) slope_limit: f32,
    pub(super) height_limit_mm: f32,
    pub(super) cell_px: u32,
    pub(super) columns: [u32; 4],
    pub(super) rows: [u32; 4],
    pub(super) heights: [u32; 4],
    pub(super) half_way: [u32; 4],
    pub(super) differences: [u32; 4],
    pub(super) colours: [u32; 4],
    pub(super) means: u32,
    pub(super) image_floats: u32,
    pub(super) unused: [u32; 2],
}

/// A shadow table.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Shadows {
    pub(super) rim_px: u32,
    pub(super) heights: u32,
    pub(super) directions: u32,
    pub(super) held: u32,
    pub(super) first_px: f32,
    pub(super) per_px: f32,
}

/// One blur of shadows along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ShadowBlur {
    pub(super) radius: i32,
    pub(super) edge_once: u32,
    pub(super) down: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::source;
    use std::mem::offset_of;
    use wgpu::naga;

    /// Name and offset of each member of a WGSL struct, and the distance of two of them in an array.
    fn in_wgsl(name: &str) -> (Vec<(String, u32)>, u32) {
        let module = naga::front::wgsl::parse_str(&source::raster(source::Sampling::Centres)).unwrap();
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap().1;
        let naga::TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
        (members.iter().map(|m| (m.name.clone().unwrap(), m.offset)).collect(), *span)
    }

    macro_rules! compare {
        ($type:ty, $($field:ident),*) => {
            let ours = [$((stringify!($field).to_string(), offset_of!($type, $field) as u32)),*];
            let (members, span) = in_wgsl(stringify!($type));
            assert_eq!(members, ours);
            assert_eq!(span as usize, size_of::<$type>());
        };
    }

    #[test]
    fn structs_have_the_offsets_that_naga_gives_them() {
        compare!(
            Frame,
            width_px,
            height_px,
            image_words,
            bins,
            thickness_px,
            reach_px,
            restore_depth_fraction,
            noise_red,
            noise_green,
            noise_blue
        );
        compare!(PressInput, matrix, shift, fraction_bits, bound_px, wanted_px3, pixels_per_step, flags, key);
        compare!(Outcome, status, press_px, available_px3, core_px, low_x, low_y, high_x, high_y);
        compare!(Cluster, first_vertex, vertices, first_triangle, triangles, centre, half);
        compare!(Group, first_image, clusters);
        compare!(Shadows, rim_px, heights, directions, held, first_px, per_px);
        compare!(ShadowBlur, radius, edge_once, down);
        compare!(
            Regression,
            mm_per_px,
            slope_limit,
            height_limit_mm,
            cell_px,
            columns,
            rows,
            heights,
            half_way,
            differences,
            colours,
            means,
            image_floats,
            unused
        );
    }
}
