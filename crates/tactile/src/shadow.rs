//! Stage `shadow`: what a contact keeps from the light beside it.
//!
//! Taxim's algorithm (Si & Yuan 2022, section III.D, and its source): from the pixels around the core of the contact
//! fans of rays go out, downhill; along them a table says how dark the gel can be. Everything that Taxim counts in pixels
//! is a length on the gel here, so that a table serves any resolution; at Taxim's own it is the same pixels.

pub(crate) mod blur;
mod presses;
mod rays;
mod table;

pub use presses::{BallPress, shadow_from_presses};
pub use table::{ShadowKind, ShadowTable};

use crate::colour::ColourModel;
use crate::deform::{gaussian, half_gaussian};
use crate::grid::Plane;
use crate::simd::SimdLevel;
use blur::{Blur, Border, blur};
use rays::Rays;

/// Lengths in steps of a ray (1.25 px at Taxim's resolution): width of the rim around the core of a contact from which
/// rays go out (4 px), standard deviation of the blur of the shadows (2 px), size of the last blur (5 px).
const RIM_STEPS: f64 = 3.2;
const SIGMA_STEPS: f64 = 1.6;
const LAST_KERNEL_STEPS: f64 = 4.0;

/// A shadow table made ready for one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Shadow {
    table: ShadowTable,
    pub(crate) rays: Rays,
    /// Pixels around the core from which rays go out.
    pub(crate) rim_px: usize,
    /// The blur of the shadows, and with Taxim's colours the blur of the whole image.
    pub(crate) blurs: Vec<Blur>,
    /// With Taxim's colours and table: the background after the last blur, minus the frame at rest.
    pub(crate) base: Option<[Vec<f32>; 3]>,
}

/// The gel surface under a contact, all planes of one size.
#[derive(Debug, Clone, Copy)]
pub struct Relief<'a> {
    /// Height over the surface at rest, towards the camera, in pixels.
    pub raised_px: &'a Plane,
    /// Height over a plane: the same, on the shape that the gel has at rest.
    pub surface_px: &'a Plane,
    /// Slope of `surface_px` along x.
    pub along_x: &'a Plane,
    /// Slope of `surface_px` along y.
    pub along_y: &'a Plane,
    /// For each pixel 1 in the core of the contact, where the gel follows the part, and 0 elsewhere.
    pub core: &'a [u8],
}

impl Shadow {
    /// Lays a table out for pixels of a sensor `width_px` wide with the given colours.
    pub fn new(table: ShadowTable, metres_per_px: f64, width_px: usize, colour: &ColourModel) -> Self {
        let step_px = table.step_m / metres_per_px;
        let weights = half_gaussian(SIGMA_STEPS * step_px).into_iter().map(|w| w as f32).collect();
        let mut blurs = vec![Blur { weights, border: Border::EdgeTwice }];
        let mut base = None;
        if let (ShadowKind::Ceiling, Some(colour)) = (table.kind, colour.taxim()) {
            let half = ((LAST_KERNEL_STEPS * step_px - 1.0) / 2.0).round().clamp(0.0, 127.0) as usize;
            let weights = if half == 0 { vec![1.0] } else { gaussian(2 * half as u32 + 1)[half..].to_vec() };
            let last = Blur { weights, border: Border::EdgeOnce };
            base = Some([0, 1, 2].map(|c| {
                let (background, offset) = (&colour.background()[c], &colour.offset()[c]);
                let mut plane = background.clone();
                blur(&mut plane, width_px, std::slice::from_ref(&last), SimdLevel::Portable);
                // Minus the frame at rest, which is the background minus the offset.
                (0..plane.len()).map(|i| plane[i] - (background[i] - offset[i])).collect()
            }));
            blurs.push(last);
        }
        Self { rays: Rays::new(&table, metres_per_px), table, rim_px: rim_px(step_px), blurs, base }
    }

    /// The table.
    pub fn table(&self) -> &ShadowTable {
        &self.table
    }
}

/// Draws the shadows of a contact into the change of colour that [`shade`](crate::shade) gave, in grey levels.
///
/// With Taxim's colours and table this is Taxim's shadowed image: its image without background is lowered to the rays,
/// blurred, put on the background and blurred again. Otherwise only the darkening is blurred and added.
pub fn shadow(
    shadow: &Shadow,
    colour: &ColourModel,
    relief: &Relief<'_>,
    change: &mut [Plane; 3],
    level: SimdLevel,
) {
    let width = relief.surface_px.width;
    let rim = rim(relief.core, width, shadow.rim_px);
    let height = &relief.surface_px.values;
    let lowered = |pixels: &mut Vec<[f32; 4]>| shadow.rays.cast(relief, &rim, pixels);
    if let (Some(base), Some(colour)) = (&shadow.base, colour.taxim()) {
        for (plane, offset) in change.iter_mut().zip(colour.offset()) {
            for (value, offset) in plane.values.iter_mut().zip(offset) {
                *value -= offset;
            }
        }
        let mut pixels = interleaved(change, height);
        lowered(&mut pixels);
        for (channel, plane) in change.iter_mut().enumerate() {
            for (value, pixel) in plane.values.iter_mut().zip(&pixels) {
                *value = pixel[channel];
            }
            blur(&mut plane.values, width, &shadow.blurs, level);
            for (value, base) in plane.values.iter_mut().zip(&base[channel]) {
                *value += base;
            }
        }
        return;
    }
    let ceiling = shadow.table.kind == ShadowKind::Ceiling;
    let mut pixels = match shadow.table.kind {
        ShadowKind::Ceiling => interleaved(change, height),
        ShadowKind::Darkening => height.iter().map(|&z| [0.0, 0.0, 0.0, z]).collect(),
    };
    lowered(&mut pixels);
    let mut darkening = vec![0.0; height.len()];
    for (channel, plane) in change.iter_mut().enumerate() {
        for ((dark, pixel), value) in darkening.iter_mut().zip(&pixels).zip(&plane.values) {
            *dark = if ceiling { pixel[channel] - value } else { pixel[channel] };
        }
        blur(&mut darkening, width, &shadow.blurs, level);
        for (value, dark) in plane.values.iter_mut().zip(&darkening) {
            *value += dark;
        }
    }
}

fn interleaved(change: &[Plane; 3], height: &[f32]) -> Vec<[f32; 4]> {
    let [red, green, blue] = change.each_ref().map(|plane| &plane.values);
    let colours = red.iter().zip(green).zip(blue).zip(height);
    colours.map(|(((&r, &g), &b), &z)| [r, g, b, z]).collect()
}

/// Width of the rim in pixels for a step of the rays.
fn rim_px(step_px: f64) -> usize {
    ((RIM_STEPS * step_px).round() as usize).max(1)
}

/// Pixels within `reach` pixels of the core along both axes, and not in it (Taxim: two dilations by 5 x 5).
fn rim(core: &[u8], width: usize, reach: usize) -> Vec<u8> {
    let mut across = core.to_vec();
    for (out, row) in across.chunks_exact_mut(width).zip(core.chunks_exact(width)) {
        for k in 1..=reach.min(width - 1) {
            for (out, &core) in out[k..].iter_mut().zip(row) {
                *out |= core;
            }
            for (out, &core) in out.iter_mut().zip(&row[k..]) {
                *out |= core;
            }
        }
    }
    let mut rim = across.clone();
    for k in 1..=reach {
        let from = (k * width).min(core.len());
        for (out, &core) in rim[from..].iter_mut().zip(&across) {
            *out |= core;
        }
        for (out, &core) in rim.iter_mut().zip(&across[from..]) {
            *out |= core;
        }
    }
    for (out, &core) in rim.iter_mut().zip(core) {
        *out &= !core;
    }
    rim
}

/// Blurs a plane with symmetric weights, borders mirrored without repeating the edge (OpenCV).
pub(crate) fn blur_once(plane: &mut [f32], width: usize, weights: &[f32]) {
    let weights = weights[weights.len() / 2..].to_vec();
    blur(plane, width, &[Blur { weights, border: Border::EdgeOnce }], SimdLevel::Portable);
}

#[cfg(test)]
mod tests;
