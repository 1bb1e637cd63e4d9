//! Configurations on their way from Python: texts of files, and dicts as the TOML that the library reads.

use std::fmt::Display;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList};

use crate::failure::Failure;

/// The text of a file.
#[pyfunction]
pub(crate) fn read_text(path: PathBuf) -> Result<String, Failure> {
    std::fs::read_to_string(&path).map_err(|source| Failure::File { path, source })
}

/// A dict as TOML, its numbers to the last bit.
#[pyfunction]
pub(crate) fn toml_of_dict(tables: &Bound<'_, PyDict>) -> Result<String, Failure> {
    toml::to_string(&table_of(tables)?).map_err(wrong)
}

fn table_of(dict: &Bound<'_, PyDict>) -> Result<toml::Table, Failure> {
    let entry =
        |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| Ok((name.to_string(), value_of(&value)?));
    dict.iter().map(entry).collect()
}

fn value_of(value: &Bound<'_, PyAny>) -> Result<toml::Value, Failure> {
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(toml::Value::Table(table_of(dict)?));
    }
    if let Ok(list) = value.cast::<PyList>() {
        return list.iter().map(|item| value_of(&item)).collect::<Result<_, _>>().map(toml::Value::Array);
    }
    let unknown = || wrong(value.get_type());
    // Booleans are whole numbers to Python.
    if let Ok(value) = value.cast::<PyBool>() {
        return Ok(value.is_true().into());
    }
    if value.is_instance_of::<PyInt>() {
        return value.extract::<i64>().map(Into::into).map_err(|_too_large| unknown());
    }
    if value.is_instance_of::<PyFloat>() {
        return value.extract::<f64>().map(Into::into).map_err(|_none| unknown());
    }
    value.extract::<String>().map(Into::into).map_err(|_none| unknown())
}

fn wrong(found: impl Display) -> Failure {
    Failure::Argument(format!("a dict: expected what TOML can hold, found {found}"))
}
