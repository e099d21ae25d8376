//! `_core.render`: what a sensor sees of a mesh, or of a surface that is given by its heights.

use crate::error;
use gripgen::Location;
use gripgen::tactile::npz::Array;
use gripgen::tactile::presses::{MAX_EDGE_RADIUS_M, RenderedBody, USUAL_EDGE_RADIUS_M};
use gripgen::twin::usual_scale_mm_per_unit;
use gripgen_cli::Failure;
use gripgen_cli::{RenderOptions, load_sensor, render_file, render_surface};
use numpy::{PyArray, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// What is rendered.
#[derive(FromPyObject)]
pub enum Source<'py> {
    Heights(PyReadonlyArrayDyn<'py, f64>),
    File(PathBuf),
}

/// Press something in and look at it. Returns image, heights_mm, normals and contact.
#[pyfunction]
#[pyo3(signature = (source, sensor, depth_mm = None, x_px = None, y_px = None, rotation_deg = 0.0, scale_mm_per_unit = None, edge_radius_mm = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn render<'py>(
    py: Python<'py>,
    source: Source<'py>,
    sensor: &str,
    depth_mm: Option<f64>,
    x_px: Option<f64>,
    y_px: Option<f64>,
    rotation_deg: f64,
    scale_mm_per_unit: Option<f64>,
    edge_radius_mm: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let usual = || match &source {
        Source::File(path) => {
            usual_scale_mm_per_unit(&path.extension().unwrap_or_default().to_string_lossy())
        }
        Source::Heights(_) => 1.0,
    };
    let scale_mm_per_unit = scale_mm_per_unit.unwrap_or_else(usual);
    if !(scale_mm_per_unit > 0.0 && scale_mm_per_unit.is_finite()) {
        let what = format!("scale_mm_per_unit is {scale_mm_per_unit} mm, it must be more than 0");
        return Err(error::argument(py, &what, None));
    }
    let edge_radius_m = edge_radius_mm.map_or(USUAL_EDGE_RADIUS_M, |mm| mm * 1e-3);
    if !(0.0..=MAX_EDGE_RADIUS_M).contains(&edge_radius_m) {
        let what = format!(
            "edge_radius_mm is {} mm, it must be from 0 to {} mm",
            edge_radius_m * 1e3,
            MAX_EDGE_RADIUS_M * 1e3
        );
        return Err(error::argument(py, &what, None));
    }
    let options = RenderOptions {
        travel_m: depth_mm.map(|mm| mm * 1e-3),
        x_px,
        y_px,
        rotation_rad: rotation_deg.to_radians(),
        edge_radius_m,
        metres_per_unit: scale_mm_per_unit * 1e-3,
    };
    let source = match source {
        Source::Heights(heights) => {
            let values = heights.as_array().iter().copied().collect();
            Ok(Array { shape: heights.shape().to_vec(), values })
        }
        Source::File(path) => Err(path),
    };
    let rendered = py.detach(|| {
        let sensor = load_sensor(&Location::parse(sensor))?;
        let rendered = match source {
            Ok(heights) => render_surface(heights, &options, &sensor)?,
            Err(path) => render_file(&path, &options, &sensor)?,
        };
        Ok::<RenderedBody, Failure>(rendered)
    });
    dict_of(py, rendered.map_err(|e| error::failure(py, &e))?)
}

fn dict_of(py: Python<'_>, rendered: RenderedBody) -> PyResult<Bound<'_, PyDict>> {
    let RenderedBody { image, heights_mm, normals: [x, y, z], contact } = rendered;
    let (rows, columns) = (heights_mm.height, heights_mm.width);
    let normals: Vec<f32> =
        (0..rows * columns).flat_map(|p| [x.values[p], y.values[p], z.values[p]]).collect();
    let found = PyDict::new(py);
    found.set_item("image", PyArray::from_vec(py, image.rgb).reshape([rows, columns, 3])?)?;
    found.set_item("heights_mm", PyArray::from_vec(py, heights_mm.values).reshape([rows, columns])?)?;
    found.set_item("normals", PyArray::from_vec(py, normals).reshape([rows, columns, 3])?)?;
    found.set_item("contact", PyArray::from_vec(py, contact).reshape([rows, columns])?)?;
    Ok(found)
}
