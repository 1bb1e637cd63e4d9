//! `cargo xtask counted`: a table for the book out of a file of counts.
//!
//! What is counted over hours is kept in `docs/src/measured/counts`, a line for each single experiment, so that any of them can be counted
//! again by itself. A page's table puts them together, by columns that are written `TITLE=FUNCTION(COLUMN)`:
//!
//! | function | of the lines of one row |
//! |---|---|
//! | `by(c)` | what the rows are: lines that agree in this column belong together; the first column of a table |
//! | `n()` | how many lines |
//! | `sum(c)` | the sum |
//! | `of(c)` | the sum, and of how many lines: `6 of 7` |
//! | `mean(c)`, `rms(c)` | the mean, and the root mean square, to two digits |
//! | `names(c)` | the different texts, with commas between |
//! | `held(q)` | of the intervals of a quantity those that held, and the rms error in standard uncertainties: `96 % (1.0)` |
//! | `off(q)` | that rms error alone |
//! | `hits(q)` | intervals that held, of how many: `6 of 7` |
//! | `below(c,level)` | how often a p-value was below a level, with the uncertainty of that: `0.9 ± 0.3 % of 1000` |
//!
//! A quantity `q` has the columns `q_n`, `q_within_95` and `q_rms_sigma`; one that was never stated is `refused`.

mod csv;
mod functions;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use csv::Csv;
use functions::{Column, Function};

/// `cargo xtask counted`.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Counted {
    /// The counts.
    pub(crate) file: PathBuf,
    /// Whether the file's own notes are printed, in place of a table.
    pub(crate) about: bool,
    /// Words for what the rows are called: a file of two columns.
    pub(crate) words: Option<PathBuf>,
    /// Whether values are printed alone, a line each, and no table.
    pub(crate) plain: bool,
    /// The columns, as they are written.
    pub(crate) columns: Vec<String>,
}

/// Prints the table.
pub(crate) fn run(counted: &Counted) -> Result<(), Failure> {
    let (notes, counts) = read(&counted.file)?;
    if counted.about {
        println!("{notes}");
        return Ok(());
    }
    let words = counted.words.as_ref().map(|path| read(path)).transpose()?.map(|(_, words)| words);
    let invalid = |reason| Failure::at(&counted.file)(io::Error::new(io::ErrorKind::InvalidInput, reason));
    let columns: Vec<Column> =
        counted.columns.iter().map(|text| Column::parse(text)).collect::<Result<_, _>>().map_err(invalid)?;
    let rows = rows(&counts, &columns, words.as_ref()).map_err(invalid)?;
    print!("{}", if counted.plain { plain(&rows) } else { markdown(&columns, &rows) });
    Ok(())
}

/// The notes at the head of a file as one line, and its lines.
fn read(path: &Path) -> Result<(String, Csv), Failure> {
    let text = fs::read_to_string(path).map_err(Failure::at(path))?;
    let notes: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("# ")).collect();
    let invalid = |reason| Failure::at(path)(io::Error::new(io::ErrorKind::InvalidData, reason));
    Ok((notes.join("; "), Csv::parse(&text).map_err(invalid)?))
}

/// The cells of each row, in the order in which the first line of each stands in the file.
fn rows(counts: &Csv, columns: &[Column], words: Option<&Csv>) -> Result<Vec<Vec<String>>, String> {
    let kinds = match columns.first() {
        Some(Column { function: Function::By(name), .. }) => counts.column(name)?,
        _ => return Err("expected TITLE=by(COLUMN) first".to_owned()),
    };
    let mut rows: Vec<(&str, Vec<usize>)> = Vec::new();
    for (line, kind) in kinds.into_iter().enumerate() {
        match rows.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, lines)) => lines.push(line),
            None => rows.push((kind, vec![line])),
        }
    }
    let cells = |(kind, lines): &(&str, Vec<usize>)| -> Result<Vec<String>, String> {
        let name = words.map_or(Ok(None), |words| words.found("name", kind, "words"))?;
        let rest = columns[1..].iter().map(|column| column.function.of(counts, lines));
        std::iter::once(Ok(name.unwrap_or(kind).to_owned())).chain(rest).collect()
    };
    rows.iter().map(cells).collect()
}

fn markdown(columns: &[Column], rows: &[Vec<String>]) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let head = line(columns.iter().map(|column| &*column.title).collect());
    let rule = format!("|{}\n", "---|".repeat(columns.len()));
    head + &rule + &rows.iter().map(|row| line(row.iter().map(|cell| &**cell).collect())).collect::<String>()
}

fn plain(rows: &[Vec<String>]) -> String {
    rows.iter().flat_map(|row| &row[1..]).map(|value| format!("{value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: &str = "\
# counted on a day
kind,seed,named,\"x, y_n\",\"x, y_within_95\",\"x, y_rms_sigma\"
none,1,0,10,9,1.0
small,1,1,0,0,
none,2,1,10,10,2.0
";

    fn made(columns: &[&str], words: Option<&str>) -> Result<String, String> {
        let columns: Vec<Column> =
            columns.iter().map(|text| Column::parse(text)).collect::<Result<_, _>>().unwrap();
        let words = words.map(|text| Csv::parse(text).unwrap());
        rows(&Csv::parse(COUNTS).unwrap(), &columns, words.as_ref()).map(|rows| markdown(&columns, &rows))
    }

    #[test]
    fn lines_of_one_kind_make_a_row() {
        let columns = ["the kind=by(kind)", "n=n()", "named=of(named)", "x=held(x, y)", "off=off(x, y)"];
        let table = made(&columns, Some("name,words\nnone,\"nothing, nowhere\"\n")).unwrap();
        // Of 20 intervals 19 held; the mean of the squares of 1 and 2 is 2.5.
        let expected = "\
| the kind | n | named | x | off |
|---|---|---|---|---|
| nothing, nowhere | 2 | 1 of 2 | 95 % (1.6) | 1.6 |
| small | 1 | 1 of 1 | refused | refused |
";
        assert_eq!(table, expected);
    }

    #[test]
    fn what_is_no_column_is_named() {
        assert!(made(&["n=n()"], None).unwrap_err().contains("first"));
        let missing = made(&["kind=by(kind)", "x=sum(nothing)"], None).unwrap_err();
        assert!(missing.contains("nothing") && missing.contains("seed"), "{missing}");
    }
}
