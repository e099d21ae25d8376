//! The regressor of the colours as the device has it.

use super::layout::Regression;
use crate::colour::Regressor;
use crate::colour::regressor::{AROUND_FIELD, AROUND_HEIGHTS, NEAR, NEAR_FIELD, SURROUNDINGS, cell_px};
use crate::grid::Grid;

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
