//! Configurations on their way from Python: texts of files, and dicts as the TOML that the library reads.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::failure::Failure;

/// The text of a file.
#[pyfunction]
pub(crate) fn read_text(path: PathBuf) -> Result<String, Failure> {
    std::fs::read_to_string(&path).map_err(|source| Failure::File { path, source })
}

/// A JSON object as TOML.
#[pyfunction]
pub(crate) fn toml_of_json(text: &str) -> Result<String, Failure> {
    let wrong = |why: String| Failure::Argument(format!("a dict: expected what TOML can hold, found {why}"));
    let table: toml::Table = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
    toml::to_string(&table).map_err(|error| wrong(error.to_string()))
}
