//! Tables in and out: Parquet or CSV by the ending of the name; a lost value is null.

use std::io::Write;
use std::path::{Path, PathBuf};

use chainwave_experiment::{Column as Cells, Table};
use polars::prelude::*;

use crate::error::Error;
use crate::output::write_whole;

/// Writes a table; `.csv` gives CSV and every other ending Parquet.
pub(crate) fn write(path: &Path, columns: Vec<Column>) -> Result<(), Error> {
    write_frame(path, DataFrame::new_infer_height(columns).map_err(Error::table(path))?)
}

/// A table as the bytes of a Parquet file; `path` is where they shall go, for messages.
pub(crate) fn to_parquet(path: &Path, columns: Vec<Column>) -> Result<Vec<u8>, Error> {
    bytes(path, DataFrame::new_infer_height(columns).map_err(Error::table(path))?, false)
}

/// The bytes are made first, so that what the disk refuses is told as the disk says it.
fn write_frame(path: &Path, table: DataFrame) -> Result<(), Error> {
    let bytes = bytes(path, table, is_csv(path))?;
    write_whole(path, |writer| writer.write_all(&bytes).map_err(Error::file(path, "write")))
}

fn bytes(path: &Path, mut table: DataFrame, csv: bool) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let written = match csv {
        true => CsvWriter::new(&mut bytes).finish(&mut table),
        false => ParquetWriter::new(&mut bytes).finish(&mut table).map(drop),
    };
    written.map_err(Error::table(path))?;
    Ok(bytes)
}

/// A column of numbers or texts for [`write()`]; `Option` items give nulls.
pub(crate) fn column<T, Phantom: ?Sized>(name: &str, values: T) -> Column
where
    Series: NamedFrom<T, Phantom>,
{
    Series::new(name.into(), values).into()
}

/// Reads a CSV file (by its ending) or a Parquet file.
pub(crate) fn read(path: &Path) -> Result<Table, Error> {
    if is_csv(path) {
        return Ok(Table::read_csv(path)?);
    }
    let frame = read_parquet(path)?;
    let of_column = |column: &Column| -> PolarsResult<(String, Cells)> {
        let cells = match column.dtype() {
            DataType::String => {
                let text = |value: Option<&str>| value.unwrap_or_default().trim().to_owned();
                Cells::Texts(column.str()?.iter().map(text).collect())
            }
            _ => Cells::Numbers(column.cast(&DataType::Float64)?.f64()?.iter().collect()),
        };
        Ok((column.name().to_string(), cells))
    };
    let columns: PolarsResult<Vec<_>> = frame.columns().iter().map(of_column).collect();
    Ok(Table::new(path, columns.map_err(Error::table(path))?))
}

fn read_parquet(path: &Path) -> Result<DataFrame, Error> {
    let file = std::fs::File::open(path).map_err(Error::file(path, "open"))?;
    ParquetReader::new(file).finish().map_err(Error::table(path))
}

/// Writes Parquet files of the same columns as one, in their order.
pub(crate) fn write_joined(path: &Path, parts: &[PathBuf]) -> Result<(), Error> {
    let mut joined = DataFrame::default();
    for (index, part) in parts.iter().enumerate() {
        let frame = read_parquet(part)?;
        match index {
            0 => joined = frame,
            _ => {
                joined.vstack_mut_owned(frame).map_err(Error::table(path))?;
            }
        }
    }
    joined.rechunk_mut();
    write_frame(path, joined)
}

fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
}
