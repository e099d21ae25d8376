//! Colours by regression on the device: limits, coefficients, and the passes over the surroundings of a pixel. CPU twin:
//! src/colour/regressor.rs.

use super::GpuError;
use super::buffers::{Pass, Planes, bind_at, empty, with_content};
use super::colour::Colours;
use super::device::Device;
use super::pipelines::Pipelines;
use super::source::{Axis, Step};
use wgpu::BufferUsages;

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
            let stage = pipelines.around(device, step)?;
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
