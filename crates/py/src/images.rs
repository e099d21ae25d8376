//! What is read off images: `_core.dots`, `_core.imprint_volumes_mm3`.

use crate::error;
use gripgen::Location;
use gripgen::tactile::{SimdLevel, VolumeReader, find_dots, follow_dots};
use gripgen::twin::TactileImage;
use gripgen_cli::{Failure, load_sensor};
use numpy::{
    PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArray4,
};
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

/// Volumes of the imprints in images (N, H, W, 3) of a sensor, in mm3; `rest` is one frame without contact, that of the sensor file without it.
#[pyfunction]
#[pyo3(signature = (images, sensor, rest = None))]
pub fn imprint_volumes_mm3<'py>(
    py: Python<'py>,
    images: PyReadonlyArray4<'py, u8>,
    sensor: &str,
    rest: Option<PyReadonlyArray3<'py, u8>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let frame = |pixels: numpy::ndarray::ArrayView3<'_, u8>| {
        let (height, width, _) = pixels.dim();
        let rgb = pixels.iter().copied().collect();
        TactileImage { width_px: width as u32, height_px: height as u32, rgb }
    };
    let images: Vec<TactileImage> = images.as_array().outer_iter().map(frame).collect();
    let rest = rest.map(|rest| frame(rest.as_array()));
    let volumes = py.detach(|| {
        let sensor = load_sensor(&Location::parse(sensor))?;
        let reader = VolumeReader::of_sensor(&sensor, SimdLevel::best()).map_err(Failure::usage)?;
        let volume = |image| reader.volume_m3(image, rest.as_ref()).map(|volume| volume * 1e9);
        images.iter().map(volume).collect::<Result<Vec<f64>, _>>().map_err(Failure::usage)
    });
    Ok(PyArray::from_vec(py, volumes.map_err(|e| error::failure(py, &e))?))
}
