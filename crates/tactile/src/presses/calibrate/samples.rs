//! Pixels of a press and what the regressor sees there.

use super::super::contact::Marked;
use super::super::{Contact, Press, drawn};
use crate::colour::regressor::{
    AROUND_FITTED, NEAR, Place, between_cells, cell_px, fitted_surroundings, limited_normal, near_terms,
};
use crate::deform::{Core, deform_with, gaussian};
use crate::gradient::gradient;
use crate::grid::{Grid, Plane};
use crate::sensor::{GelShape, Pyramid};
use crate::simd::SimdLevel;

/// Inputs of a pixel: the terms of the displaced gel, then the features of its surroundings.
pub(super) const INPUTS: usize = NEAR + AROUND_FITTED.len();

/// Zones around the contact: distance from its rim up to which they reach, the pixels drawn from them, and how much a square
/// millimetre counts.
const ZONES_MM: [(f64, usize, f64); 3] = [(0.8, 3000, 3.0), (4.2, 2500, 1.0), (f64::INFINITY, 600, 0.1)];

/// A gel to fit: its shape at rest and its deformation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GelModel {
    pub(super) shape: GelShape,
    pub(super) pyramid: Pyramid,
}

impl GelModel {
    /// Height of the gel surface around a press, above its rest state.
    pub(super) fn surface(&self, contact: &Contact, ball_m: f64, grid: &Grid) -> Plane {
        let Pyramid { kernels_px, restore_depth_fraction, sink_in_fraction, follow } = &self.pyramid;
        let imprint = contact.imprint(ball_m, grid, &self.shape, *sink_in_fraction);
        let from_px = restore_depth_fraction * imprint.press_depth_m / grid.metres_per_px;
        let core = Core { from_px, follow: *follow, whole_pixels: false };
        let kernels: Vec<Vec<f32>> = kernels_px.iter().map(|&k| gaussian(k)).collect();
        deform_with(&imprint, core, &kernels, None, SimdLevel::best())
    }
}

/// Chosen pixels of one press.
pub(super) struct Samples {
    /// Row by row from the top left.
    pub(super) pixels: Vec<usize>,
    /// Weight of each, so that a zone counts by its area and its weight.
    pub(super) weights: Vec<f32>,
    /// [`INPUTS`] numbers for each pixel.
    pub(super) inputs: Vec<f32>,
    /// Position of each pixel, as the regressor measures it.
    pub(super) places: Vec<[f32; 2]>,
    /// Largest sine of the slope in the whole image.
    pub(super) steepest: f32,
    /// Largest magnitude of each feature of the surroundings in the whole image.
    pub(super) largest: Vec<f32>,
}

impl Samples {
    /// Draws pixels of press number `index`; the same ones each time.
    pub(super) fn draw(
        index: usize,
        (press, contact): &Marked<'_>,
        ball_m: f64,
        grid: &Grid,
        gel: &GelModel,
    ) -> Self {
        let (pixels, weights) = choose(index as u64, press, contact, grid);
        let surface = gel.surface(contact, ball_m, grid);
        let (along_x, along_y) = gradient(&surface);
        let mm_per_px = grid.metres_per_px * 1e3;
        let around = fitted_surroundings(&surface, mm_per_px);
        let cell = cell_px(mm_per_px);
        let place = Place::in_grid(grid);
        let mut inputs = Vec::with_capacity(pixels.len() * INPUTS);
        let mut places = Vec::with_capacity(pixels.len());
        for &pixel in &pixels {
            let (x, y) = (pixel % grid.width_px, pixel / grid.width_px);
            let [nx, ny] = limited_normal(along_x.values[pixel], along_y.values[pixel], 1.0);
            let height_mm = surface.values[pixel] * mm_per_px as f32;
            inputs.extend(near_terms(&[nx], &[ny], &[height_mm]).map(|[term]| term));
            let columns = between_cells(x, cell, around[0].width);
            let rows = between_cells(y, cell, around[0].height);
            inputs.extend(around.iter().map(|plane| between(plane, columns, rows)));
            places.push([place.u(x as f32), place.v(y as f32)]);
        }
        let slope = along_x.values.iter().zip(&along_y.values).map(|(&gx, &gy)| {
            let [nx, ny] = limited_normal(gx, gy, 1.0);
            nx * nx + ny * ny
        });
        let steepest = slope.fold(0.0, f32::max).sqrt();
        let largest = around.iter().map(magnitude).collect();
        Self { pixels, weights, inputs, places, steepest, largest }
    }

    /// Colour of each pixel against a rest frame.
    pub(super) fn targets(&self, press: &Press, rest: &[Vec<f32>; 3]) -> Vec<[f32; 3]> {
        let change = |p: usize, c: usize| f32::from(press.image.rgb[3 * p + c]) - rest[c][p];
        self.pixels.iter().map(|&p| [change(p, 0), change(p, 1), change(p, 2)]).collect()
    }
}

fn magnitude(plane: &Plane) -> f32 {
    plane.values.iter().fold(0.0, |m, v| v.abs().max(m))
}

fn between(plane: &Plane, (x0, x1, wx): (usize, usize, f32), (y0, y1, wy): (usize, usize, f32)) -> f32 {
    let row = |y: usize| plane.at(x0, y) + wx * (plane.at(x1, y) - plane.at(x0, y));
    row(y0) + wy * (row(y1) - row(y0))
}

/// Pixels of each zone that no dot of the gel hides.
fn choose(index: u64, press: &Press, contact: &Contact, grid: &Grid) -> (Vec<usize>, Vec<f32>) {
    let mm_per_px = grid.metres_per_px * 1e3;
    let mut zones = [const { Vec::new() }; ZONES_MM.len()];
    for pixel in (0..grid.len()).filter(|&pixel| !press.hides(pixel)) {
        let mm = contact.beyond_rim_px(pixel, grid.width_px) * mm_per_px;
        let zone = ZONES_MM.iter().position(|&(up_to, _, _)| mm < up_to).unwrap_or(ZONES_MM.len() - 1);
        zones[zone].push(pixel);
    }
    let mut state = index.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1);
    let (mut pixels, mut weights) = (Vec::new(), Vec::new());
    for (zone, (_, wanted, weight)) in zones.into_iter().zip(ZONES_MM) {
        let area_mm2 = zone.len() as f64 * mm_per_px * mm_per_px;
        let zone = drawn(zone, wanted, &mut state);
        let n = zone.len();
        weights.extend(std::iter::repeat_n((weight * area_mm2) as f32 / n.max(1) as f32, n));
        pixels.extend(zone);
    }
    (pixels, weights)
}
