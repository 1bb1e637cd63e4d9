//! `chainwave export`: tables of results in another format, for other tools.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::archive::files_in;
use crate::cli;
use crate::error::Error;
use crate::mat::{Field, Structure};
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_folder_of, make_folder, write_whole};
use crate::run_files::RESULTS;
use crate::terminal::say;
use crate::{mat, table};
use chainwave_experiment::read_text;

/// Writes a table, or all tables of a folder, in the format that the ending of `--out` names.
pub(crate) fn export(arguments: &cli::Export) -> Result<Outcome, Error> {
    let cli::Export { results, out } = arguments;
    if !results.exists() {
        return Err(Error::Argument(format!(
            "{}: expected a table or a folder of results, found none",
            results.display()
        )));
    }
    if !results.is_dir() {
        expect_apart(&[results], &[("the table", out.clone())])?;
        table::write_frame(out, table::read_frame(results)?)?;
        say(out, 1);
        return Ok(Outcome::default());
    }
    let tables = tables_of(results)?;
    match out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mat")) {
        true => write_mat(results, &tables, out)?,
        false => write_csv(results, &tables, out)?,
    }
    say(out, tables.len());
    Ok(Outcome::default())
}

fn say(out: &Path, n_tables: usize) {
    say!("wrote {}: {n_tables} {}", out.display(), if n_tables == 1 { "table" } else { "tables" });
}

/// The Parquet tables of a folder and the folders in it.
fn tables_of(results: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut tables = files_in(results)?;
    tables.retain(|path| path.extension().is_some_and(|ending| ending == "parquet"));
    match tables.is_empty() {
        true => Err(Error::Argument(format!(
            "{}: expected a folder with tables (.parquet), found none (hint: the folder given to --out of `chainwave run` or `import`)",
            results.display()
        ))),
        false => Ok(tables),
    }
}

/// Each table a structure of one file, named after the table and the folders that it lies in, and `results.json` another.
fn write_mat(results: &Path, tables: &[PathBuf], out: &Path) -> Result<(), Error> {
    expect_folder_of(out)?;
    let mut variables = Vec::with_capacity(tables.len() + 1);
    for path in tables {
        let inner = path.strip_prefix(results).unwrap_or(path).with_extension("");
        let parts: Vec<_> = inner.components().map(|part| part.as_os_str().to_string_lossy()).collect();
        let fields = table::fields(path, &table::read_frame(path)?)?;
        variables.push(Structure { name: parts.join("_"), fields });
    }
    let numbers = results.join(RESULTS);
    if numbers.is_file() {
        let told: Value = serde_json::from_str(&read_text(&numbers)?)
            .map_err(|wrong| Error::configuration(&numbers, wrong.to_string()))?;
        if let Field::Fields(fields) = field_of(&told) {
            variables.push(Structure { name: "results".into(), fields });
        }
    }
    let bytes = mat::bytes(&variables)?;
    write_whole(out, |writer| std::io::Write::write_all(writer, &bytes).map_err(Error::file(out, "write")))
}

/// A value of `results.json`; what is null is NaN, and lists of anything but numbers are their JSON, item by item.
fn field_of(value: &Value) -> Field {
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    match value {
        Value::Object(members) => {
            Field::Fields(members.iter().map(|(name, value)| (name.clone(), field_of(value))).collect())
        }
        Value::Array(items) if items.iter().all(|item| item.is_number() || item.is_null()) => {
            Field::Numbers(items.iter().map(number).collect())
        }
        Value::Array(items) => Field::Texts(items.iter().map(Value::to_string).collect()),
        Value::String(text) => Field::Text(text.clone()),
        Value::Bool(is_so) => Field::Numbers(vec![f64::from(u8::from(*is_so))]),
        Value::Number(_) | Value::Null => Field::Numbers(vec![number(value)]),
    }
}

/// A CSV file of each table, in the folders where the tables lie.
fn write_csv(results: &Path, tables: &[PathBuf], out: &Path) -> Result<(), Error> {
    if out.is_file() || out.extension().is_some() && !out.is_dir() {
        let found = out.file_name().unwrap_or_default().to_string_lossy();
        return Err(Error::Argument(format!(
            "{}: expected a file that ends in .mat for all tables of a folder, or a folder for a .csv of each, found {found:?}",
            out.display()
        )));
    }
    for path in tables {
        let to = out.join(path.strip_prefix(results).unwrap_or(path)).with_extension("csv");
        make_folder(to.parent().unwrap_or(out))?;
        table::write_frame(&to, table::read_frame(path)?)?;
    }
    fs::metadata(out).map(drop).map_err(Error::file(out, "write into the folder"))
}
