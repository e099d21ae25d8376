//! The Python module `gripgen._core`: numpy arrays in and out, everything else in the crates below.
//!
//! Work is done without the interpreter's lock. Arrays are handed over, not copied. The Python half of the package,
//! with its stubs (`_core.pyi`), is in `crates/py/python/gripgen`.

#![expect(clippy::needless_pass_by_value, reason = "arguments of functions for Python are owned")]

mod dataset;
mod error;
mod film;
mod hints;
mod images;
mod pulls;
mod render;
mod rig;
mod simulator;
mod stream;
mod sweep;
mod values;

use gripgen::VERSION;
use gripgen::physics::ArmModel;
use numpy::{PyArray, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use std::ffi::OsString;

/// Run the command line with these arguments (without the program's name) and return its exit code.
#[pyfunction]
fn run_cli(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let all = std::iter::once(OsString::from("gripgen")).chain(arguments);
    py.detach(|| gripgen_cli::run(all))
}

/// The same for a caller that wants exceptions instead of messages on standard error.
#[pyfunction]
fn run_verb(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<u8> {
    let all = std::iter::once(OsString::from("gripgen")).chain(arguments);
    py.detach(|| gripgen_cli::try_run(all)).map_err(|e| error::failure(py, &e))
}

/// Where the tool of a UR5e is in its base, float64[N, 3] in m, for joint angles float64[N, 6] in rad from base to tool.
#[pyfunction]
fn ur5e_tool_m<'py>(
    py: Python<'py>,
    joints_rad: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let urdf = gripgen::assets::read("robots/ur5e/ur5e.urdf").unwrap_or_default();
    let arm = ArmModel::from_urdf(&String::from_utf8_lossy(&urdf), "tool0", &|_| None)
        .map_err(|e| error::argument(py, &e.to_string(), None))?;
    let mut tool_m = Vec::new();
    for joints_rad in joints_rad.as_array().rows() {
        let at = arm.base_from_tip(&joints_rad.to_vec()).translation;
        tool_m.extend([at.x, at.y, at.z]);
    }
    let rows = tool_m.len() / 3;
    PyArray::from_vec(py, tool_m).reshape([rows, 3])
}

#[pymodule(gil_used = false)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", VERSION)?;
    let all_errors = module.py().get_type::<error::GripgenError>();
    // What is raised without a hint has the attribute too.
    all_errors.setattr("hint", module.py().None())?;
    module.add("GripgenError", all_errors)?;
    module.add("ConfigError", module.py().get_type::<error::ConfigError>())?;
    module.add("DataError", module.py().get_type::<error::DataError>())?;
    module.add_class::<dataset::Dataset>()?;
    module.add_class::<simulator::Simulator>()?;
    module.add_class::<stream::Stream>()?;
    module.add_class::<pulls::Pulls>()?;
    module.add_function(wrap_pyfunction!(run_cli, module)?)?;
    module.add_function(wrap_pyfunction!(run_verb, module)?)?;
    module.add_function(wrap_pyfunction!(ur5e_tool_m, module)?)?;
    module.add_function(wrap_pyfunction!(images::dots, module)?)?;
    module.add_function(wrap_pyfunction!(images::imprint_volumes_mm3, module)?)?;
    module.add_function(wrap_pyfunction!(render::render, module)?)?;
    module.add_function(wrap_pyfunction!(rig::rig_check, module)?)?;
    module.add_function(wrap_pyfunction!(rig::rig_rehearse, module)?)?;
    module.add_function(wrap_pyfunction!(rig::rig_pull, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::contact_sheet_shards, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::prepare_run, module)?)
}
