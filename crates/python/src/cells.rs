//! Input tables that come from Python: a name and a list of texts or numbers for each column.

use std::path::{Path, PathBuf};

use chainwave_experiment::{Column, Table};
use pyo3::prelude::*;

use crate::failure::Failure;

/// The cells of a column.
#[derive(Debug, FromPyObject)]
pub(crate) enum Cells {
    /// Numbers, `None` where there is none.
    #[pyo3(transparent)]
    Numbers(Vec<Option<f64>>),
    /// Texts.
    #[pyo3(transparent)]
    Texts(Vec<String>),
}

/// Columns with their names.
pub(crate) type NamedCells = Vec<(String, Cells)>;

/// A table, with a name for messages.
pub(crate) fn table_of(name: &str, columns: NamedCells) -> Table {
    let of = |(name, cells): (String, Cells)| match cells {
        // What is no number was lost, as NumPy and others write it.
        Cells::Numbers(values) => {
            let finite = values.into_iter().map(|value| value.filter(|value| !value.is_nan()));
            (name, Column::Numbers(finite.collect()))
        }
        Cells::Texts(values) => (name, Column::Texts(values)),
    };
    Table::new(Path::new(name), columns.into_iter().map(of).collect())
}

/// A table for a function: columns from Python, or the path of a CSV file.
#[derive(FromPyObject)]
pub(crate) enum TableArgument {
    /// Columns.
    #[pyo3(transparent)]
    Columns(NamedCells),
    /// A file.
    #[pyo3(transparent)]
    File(PathBuf),
}

impl TableArgument {
    /// The table; columns go under a name in messages.
    pub(crate) fn table(self, name: &str) -> Result<Table, Failure> {
        match self {
            Self::Columns(columns) => Ok(table_of(name, columns)),
            Self::File(path) => Ok(Table::read_csv(&path)?),
        }
    }
}
