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
    /// Texts, `None` where there is none.
    #[pyo3(transparent)]
    Texts(Vec<Option<String>>),
}

/// Columns with their names.
pub(crate) type NamedCells = Vec<(String, Cells)>;

/// A table, with a name for messages.
pub(crate) fn table_of(table: &str, columns: NamedCells) -> Result<Table, Failure> {
    let of = |(name, cells): (String, Cells)| match cells {
        Cells::Numbers(values) => {
            let infinite = values.iter().position(|value| value.is_some_and(f64::is_infinite));
            if let Some(row) = infinite {
                let message = format!("{table}, row {row}, column {name}: expected a number, found infinity");
                return Err(Failure::Argument(message));
            }
            // What is no number was lost, as NumPy and others write it.
            let known = values.into_iter().map(|value| value.filter(|value| !value.is_nan()));
            Ok((name, Column::Numbers(known.collect())))
        }
        Cells::Texts(values) => {
            Ok((name, Column::Texts(values.into_iter().map(Option::unwrap_or_default).collect())))
        }
    };
    Ok(Table::new(Path::new(table), columns.into_iter().map(of).collect::<Result<_, _>>()?))
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

/// The columns of a CSV file as Python has columns: its cells as texts.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "what comes from Python is owned")]
pub(crate) fn columns_of_csv(path: PathBuf) -> Result<Vec<(String, Vec<String>)>, Failure> {
    let table = Table::read_csv(&path)?;
    let column = |name: &str| Ok((name.to_owned(), table.texts(name)?));
    table.names().map(column).collect()
}

impl TableArgument {
    /// The table; columns go under a name in messages.
    pub(crate) fn table(self, name: &str) -> Result<Table, Failure> {
        match self {
            Self::Columns(columns) => table_of(name, columns),
            Self::File(path) => Ok(Table::read_csv(&path)?),
        }
    }
}
