//! Tables in and out: Parquet, CSV or MAT by the ending of the name, which must be known; a lost value is null, in a MAT-file NaN.

use std::io::Write;
use std::path::{Path, PathBuf};

use chainwave_experiment::{Column as Cells, ResultTable, Table, Values};
use polars_core::prelude::*;
use polars_io::prelude::*;
use polars_parquet::write::schema_to_metadata_key;

use crate::error::Error;
use crate::mat::{self, Field, Structure};
use crate::output::{expect_folder_of, write_whole};

/// Kinds of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Csv,
    Parquet,
    Mat,
}

impl Kind {
    /// The kind of a table to be written.
    fn to_write(path: &Path) -> Result<Self, Error> {
        Self::among(path, &[("csv", Self::Csv), ("parquet", Self::Parquet), ("mat", Self::Mat)])
    }

    /// The kind of a table to be read; what separates the cells of a text is found from its first line.
    fn to_read(path: &Path) -> Result<Self, Error> {
        let texts = ["csv", "tsv", "txt"].map(|ending| (ending, Self::Csv));
        Self::among(path, &[&texts[..], &[("parquet", Self::Parquet)]].concat())
    }

    fn among(path: &Path, known: &[(&str, Self)]) -> Result<Self, Error> {
        let found = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let kind = known.iter().find(|(ending, _)| *ending == found).map(|(_, kind)| *kind);
        kind.ok_or_else(|| {
            let endings: Vec<String> = known.iter().map(|(ending, _)| format!(".{ending}")).collect();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let found = if path.is_dir() { format!("the folder {name:?}") } else { format!("{name:?}") };
            let (last, others) =
                endings.split_last().map_or(("", &[][..]), |(last, others)| (last.as_str(), others));
            Error::Argument(format!(
                "{}: expected a table that ends in {} or {last}, found {found}",
                path.display(),
                others.join(", ")
            ))
        })
    }
}

/// Refuses a table that could not be written, before long work is done for it: an unknown ending, or a folder that is not there.
pub(crate) fn expect_writable(path: &Path) -> Result<(), Error> {
    Kind::to_write(path)?;
    expect_folder_of(path)
}

/// Writes a table, CSV, Parquet or MAT by the ending of its name.
pub(crate) fn write(path: &Path, columns: Vec<Column>) -> Result<(), Error> {
    write_frame(path, DataFrame::new_infer_height(columns).map_err(Error::table(path))?)
}

/// Writes a table of results.
pub(crate) fn write_result(path: &Path, table: ResultTable) -> Result<(), Error> {
    write(path, columns(table))
}

/// Writes a table of results as Parquet, each column with its unit and description among the metadata of its field in the Arrow schema;
/// `described` holds name, unit and description.
pub(crate) fn write_described(
    path: &Path,
    table: ResultTable,
    described: &[(&str, &str, &str)],
) -> Result<(), Error> {
    let frame = DataFrame::new_infer_height(columns(table)).map_err(Error::table(path))?;
    let bytes = parquet(frame, described).map_err(Error::table(path))?;
    write_whole(path, |writer| writer.write_all(&bytes).map_err(Error::file(path, "write")))
}

/// The bytes of a Parquet file, as every reader knows them: compressed by Snappy, as MATLAB does not know polars' own choice, Zstandard, and
/// with texts by offsets in the Arrow schema, as their views are younger than many readers and foreign to many operations of others.
fn parquet(mut frame: DataFrame, described: &[(&str, &str, &str)]) -> PolarsResult<Vec<u8>> {
    let level = CompatLevel::oldest();
    let with_metadata = |name: &PlSmallStr, kind: &DataType| {
        let field = kind.to_arrow_field(name.clone(), level);
        let known = described.iter().find(|(known, ..)| *known == name.as_str());
        let about =
            known.map_or_else(Vec::new, |(_, unit, text)| vec![("unit", *unit), ("description", *text)]);
        field.with_metadata(about.into_iter().map(|(key, value)| (key.into(), value.into())).collect())
    };
    let schema: ArrowSchema =
        frame.schema().iter().map(|(name, kind)| (name.clone(), with_metadata(name, kind))).collect();
    let schema = schema_to_metadata_key(&schema);
    let metadata = vec![(schema.key, schema.value.unwrap_or_default())];
    let mut bytes = Vec::new();
    let writer = ParquetWriter::new(&mut bytes)
        .with_compression(ParquetCompression::Snappy)
        .with_key_value_metadata(Some(KeyValueMetadata::from_static(metadata)));
    writer.finish(&mut frame)?;
    Ok(bytes)
}

/// The columns of a table of results for [`write()`].
pub(crate) fn columns(table: ResultTable) -> Vec<Column> {
    let of = |(name, values)| match values {
        Values::Texts(values) => column(name, values),
        Values::Counts(values) => column(name, values),
        Values::MaybeCounts(values) => column(name, values),
        Values::Numbers(values) => column(name, values),
        Values::MaybeNumbers(values) => column(name, values),
    };
    table.columns.into_iter().map(of).collect()
}

/// A table as the bytes of a Parquet file; `path` is where they shall go, for messages.
pub(crate) fn to_parquet(path: &Path, columns: Vec<Column>) -> Result<Vec<u8>, Error> {
    bytes(path, DataFrame::new_infer_height(columns).map_err(Error::table(path))?, Kind::Parquet)
}

/// Writes a table; the bytes are made first, so that what the disk refuses is told as the disk says it.
pub(crate) fn write_frame(path: &Path, table: DataFrame) -> Result<(), Error> {
    let bytes = bytes(path, table, Kind::to_write(path)?)?;
    write_whole(path, |writer| writer.write_all(&bytes).map_err(Error::file(path, "write")))
}

fn bytes(path: &Path, mut table: DataFrame, kind: Kind) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let written = match kind {
        Kind::Csv => CsvWriter::new(&mut bytes).finish(&mut table),
        Kind::Parquet => return parquet(table, &[]).map_err(Error::table(path)),
        Kind::Mat => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            return mat::bytes(&[Structure { name, fields: fields(path, &table)? }]);
        }
    };
    written.map_err(Error::table(path))?;
    Ok(bytes)
}

/// The columns of a table as fields of a structure.
pub(crate) fn fields(path: &Path, table: &DataFrame) -> Result<Vec<(String, Field)>, Error> {
    let of = |column: &Column| -> PolarsResult<(String, Field)> {
        let field = match column.dtype() {
            DataType::String => {
                let texts = column.str()?.iter().map(|text| text.unwrap_or_default().to_owned());
                Field::Texts(texts.collect())
            }
            DataType::UInt32 if column.null_count() == 0 => {
                Field::Counts(column.u32()?.iter().flatten().collect())
            }
            _ => {
                let numbers = column.cast(&DataType::Float64)?;
                Field::Numbers(numbers.f64()?.iter().map(|value| value.unwrap_or(f64::NAN)).collect())
            }
        };
        Ok((column.name().to_string(), field))
    };
    table.columns().iter().map(of).collect::<PolarsResult<_>>().map_err(Error::table(path))
}

/// A column of numbers or texts for [`write()`]; `Option` items give nulls.
pub(crate) fn column<T, Phantom: ?Sized>(name: &str, values: T) -> Column
where
    Series: NamedFrom<T, Phantom>,
{
    Series::new(name.into(), values).into()
}

/// Reads a table, text or Parquet by the ending of its name.
pub(crate) fn read(path: &Path) -> Result<Table, Error> {
    if Kind::to_read(path)? == Kind::Csv {
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

/// Reads a table that the command wrote, with the kinds of its columns.
pub(crate) fn read_frame(path: &Path) -> Result<DataFrame, Error> {
    if Kind::to_read(path)? == Kind::Parquet {
        return read_parquet(path);
    }
    let table = Table::read_csv(path)?;
    let of = |name: &str| -> Result<Column, Error> {
        if let Some(counts) = counts(&table.texts(name)?) {
            return Ok(column(name, counts));
        }
        // A column is one of numbers where each of its cells is one or empty.
        match table.numbers(name) {
            Ok(numbers) => Ok(column(name, numbers)),
            Err(_text) => Ok(column(name, table.texts(name)?)),
        }
    };
    let columns = table.names().map(of).collect::<Result<Vec<_>, _>>()?;
    DataFrame::new_infer_height(columns).map_err(Error::table(path))
}

/// The whole numbers of a column whose cells are written as such, or empty: what is no count is written with a point.
fn counts(cells: &[String]) -> Option<Vec<Option<u32>>> {
    let is_count = |cell: &String| cell.bytes().all(|byte| byte.is_ascii_digit());
    let written = cells.iter().any(|cell| !cell.is_empty()) && cells.iter().all(is_count);
    let count = |cell: &String| if cell.is_empty() { Some(None) } else { cell.parse().ok().map(Some) };
    written.then(|| cells.iter().map(count).collect()).flatten()
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

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use polars_parquet::read::read_metadata;

    use super::*;

    #[test]
    fn texts_are_stored_as_every_reader_knows_them() {
        const KEY: &str = "ARROW:schema";
        let columns = || vec![column("name", vec!["one".to_owned()]), column("x_m", vec![1.0])];
        let stored = |bytes: Vec<u8>| {
            let metadata = read_metadata(&mut Cursor::new(bytes)).unwrap();
            let pairs = metadata.key_value_metadata().clone().unwrap();
            pairs.into_iter().find(|pair| pair.key == KEY).unwrap().value
        };
        let schema_with = |texts: ArrowDataType| {
            let field = |name: &str, kind| (name.into(), ArrowField::new(name.into(), kind, true));
            let fields = [field("name", texts), field("x_m", ArrowDataType::Float64)];
            schema_to_metadata_key(&fields.into_iter().collect::<ArrowSchema>()).value
        };
        let ours = to_parquet(Path::new("table.parquet"), columns()).unwrap();
        assert_eq!(stored(ours), schema_with(ArrowDataType::LargeUtf8));
        // What is kept from: polars' own choice.
        let mut theirs = Vec::new();
        let mut frame = DataFrame::new_infer_height(columns()).unwrap();
        ParquetWriter::new(&mut theirs).finish(&mut frame).unwrap();
        assert_eq!(stored(theirs), schema_with(ArrowDataType::Utf8View));
    }
}
