//! Stage `deform`, one blur along one axis, with its weights written out.

mod tile;

use super::{Axis, Variant, common, readable, writable};
use crate::convolve::Follow;
use crate::deform::gaussian;
use std::fmt::Write;

/// Threads of a workgroup of the tiled blur.
const TILE_THREADS: u32 = 256;

/// How the threads of a blur share the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::gpu) struct BlurShape {
    /// Values along the blurred axis that a workgroup makes.
    pub(in crate::gpu) span: u32,
    /// Lines that it makes.
    pub(in crate::gpu) lines: u32,
}

/// How the core of a contact gets its height back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::gpu) enum Restored {
    /// In whole pixels.
    Whole,
    /// By the share of each pixel that belongs to it.
    Share(Follow),
}

/// One blur along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::gpu) struct Blur {
    pub(in crate::gpu) kernel_px: u32,
    pub(in crate::gpu) axis: Axis,
    /// Whether and how the core of the contact gets its height back afterwards.
    pub(in crate::gpu) restore: Option<Restored>,
    /// Whether the gel is not flat at rest, so that a blur moves it: added to the core, or to all after the last blur.
    pub(in crate::gpu) lifted: bool,
    /// How far the blurs up to this one carry a value, along x and y: beyond it around the contact there is nothing to sum.
    pub(in crate::gpu) reach_px: [u32; 2],
}

/// Lanes and values per thread of the tiled blur, as large as the workgroup memory allows; `None` if none does.
fn tile_of(kernel_px: u32, workgroup_bytes: u32) -> Option<(u32, u32)> {
    [(32, 8), (32, 4), (16, 4), (16, 2), (8, 2), (8, 1), (4, 1)].into_iter().find(|&(lanes, run)| {
        let length = TILE_THREADS / lanes * run + kernel_px - 1;
        length * (lanes + 1) * 4 <= workgroup_bytes
    })
}

/// Stage `deform`, one blur; `None` if the workgroup memory holds no tile of it.
pub(in crate::gpu) fn blur(
    variant: Variant,
    blur: Blur,
    workgroup_bytes: u32,
) -> Option<(String, BlurShape)> {
    let weights = gaussian(blur.kernel_px);
    let planes = [
        readable(variant, "source", 2),
        writable(variant, "blurred", 3),
        match blur.restore {
            Some(Restored::Whole) => readable(variant, "contact", 4),
            Some(Restored::Share(_)) => readable(variant, "core", 4) + &readable(variant, "share", 6),
            None => String::new(),
        },
        match blur.lifted {
            true => "@group(0) @binding(5) var<storage, read> lift: array<f32>;\n".into(),
            false => String::new(),
        },
    ]
    .concat();
    let (size, lines, from_x, from_y) = match blur.axis {
        Axis::X => ("i32(frame.width_px)", "i32(frame.height_px)", "u32(place)", "u32(line)"),
        Axis::Y => ("i32(frame.height_px)", "i32(frame.width_px)", "u32(line)", "u32(place)"),
    };
    let mut restore = String::new();
    if blur.lifted {
        // On a gel that is not flat: how far the blurs so far have lifted or lowered it.
        restore += "let lift_px = lift[y * frame.width_px + x];\n";
    }
    restore += &match (blur.restore, blur.lifted) {
        (Some(Restored::Whole), lifted) => {
            let core = if lifted { "depth + lift_px" } else { "depth" };
            format!("if depth > outcomes[image].core_px {{ value = {core}; }}")
        }
        (Some(Restored::Share(follow)), lifted) => {
            let core = if lifted { "depth + lift_px" } else { "depth" };
            let core = match follow {
                Follow::Exactly => core.into(),
                Follow::AtLeast => format!("max(value, {core})"),
            };
            format!("if outcomes[image].press_px > 0.0 {{ value = fma(share, {core} - value, value); }}")
        }
        // Keeps the binding in use, so that all blurs have the same layout.
        (None, lifted) => {
            format!("value += 0.0 * outcomes[image].core_px{};", if lifted { " + lift_px" } else { "" })
        }
    };
    let (source, run, shape) = match variant {
        Variant::Texture { run } => {
            // Threads of a group lie side by side along a row of pixels.
            let (workgroup, lines) = match blur.axis {
                Axis::X => ("4, 16, 1", 16),
                Axis::Y => ("64, 1, 1", 64),
            };
            let (axis, across, span) = match blur.axis {
                Axis::X => ("x", "y", 4 * run),
                Axis::Y => ("y", "x", run),
            };
            let source = include_str!("../../../shaders/deform_texture.wgsl")
                .replace("/*WORKGROUP*/", workgroup)
                .replace("/*AXIS*/", axis)
                .replace("/*ACROSS*/", across);
            let depth = match blur.restore {
                Some(Restored::Whole) => "let depth = load_contact(x, y, image);",
                Some(Restored::Share(_)) => {
                    "let depth = load_core(x, y, image);\n    let share = load_share(x, y, image);"
                }
                None => "",
            };
            let source = source.replace("/*DEPTH*/", depth);
            (source, run, BlurShape { span, lines })
        }
        Variant::Tile => {
            let (lanes, run) = tile_of(blur.kernel_px, workgroup_bytes)?;
            let body = match blur.axis {
                Axis::X => include_str!("../../../shaders/deform_tile_across.wgsl"),
                Axis::Y => include_str!("../../../shaders/deform_tile_down.wgsl"),
            };
            let source = [include_str!("../../../shaders/shared/deform_tile.wgsl"), body]
                .concat()
                .replace("/*LANES*/", &lanes.to_string())
                .replace("/*LOADS*/", &tile::loads(blur, lanes, run))
                .replace("/*EXCHANGE*/", &tile::exchange(run))
                .replace("/*FINISH*/", &tile::finish(blur, lanes, run))
                .replace("/*REACH_X*/", &blur.reach_px[0].to_string())
                .replace("/*REACH_Y*/", &blur.reach_px[1].to_string());
            (source, run, BlurShape { span: TILE_THREADS / lanes * run, lines: lanes })
        }
    };
    let source = common(&source)
        .replace("/*RUN*/", &run.to_string())
        .replace("/*HALF*/", &(weights.len() / 2).to_string())
        .replace("//#PLANES", &planes)
        .replace("/*RESTORE*/", &restore)
        .replace("/*SIZE*/", size)
        .replace("/*LINES*/", lines)
        .replace("/*FROM_X*/", from_x)
        .replace("/*FROM_Y*/", from_y)
        .replace("/*SUMS*/", &sums(&weights, run, variant))
        .replace("/*FINISH*/", &finish(run));
    Some((source, shape))
}

/// The weighted sums of `run` neighbouring values: each input is read once. A tile that nothing reaches keeps zeros.
fn sums(weights: &[f32], run: u32, variant: Variant) -> String {
    let run = run as usize;
    let mut text = String::new();
    for r in 0..run {
        let _ = writeln!(text, "var s{r} = 0.0;");
    }
    let tiled = variant == Variant::Tile;
    if tiled {
        text += "    if touched {\n";
    }
    for i in 0..weights.len() + run - 1 {
        let value = match tiled {
            true => format!("tile[base + {i}u * PITCH]"),
            false => format!("at(first + {i} - HALF, line, image)"),
        };
        let _ = writeln!(text, "    let v{i} = {value};");
        for r in 0..run {
            if let Some(weight) = i.checked_sub(r).and_then(|k| weights.get(k)) {
                let _ = writeln!(text, "    s{r} = fma({weight:e}f, v{i}, s{r});");
            }
        }
    }
    if tiled {
        text += "    }\n";
    }
    text
}

/// What becomes of the sums of a thread of a software adapter.
fn finish(run: u32) -> String {
    (0..run).fold(String::new(), |mut text, r| {
        let _ = writeln!(text, "    finish(first + {r}, line, image, s{r});");
        text
    })
}
