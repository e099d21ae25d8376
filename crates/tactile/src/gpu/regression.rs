//! Colours by regression on the device: limits, coefficients, and the passes over the surroundings of a pixel. CPU twin:
//! src/colour/regressor.rs.

use super::GpuError;
use super::buffers::{Pass, Planes, bind_at, empty, with_content};
use super::colour::Colours;
use super::device::Device;
use super::layout::Regression;
use super::pipelines::{Key, Pipelines};
use super::source::{Axis, Step};
use crate::colour::Regressor;
use crate::colour::regressor::{AROUND_FIELD, AROUND_HEIGHTS, NEAR, NEAR_FIELD, SURROUNDINGS, cell_px};
use crate::grid::Grid;
use wgpu::BufferUsages;

/// Levels of the pyramid, the finest first.
pub(super) const LEVELS: usize = AROUND_HEIGHTS.len();

/// Limits of a model, and the places of its planes on cells for images of this size.
pub(super) fn regression(model: &Regressor, grid: &Grid) -> Regression {
    let cell_px = cell_px(model.mm_per_px);
    let (mut columns, mut rows) = ([0u32; LEVELS], [0u32; LEVELS]);
    let (mut w, mut h) = (grid.width_px.div_ceil(cell_px), grid.height_px.div_ceil(cell_px));
    for level in 0..LEVELS {
        (columns[level], rows[level]) = (w as u32, h as u32);
        (w, h) = (w.div_ceil(2), h.div_ceil(2));
    }
    let mut end = 0;
    let mut room = |level: usize, planes: u32| {
        let start = end;
        end += planes * columns[level] * rows[level];
        start
    };
    let derivatives = (SURROUNDINGS / LEVELS) as u32;
    let all: [usize; LEVELS] = std::array::from_fn(|level| level);
    Regression {
        mm_per_px: model.mm_per_px as f32,
        slope_limit: model.slope_limit,
        height_limit_mm: model.height_limit_mm,
        cell_px: cell_px as u32,
        columns,
        rows,
        heights: all.map(|level| room(level, 1)),
        half_way: all.map(|level| room(level, 1)),
        differences: all.map(|level| room(level, if level > 1 { derivatives } else { 0 })),
        colours: all.map(|level| room(level, if level < 2 { 3 } else { 0 })),
        means: room(0, 1),
        image_floats: end,
        unused: [0; 2],
    }
}

/// Coefficients of displaced pixels as `shade_regressor.wgsl` reads them: red, green, blue and 0 for each term and
/// monomial.
pub(super) fn near_coefficients(model: &Regressor) -> Vec<f32> {
    let (n, a) = (NEAR * NEAR_FIELD, &model.near);
    (0..n).flat_map(|i| [a[i], a[n + i], a[2 * n + i], 0.0]).collect()
}

/// Those of the surroundings as `regressor_pyramid.wgsl` reads them: red, green, blue and the feature's limit.
pub(super) fn around_coefficients(model: &Regressor) -> Vec<f32> {
    let (n, a) = (SURROUNDINGS * AROUND_FIELD, &model.around);
    (0..n).flat_map(|i| [a[i], a[n + i], a[2 * n + i], model.around_limit[i / AROUND_FIELD]]).collect()
}

/// The steps of a batch, in order.
const STEPS: [Step; 13] = [
    Step::Average,
    Step::Smooth(0, Axis::X),
    Step::Smooth(0, Axis::Y),
    Step::Smooth(1, Axis::X),
    Step::Smooth(1, Axis::Y),
    Step::Smooth(2, Axis::X),
    Step::Smooth(2, Axis::Y),
    Step::Smooth(3, Axis::X),
    Step::Smooth(3, Axis::Y),
    Step::Differentiate(2),
    Step::Differentiate(3),
    Step::Coarse,
    Step::Fine,
];

/// The regression of one sensor with room for a batch.
pub(super) struct Around {
    pub(super) regression: wgpu::Buffer,
    pub(super) cells: wgpu::Buffer,
    pub(super) passes: Vec<Pass>,
}

impl Around {
    pub(super) fn new(
        device: &Device,
        pipelines: &Pipelines,
        colours: &Colours,
        frame: &wgpu::Buffer,
        surface: &Planes,
        batch: u64,
    ) -> Result<Option<Self>, GpuError> {
        let Some(shape) = colours.regression else { return Ok(None) };
        let regression =
            with_content(device, "regression", bytemuck::bytes_of(&shape), BufferUsages::UNIFORM);
        let around = bytemuck::cast_slice(&colours.around);
        let around = with_content(device, "surroundings", around, BufferUsages::UNIFORM);
        let cells = empty(device, "cells", 4 * batch * u64::from(shape.image_floats), BufferUsages::STORAGE);
        let mut passes = vec![];
        for step in STEPS {
            let stage = pipelines.get(device, Key::Around(step))?;
            // A binding that an entry point does not use is not in its layout.
            let lit = matches!(step, Step::Coarse | Step::Fine);
            let average = step == Step::Average;
            let bound = [
                (lit || average).then(|| (0, frame.as_entire_binding())),
                Some((1, regression.as_entire_binding())),
                Some((2, cells.as_entire_binding())),
                lit.then(|| (3, around.as_entire_binding())),
                average.then(|| (4, surface.binding())),
            ];
            let bound = bind_at(device, &stage, bound.into_iter().flatten());
            let level = step.level() as usize;
            let groups = [(shape.columns[level] * shape.rows[level]).div_ceil(64), 1];
            passes.push(Pass { stage, bound, groups });
        }
        Ok(Some(Self { regression, cells, passes }))
    }
}
