//! WGSL sources: files put together, with what a variant or a stage writes in.

mod blur;

pub(super) use blur::{Blur, BlurShape, Restored, blur};

use std::fmt::Write;

const GRADIENT: &str = include_str!("../../shaders/gradient.wgsl");

/// Length of the kernel that smooths a level of the surroundings.
const BINOMIAL_PX: usize = 17;

/// How planes are stored and blurs are made. Weights are literals in both: reading them from a buffer costs more than
/// the arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Variant {
    /// `r32float` texture arrays and many values per thread: 10 times faster than buffers on Mesa's lavapipe.
    Texture {
        /// Neighbouring values that a thread makes.
        run: u32,
    },
    /// Storage buffers, and a tile in workgroup memory: for graphics processors.
    Tile,
}

/// An axis of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Axis {
    X,
    Y,
}

/// A colour model that has a WGSL twin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Shade {
    Lambert,
    Taxim,
    Regressor,
}

/// What the values of a shadow table are to the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Ceiling {
    /// They are added.
    Added,
    /// They bound what any other colours than Taxim's change.
    Relative,
    /// They bound Taxim's image without its background.
    Taxim,
}

/// A step of the surroundings of colours by regression, with its level of the pyramid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Step {
    Average,
    Smooth(u32, Axis),
    Differentiate(u32),
    Coarse,
    Fine,
}

impl Step {
    /// The level on whose cells it works.
    pub(super) fn level(self) -> u32 {
        match self {
            Step::Average | Step::Fine => 0,
            Step::Coarse => 1,
            Step::Smooth(level, _) | Step::Differentiate(level) => level,
        }
    }

    pub(super) fn entry_point(self) -> &'static str {
        match self {
            Step::Average => "average",
            Step::Smooth(_, Axis::X) => "smooth_across",
            Step::Smooth(_, Axis::Y) => "smooth_down",
            Step::Differentiate(_) => "differentiate",
            Step::Coarse => "coarse",
            Step::Fine => "fine",
        }
    }
}

fn common(body: &str) -> String {
    [include_str!("../../shaders/shared/layout.wgsl"), body].concat()
}

/// A plane to read: `load_NAME(x, y, image)`.
fn readable(variant: Variant, name: &str, binding: u32) -> String {
    let at = format!("@group(0) @binding({binding}) var");
    match variant {
        Variant::Texture { .. } => format!(
            "{at} {name}: texture_2d_array<f32>;\n\
             fn load_{name}(x: u32, y: u32, image: u32) -> f32 {{\n    \
             return textureLoad({name}, vec2<u32>(x, y), image, 0).x;\n}}\n"
        ),
        Variant::Tile => format!(
            "{at}<storage, read> {name}: array<f32>;\n\
             fn load_{name}(x: u32, y: u32, image: u32) -> f32 {{\n    \
             return {name}[(image * frame.height_px + y) * frame.width_px + x];\n}}\n"
        ),
    }
}

/// A plane to write: `store_NAME(x, y, image, value)`.
fn writable(variant: Variant, name: &str, binding: u32) -> String {
    let at = format!("@group(0) @binding({binding}) var");
    match variant {
        Variant::Texture { .. } => format!(
            "{at} {name}: texture_storage_2d_array<r32float, write>;\n\
             fn store_{name}(x: u32, y: u32, image: u32, value: f32) {{\n    \
             textureStore({name}, vec2<u32>(x, y), image, vec4<f32>(value, 0.0, 0.0, 0.0));\n}}\n"
        ),
        Variant::Tile => format!(
            "{at}<storage, read_write> {name}: array<f32>;\n\
             fn store_{name}(x: u32, y: u32, image: u32, value: f32) {{\n    \
             {name}[(image * frame.height_px + y) * frame.width_px + x] = value;\n}}\n"
        ),
    }
}

/// What a stage looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Sampling {
    /// The centres of pixels.
    Centres,
    /// Nine points of each pixel beside a step.
    Points,
}

/// A source with pieces in it: what follows a line `//# NAME` in the file of pieces takes the place of `/*NAME*/`.
fn filled(source: &str, pieces: &str) -> String {
    pieces.split("//# ").skip(1).fold(source.to_string(), |source, piece| {
        let (name, text) = piece.split_once('\n').unwrap_or((piece, ""));
        source.replace(&format!("/*{name}*/"), text.trim_end())
    })
}

/// Stage `raster`: entry points `top` and `fill`.
pub(super) fn raster(sampling: Sampling) -> String {
    let pieces = match sampling {
        Sampling::Centres => include_str!("../../shaders/shared/raster_centres.wgsl"),
        Sampling::Points => include_str!("../../shaders/shared/raster_points.wgsl"),
    };
    common(&filled(include_str!("../../shaders/raster.wgsl"), pieces))
}

/// The pixels beside a step.
pub(super) fn steps(variant: Variant) -> String {
    common(include_str!("../../shaders/steps.wgsl")).replace("//#PLANES", &readable(variant, "contact", 4))
}

/// The core of the contact.
pub(super) fn core(variant: Variant) -> String {
    let planes =
        [readable(variant, "contact", 5), writable(variant, "core", 6), writable(variant, "share", 7)];
    common(include_str!("../../shaders/core.wgsl")).replace("//#PLANES", &planes.concat())
}

/// Stage `indent`.
pub(super) fn indent(variant: Variant, sampling: Sampling, threads: u32) -> String {
    let pieces = match sampling {
        Sampling::Centres => include_str!("../../shaders/shared/indent_centres.wgsl"),
        Sampling::Points => include_str!("../../shaders/shared/indent_points.wgsl"),
    };
    common(&filled(include_str!("../../shaders/indent.wgsl"), pieces))
        .replace("//#PLANES", &writable(variant, "contact", 4))
        .replace("/*THREADS*/", &threads.to_string())
}

/// The gel at rest: `whole_surface` and `slope_at_rest`.
fn gel(domed: bool) -> &'static str {
    match domed {
        true => include_str!("../../shaders/shared/domed.wgsl"),
        false => include_str!("../../shaders/shared/flat.wgsl"),
    }
}

/// Stages `gradient` and `shade`.
fn shading(shade: Shade, domed: bool) -> String {
    let shade = match shade {
        Shade::Lambert => include_str!("../../shaders/shade_lambert.wgsl"),
        Shade::Taxim => include_str!("../../shaders/shade_taxim.wgsl"),
        Shade::Regressor => concat!(
            include_str!("../../shaders/shade_regressor.wgsl"),
            include_str!("../../shaders/shared/field.wgsl")
        ),
    };
    [gel(domed), GRADIENT, shade].concat()
}

/// Stages `gradient`, `shade` and `noise`, on top of `shadows`.
pub(super) fn image(variant: Variant, shade: Shade, domed: bool, shadows: Option<Ceiling>) -> String {
    let changed = match shadows {
        None => include_str!("../../shaders/shared/unshadowed.wgsl").to_string(),
        Some(kind) => include_str!("../../shaders/shared/shadowed.wgsl")
            .replace("/*INSTEAD*/", if kind == Ceiling::Taxim { "true" } else { "false" }),
    };
    common(include_str!("../../shaders/image.wgsl")).replace("//#PLANES", &readable(variant, "surface", 6))
        + &shading(shade, domed)
        + &changed
        + include_str!("../../shaders/noise.wgsl")
}

/// Stage `shadow`, the rays.
pub(super) fn shadow_rays(variant: Variant, domed: bool) -> String {
    let planes = readable(variant, "surface", 6) + &readable(variant, "contact", 8);
    common(include_str!("../../shaders/shadow_rays.wgsl")).replace("//#PLANES", &planes)
        + gel(domed)
        + GRADIENT
}

/// Stage `shadow`, between rays and blurs.
pub(super) fn shadow_merge(variant: Variant, shade: Shade, domed: bool, kind: Ceiling) -> String {
    let (planes, unshadowed) = match kind {
        Ceiling::Added => (
            String::new(),
            "fn unshadowed(x: u32, y: u32, image: u32) -> vec3<f32> {\n    return vec3<f32>();\n}\n".into(),
        ),
        Ceiling::Relative | Ceiling::Taxim => (
            readable(variant, "surface", 6),
            shading(shade, domed)
                + "fn unshadowed(x: u32, y: u32, image: u32) -> vec3<f32> {\n    \
                   return shade(x, y, image, gradient(x, y, image));\n}\n",
        ),
    };
    common(include_str!("../../shaders/shadow_merge.wgsl"))
        .replace("//#PLANES", &planes)
        .replace("/*KIND*/", &(kind as u32).to_string())
        + &unshadowed
}

/// Stage `shadow`, a blur.
pub(super) fn shadow_blur() -> String {
    common(include_str!("../../shaders/shadow_blur.wgsl"))
}

/// The surroundings of colours by regression; a step is one of its entry points.
pub(super) fn around(variant: Variant, step: Step) -> String {
    // The binomial kernel of length 9 twice.
    let half = BINOMIAL_PX / 2;
    let mut weights = vec![1.0 / 65536.0];
    for k in 1..BINOMIAL_PX {
        weights.push(weights[k - 1] * (BINOMIAL_PX - k) as f64 / k as f64);
    }
    let sum = |value: &str| {
        weights.iter().enumerate().fold(String::new(), |mut text, (k, weight)| {
            let at = value.replace('#', &format!("{}", k as i32 - half as i32));
            let _ = writeln!(text, "    sum = fma({weight:e}f, {at}, sum);");
            text
        })
    };
    let across = sum("unsmoothed(mirrored(i32(at.x) + #, regression.columns[LEVEL]), at.y, id.z)");
    let down = sum("half_way(at.x, mirrored(i32(at.y) + #, regression.rows[LEVEL]), id.z)");
    let mut differences = String::new();
    for name in ["zx", "zy", "zxx", "zxy", "zyy", "zxxx", "zxxy", "zxyy", "zyyy"] {
        // x of zyy rather than y of zxy, as on the processor.
        let (from, axis) = match name {
            "zxyy" => ("zyy", "x"),
            _ => name.split_at(name.len() - 1),
        };
        let (after, before) =
            if axis == "x" { ("x + 1u, y", "x - 1u, y") } else { ("x, y + 1u", "x, y - 1u") };
        let _ = writeln!(
            differences,
            "fn {name}(x: u32, y: u32, image: u32) -> f32 {{\n    if !inner_{axis}({axis}) {{ return 0.0; }}\n    \
             return 0.5 * ({from}({after}, image) - {from}({before}, image));\n}}\n"
        );
    }
    common(include_str!("../../shaders/regressor_pyramid.wgsl"))
        .replace("/*LEVEL*/", &step.level().to_string())
        .replace("/*ACROSS*/", &across)
        .replace("/*DOWN*/", &down)
        .replace("/*DIFFERENCES*/", &differences)
        .replace("//#PLANES", &readable(variant, "surface", 4))
        + include_str!("../../shaders/shared/field.wgsl")
}
