//! Tables in and out: Parquet or CSV by the ending of the name; a lost value is null.

use std::path::Path;

use polars::prelude::*;

use crate::error::Error;
use crate::output::write_whole;

/// Writes a table; `.csv` gives CSV and every other ending Parquet.
pub(crate) fn write(path: &Path, columns: Vec<Column>) -> Result<(), Error> {
    write_frame(path, DataFrame::new_infer_height(columns).map_err(Error::table(path))?)
}

fn write_frame(path: &Path, mut table: DataFrame) -> Result<(), Error> {
    write_whole(path, |writer| {
        let written = match is_csv(path) {
            true => CsvWriter::new(writer).finish(&mut table),
            false => ParquetWriter::new(writer).finish(&mut table).map(drop),
        };
        written.map_err(Error::table(path))
    })
}

/// A column of numbers or texts for [`write()`]; `Option` items give nulls.
pub(crate) fn column<T, Phantom: ?Sized>(name: &str, values: T) -> Column
where
    Series: NamedFrom<T, Phantom>,
{
    Series::new(name.into(), values).into()
}

/// A table that was read, with its path for messages.
#[derive(Clone)]
pub(crate) struct Table {
    path: std::path::PathBuf,
    frame: DataFrame,
}

impl Table {
    /// Reads a CSV file (by its ending) or a Parquet file.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let file = std::fs::File::open(path).map_err(Error::file(path, "open"))?;
        let frame = match is_csv(path) {
            // Every cell as text, so that a wrong one can be named with its line.
            true => CsvReadOptions::default()
                .with_infer_schema_length(Some(0))
                .into_reader_with_file_handle(file)
                .finish(),
            false => ParquetReader::new(file).finish(),
        };
        Ok(Self { path: path.to_owned(), frame: frame.map_err(Error::table(path))? })
    }

    /// Writes tables of the same columns as one, in their order.
    pub(crate) fn write_joined(path: &Path, tables: &[Self]) -> Result<(), Error> {
        let mut frames = tables.iter().map(|table| table.frame.clone());
        let mut joined = frames.next().unwrap_or_default();
        for frame in frames {
            joined.vstack_mut_owned(frame).map_err(Error::table(path))?;
        }
        joined.rechunk_mut();
        write_frame(path, joined)
    }

    /// A column as texts, empty where null.
    pub(crate) fn texts(&self, name: &str) -> Result<Vec<String>, Error> {
        let text = self.column(name)?.cast(&DataType::String).map_err(Error::table(&self.path))?;
        let values = text.str().map_err(Error::table(&self.path))?;
        Ok(values.iter().map(|value| value.unwrap_or_default().trim().to_owned()).collect())
    }

    /// A column of numbers; `None` where null or empty.
    pub(crate) fn numbers(&self, name: &str) -> Result<Vec<Option<f64>>, Error> {
        let column = self.column(name)?;
        if column.dtype() != &DataType::String {
            let numbers = column.cast(&DataType::Float64).map_err(Error::table(&self.path))?;
            return Ok(numbers.f64().map_err(Error::table(&self.path))?.iter().collect());
        }
        let texts = self.texts(name)?;
        texts.iter().enumerate().map(|(row, text)| self.number(name, row, text)).collect()
    }

    /// Whether there is a column of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.frame.column(name).is_ok()
    }

    /// A column of numbers without gaps.
    pub(crate) fn full_numbers(&self, name: &str) -> Result<Vec<f64>, Error> {
        let numbers = self.numbers(name)?.into_iter().enumerate();
        numbers.map(|(row, value)| value.ok_or_else(|| self.cell(row, name, "a number", "nothing"))).collect()
    }

    /// A column of whole numbers from 0 without gaps.
    pub(crate) fn counts(&self, name: &str) -> Result<Vec<usize>, Error> {
        let numbers = self.full_numbers(name)?.into_iter().enumerate();
        numbers
            .map(|(row, value)| match value >= 0.0 && value.fract() == 0.0 && value < 1e15 {
                true => Ok(value as usize),
                false => Err(self.cell(row, name, "a whole number from 0", &value.to_string())),
            })
            .collect()
    }

    /// An error that names a cell; `row` counts from 0 below the header.
    pub(crate) fn cell(&self, row: usize, name: &str, expected: &str, found: &str) -> Error {
        Error::Cell {
            path: self.path.clone(),
            place: format!("line {}, column {name}", row + 2),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn number(&self, name: &str, row: usize, text: &str) -> Result<Option<f64>, Error> {
        match (text.is_empty(), text.parse::<f64>()) {
            (true, _) => Ok(None),
            (false, Ok(value)) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.cell(row, name, "a number", &format!("{text:?}"))),
        }
    }

    fn column(&self, name: &str) -> Result<&Column, Error> {
        self.frame.column(name).map_err(|_missing| Error::Cell {
            path: self.path.clone(),
            place: "line 1".into(),
            expected: format!("a column named {name}"),
            found: self
                .frame
                .get_column_names()
                .iter()
                .map(|name| name.as_str())
                .collect::<Vec<_>>()
                .join(","),
        })
    }
}

fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
}
