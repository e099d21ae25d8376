//! What host and device share: the structs of `shaders/shared/layout.wgsl`, field by field. A test compares every
//! offset with naga's.

use bytemuck::{Pod, Zeroable};

/// Structs as they lie in the memory of the device, and what the test needs to know of them.
macro_rules! shared {
    ($($(#[$doc:meta])* $name:ident { $($field:ident: $type:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
            #[repr(C)]
            pub(super) struct $name {
                $(pub(super) $field: $type,)*
            }
        )*

        /// Name and size of each struct, name and offset of its fields.
        #[cfg(test)]
        const SHARED: &[(&str, usize, &[(&str, usize)])] = &[$((
            stringify!($name),
            size_of::<$name>(),
            &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
        ),)*];
    };
}

shared! {
    /// One sensor with its gel.
    Frame {
        width_px: u32,
        height_px: u32,
        image_words: u32,
        bins: u32,
        thickness_px: f32,
        reach_px: f32,
        restore_depth_fraction: f32,
        noise_red: f32,
        noise_green: f32,
        noise_blue: f32,
    }

    /// One image.
    PressInput {
        matrix: [i32; 9],
        shift: [u32; 6],
        fraction_bits: u32,
        bound_px: i32,
        wanted_px3: f32,
        pixels_per_step: f32,
        flags: u32,
        key: [u32; 2],
    }

    /// How a press ended.
    Outcome {
        status: u32,
        press_px: f32,
        available_px3: f32,
        core_px: f32,
        top_px: f32,
        low_x: u32,
        low_y: u32,
        high_x: u32,
        high_y: u32,
    }

    /// A piece of a mesh.
    Cluster {
        first_vertex: u32,
        vertices: u32,
        first_triangle: u32,
        triangles: u32,
        centre: [i32; 3],
        half: [f32; 3],
    }

    /// The images that show one mesh.
    Group {
        first_image: u32,
        clusters: u32,
    }

    /// Colours by regression.
    Regression {
        mm_per_px: f32,
        slope_limit: f32,
        height_limit_mm: f32,
        cell_px: u32,
        columns: [u32; 4],
        rows: [u32; 4],
        heights: [u32; 4],
        half_way: [u32; 4],
        differences: [u32; 4],
        colours: [u32; 4],
        means: u32,
        image_floats: u32,
        unused: [u32; 2],
    }

    /// A shadow table.
    Shadows {
        rim_px: u32,
        heights: u32,
        directions: u32,
        held: u32,
        first_px: f32,
        per_px: f32,
    }

    /// One blur of shadows along one axis.
    ShadowBlur {
        radius: i32,
        edge_once: u32,
        down: u32,
    }
}

/// [`PressInput::flags`]: a part is there.
pub(super) const HAS_PART: u32 = 1;
/// [`PressInput::flags`]: the image has noise.
pub(super) const HAS_NOISE: u32 = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::source;
    use wgpu::naga;

    #[test]
    fn structs_have_the_offsets_that_naga_gives_them() {
        let module = naga::front::wgsl::parse_str(&source::raster(source::Sampling::Centres)).unwrap();
        for (name, size, fields) in SHARED {
            let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(*name)).unwrap().1;
            let naga::TypeInner::Struct { members, span } = &found.inner else {
                panic!("{name} is no struct")
            };
            let members: Vec<(&str, usize)> =
                members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
            assert_eq!(members, *fields, "{name}");
            assert_eq!(*span as usize, *size, "{name}");
        }
    }
}
