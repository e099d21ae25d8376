//! Films of pulls as arrays.

use gripgen::record::Film;
use gripgen::twin::{CameraStamp, CellShear, ContactPatch, FilmFrame, SlipState};
use numpy::{PyArray, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A number of a cell.
type OfCell = fn(&CellShear) -> f32;

/// The arrays of `gripgen.Film`, by name.
pub(crate) fn arrays<'py>(py: Python<'py>, film: &Film) -> PyResult<Bound<'py, PyDict>> {
    const CELLS: usize = ContactPatch::MAX_CELLS;
    let found = PyDict::new(py);
    let frames = film.frames.len();
    let Some(first) = film.frames.first() else { return Ok(found) };
    let (width, height) = (first.left.image.width_px as usize, first.left.image.height_px as usize);
    // Left jaw first, as everywhere.
    let all = || film.frames.iter().flat_map(|both| [&both.left, &both.right]);
    let pixels = 2 * frames * height * width;
    let mut images: Vec<u8> = Vec::with_capacity(3 * pixels);
    all().for_each(|f| images.extend_from_slice(&f.image.rgb));
    found.set_item("images", PyArray::from_vec(py, images).reshape([frames, 2, height, width, 3])?)?;
    let mut cells: Vec<u8> = Vec::with_capacity(pixels);
    all().for_each(|f| cells.extend_from_slice(&f.cell_of_px));
    found.set_item("cells", PyArray::from_vec(py, cells).reshape([frames, 2, height, width])?)?;
    let mut depth: Vec<f32> = Vec::with_capacity(pixels);
    all().for_each(|f| depth.extend(f.depth_um.iter().map(|&um| f32::from(um) * 1e-3)));
    found.set_item("depth_mm", PyArray::from_vec(py, depth).reshape([frames, 2, height, width])?)?;
    let state = |f: &FilmFrame| match f.state() {
        Some(SlipState::Stick) => 0_u8,
        Some(SlipState::Incipient) => 1,
        Some(SlipState::Slip) => 2,
        None => u8::MAX,
    };
    let of_camera = |of: fn(&CameraStamp) -> Option<f64>| -> Vec<f64> {
        all().map(|f| f.camera.as_ref().and_then(of).unwrap_or(f64::NAN)).collect()
    };
    let stamps = [
        ("received_s", of_camera(|stamp| Some(stamp.received_s))),
        ("device_time_s", of_camera(|stamp| stamp.device_time_s)),
    ];
    for (name, values) in stamps {
        found.set_item(name, PyArray::from_vec(py, values).reshape([frames, 2])?)?;
    }
    found.set_item("state", PyArray::from_vec(py, all().map(state).collect()).reshape([frames, 2])?)?;
    let of_cells = |of: OfCell| -> Vec<f32> {
        all()
            .flat_map(|f| (0..CELLS).map(|i| f.cells.get(i).map_or(f32::NAN, of)).collect::<Vec<_>>())
            .collect()
    };
    let columns: [(&str, OfCell); 3] = [
        ("cell_shear_mm", |c| (c.shear_m * 1e3) as f32),
        ("cell_slip_mm", |c| (c.slip_m * 1e3) as f32),
        ("cell_force_n", |c| c.force_n as f32),
    ];
    for (name, of) in columns {
        found.set_item(name, PyArray::from_vec(py, of_cells(of)).reshape([frames, 2, CELLS])?)?;
    }
    let slipped = of_cells(|c| f32::from(u8::from(c.slipped))).into_iter().map(|v| v == 1.0).collect();
    found.set_item("cell_slipped", PyArray::from_vec(py, slipped).reshape([frames, 2, CELLS])?)?;
    let markers = all().map(|f| f.markers_px.len()).max().unwrap_or(0);
    let places: Vec<f32> = all()
        .flat_map(|f| {
            (0..markers).flat_map(|i| f.markers_px.get(i).map_or([f32::NAN; 2], |m| m.map(|x| x as f32)))
        })
        .collect();
    found.set_item("markers_px", PyArray::from_vec(py, places).reshape([frames, 2, markers, 2])?)?;
    let pull: Vec<f64> = all().flat_map(|f| f.pull_px).collect();
    found.set_item("pull_px", PyArray::from_vec(py, pull).reshape([frames, 2, 2])?)?;
    let of_both =
        |of: fn(&FilmFrame) -> f64| film.frames.iter().map(|both| of(&both.left)).collect::<Vec<_>>();
    found.set_item("time_s", PyArray1::from_vec(py, of_both(|f| f.time_s)))?;
    found.set_item("contact_force_n", PyArray1::from_vec(py, of_both(|f| f.contact_force_n)))?;
    found.set_item("displacement_mm", PyArray1::from_vec(py, of_both(|f| f.displacement_m * 1e3)))?;
    found.set_item("incipient_slip_s", film.incipient_slip_s)?;
    found.set_item("whole_slip_s", film.whole_slip_s)?;
    Ok(found)
}
