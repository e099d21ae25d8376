//! `_core.dots`: where the dots of a gel are in an image.

use gripgen::tactile::{find_dots, follow_dots};
use numpy::{PyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

/// Centres (N, 2) of the dots in an image (H, W, 3), or of those that belong to the centres at rest; NaN where one is not seen.
#[pyfunction]
#[pyo3(signature = (image, rest = None))]
pub fn dots<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    rest: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let pixels = image.as_array();
    let (height_px, width_px, _) = pixels.dim();
    let levels = [0, 1, 2].map(|c| pixels.slice(numpy::ndarray::s![.., .., c]).iter().copied().collect());
    let rest_px: Option<Vec<[f64; 2]>> =
        rest.map(|rest| rest.as_array().outer_iter().map(|at| [at[0], at[1]]).collect());
    let centres: Vec<[f64; 2]> = py.detach(|| {
        let found = find_dots(&levels, width_px, height_px);
        match rest_px {
            None => found.iter().map(|dot| dot.centre_px).collect(),
            Some(rest_px) => follow_dots(&found, &rest_px)
                .into_iter()
                .map(|dot| dot.map_or([f64::NAN; 2], |i| found[i].centre_px))
                .collect(),
        }
    });
    let count = centres.len();
    PyArray::from_vec(py, centres.into_flattened()).reshape([count, 2])
}
