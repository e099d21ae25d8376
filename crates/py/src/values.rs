//! Values of configuration keys from Python.

use crate::error;
use gripgen::twin::draw::Drawn;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use std::collections::BTreeMap;

/// Keys and numbers or words, as a sweep draws them.
pub fn drawn(py: Python<'_>, values: &Bound<'_, PyDict>) -> PyResult<BTreeMap<String, Drawn>> {
    let mut found = BTreeMap::new();
    for (key, value) in values.iter() {
        let key: String = key.extract()?;
        let value = if let Ok(text) = value.cast::<PyString>() {
            Drawn::Text(text.to_string())
        } else if let Ok(number) = value.extract::<f64>() {
            Drawn::Number(number)
        } else {
            let what = format!("{key} = {}: neither a number nor a word", value.repr()?);
            return Err(error::argument(py, &what, None));
        };
        found.insert(key, value);
    }
    Ok(found)
}

/// Overrides `key=value` as on the command line: a string is taken as TOML if it is TOML, else as a word.
pub fn overrides(values: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, String)>> {
    let Some(values) = values else { return Ok(Vec::new()) };
    values.iter().map(|(key, value)| Ok((key.extract()?, toml_of(&value)?))).collect()
}

fn toml_of(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(flag.is_true().to_string());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(text.to_string());
    }
    if let Ok(whole) = value.extract::<i64>() {
        return Ok(whole.to_string());
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(format!("{number:?}"));
    }
    let quoted = |v: &Bound<'_, PyAny>| -> PyResult<String> {
        Ok(if v.cast::<PyString>().is_ok() { format!("{:?}", v.to_string()) } else { toml_of(v)? })
    };
    if let Ok(table) = value.cast::<PyDict>() {
        let entries: PyResult<Vec<String>> =
            table.iter().map(|(k, v)| Ok(format!("{:?} = {}", k.to_string(), quoted(&v)?))).collect();
        return Ok(format!("{{ {} }}", entries?.join(", ")));
    }
    let items: PyResult<Vec<String>> = value.try_iter()?.map(|v| quoted(&v?)).collect();
    Ok(format!("[{}]", items?.join(", ")))
}
