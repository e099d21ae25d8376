//! Errors as Python exceptions: the Rust message, and what to do about it as `hint`.

use crate::hints;
use gripgen::record::DatasetError;
use gripgen::twin::config::ConfigError as KeyError;
use gripgen::{LoadError, SampleError, SweepError};
use gripgen_cli::Failure;
use gripgen_measured::OpenDatasetError;
use pyo3::PyTypeInfo;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    gripgen._core,
    GripgenError,
    PyException,
    "What gripgen could not do; `hint` says what to do about it."
);
create_exception!(
    gripgen._core,
    ConfigError,
    GripgenError,
    "A configuration, a key or an argument that cannot be."
);
create_exception!(
    gripgen._core,
    DataError,
    GripgenError,
    "Data that cannot be read; the message names the file."
);

/// An exception with a hint, in the words of Python.
fn with_hint<E: PyTypeInfo>(py: Python<'_>, message: &str, hint: Option<&str>) -> PyErr {
    let hint = hint.map(hints::in_python);
    let text = match &hint {
        Some(hint) => format!("{message}\nhint: {hint}"),
        None => message.to_string(),
    };
    let error = PyErr::from_type(E::type_object(py), text);
    // An exception without its attribute is still the right exception.
    let _ = error.value(py).setattr("hint", hint);
    error
}

/// What the command line says.
pub fn failure(py: Python<'_>, e: &Failure) -> PyErr {
    match e.exit_code() {
        2 => with_hint::<ConfigError>(py, &e.message(), e.what_to_do()),
        _ => with_hint::<GripgenError>(py, &e.message(), e.what_to_do()),
    }
}

pub fn load(py: Python<'_>, e: LoadError) -> PyErr {
    failure_as::<ConfigError>(py, &e.into())
}

pub fn config(py: Python<'_>, e: KeyError) -> PyErr {
    failure_as::<ConfigError>(py, &e.into())
}

pub fn sweep(py: Python<'_>, e: SweepError) -> PyErr {
    failure(py, &e.into())
}

pub fn sample(py: Python<'_>, e: SampleError) -> PyErr {
    match e {
        SampleError::Config(e) => config(py, e),
        other => with_hint::<GripgenError>(py, &other.to_string(), None),
    }
}

/// A dataset that cannot be opened.
pub fn open(py: Python<'_>, e: &OpenDatasetError) -> PyErr {
    match e {
        OpenDatasetError::Dataset(e) => data(py, e),
        _ => with_hint::<DataError>(py, &e.to_string(), None),
    }
}

pub fn data(py: Python<'_>, e: &DatasetError) -> PyErr {
    with_hint::<DataError>(py, &e.to_string(), e.hint())
}

/// An error of the caller's arguments.
pub fn argument(py: Python<'_>, message: &str, hint: Option<&str>) -> PyErr {
    with_hint::<ConfigError>(py, message, hint)
}

/// Data that lack something.
pub fn missing(py: Python<'_>, message: &str, hint: Option<&str>) -> PyErr {
    with_hint::<DataError>(py, message, hint)
}

fn failure_as<E: PyTypeInfo>(py: Python<'_>, e: &Failure) -> PyErr {
    with_hint::<E>(py, &e.message(), e.what_to_do())
}
