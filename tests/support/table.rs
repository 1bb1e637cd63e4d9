//! Tables that the command wrote, read as its users read them.

use std::fs::File;
use std::path::Path;

use polars_core::prelude::*;
use polars_io::prelude::*;

/// A table that the command wrote.
pub(crate) struct Table(DataFrame);

impl Table {
    /// Reads a Parquet file, or a CSV file by its ending.
    pub(crate) fn read(path: &Path) -> Self {
        let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let table = match path.extension().is_some_and(|ending| ending == "csv") {
            true => CsvReader::new(file).finish(),
            false => ParquetReader::new(file).finish(),
        };
        Self(table.unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    }

    /// Names of the columns, in their order.
    pub(crate) fn names(&self) -> Vec<String> {
        self.0.get_column_names().into_iter().map(ToString::to_string).collect()
    }

    /// Number of rows.
    pub(crate) fn n_rows(&self) -> usize {
        self.0.height()
    }

    /// A column of numbers; `None` where the value is lost.
    pub(crate) fn numbers(&self, name: &str) -> Vec<Option<f64>> {
        let column = self.0.column(name).expect("the column is there").cast(&DataType::Float64);
        column.expect("the column holds numbers").f64().expect("it was cast to f64").iter().collect()
    }

    /// A column of numbers, none of them lost.
    pub(crate) fn full(&self, name: &str) -> Vec<f64> {
        self.numbers(name).into_iter().map(|value| value.unwrap_or_else(|| panic!("{name}: null"))).collect()
    }

    /// A column of texts.
    pub(crate) fn texts(&self, name: &str) -> Vec<String> {
        let column = self.0.column(name).expect("the column is there").cast(&DataType::String);
        let column = column.expect("the column can be written as text");
        column
            .str()
            .expect("it was cast to text")
            .iter()
            .map(|text| text.unwrap_or_default().into())
            .collect()
    }
}
