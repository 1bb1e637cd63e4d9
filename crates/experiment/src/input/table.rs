//! Input tables: named columns of texts or numbers, and CSV as laboratories write it.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::input::text_file::read_text;

/// A table that was read, with its path for messages.
///
/// CSV may be separated by commas, semicolons or tabs, whichever its header has, or by what a line such as `sep=;` before that says; where that is no
/// comma, numbers may have decimal commas. A byte order mark, spaces around cells, empty lines and rows of separators alone, and empty cells behind the last
/// column that has a name count for nothing. Text is UTF-8, UTF-16 with a byte
/// order mark, or else Latin-1, as spreadsheets write it.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    path: PathBuf,
    columns: Vec<(String, Column)>,
    /// Lines of the file on which rows begin; empty where the file has no lines.
    lines: Vec<u64>,
    /// Line of the file on which the names stand.
    header_line: u64,
    has_decimal_commas: bool,
}

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Texts, empty where there is none.
    Texts(Vec<String>),
    /// Numbers, `None` where there is none.
    Numbers(Vec<Option<f64>>),
}

impl Table {
    /// A table whose columns were read elsewhere.
    pub fn new(path: &Path, columns: Vec<(String, Column)>) -> Self {
        Self { path: path.to_owned(), columns, lines: Vec::new(), header_line: 1, has_decimal_commas: false }
    }

    /// Reads a CSV file. Every cell is kept as text, so that a wrong one can be named with its line.
    ///
    /// # Errors
    /// A file that cannot be read, is no text, names a column twice, or has rows of unequal length.
    pub fn read_csv(path: &Path) -> Result<Self, Error> {
        Self::parse_csv(path, &read_text(path)?)
    }

    /// The table of a CSV file's text; `path` is where that was read.
    ///
    /// # Errors
    /// As [`Table::read_csv`], but for the file.
    pub(crate) fn parse_csv(path: &Path, text: &str) -> Result<Self, Error> {
        let TableHead { text, header_line, separator } = TableHead::of(text);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let wrong = |error: csv::Error| row_error(path, &error, header_line);
        let names = names(path, reader.headers().map_err(wrong)?, header_line)?;
        let mut columns: Vec<Vec<String>> = vec![Vec::new(); names.len()];
        let mut lines = Vec::new();
        for record in reader.records() {
            let mut record = record.map_err(wrong)?;
            let line = record.position().map_or(0, |at| line_of(text, at)) + header_line - 1;
            let is_blank = record.len() > 1 && record.iter().all(str::is_empty);
            if is_blank {
                continue;
            }
            // Spreadsheets fill all rows up to the longest.
            if record.iter().skip(names.len()).all(str::is_empty) {
                record.truncate(names.len());
            }
            if record.len() != names.len() {
                return Err(unequal(path, line, (names.len(), header_line), record.len(), separator));
            }
            lines.push(line);
            record.iter().zip(&mut columns).for_each(|(cell, column)| column.push(cell.to_owned()));
        }
        let columns = names.into_iter().zip(columns.into_iter().map(Column::Texts)).collect();
        Ok(Self { path: path.to_owned(), columns, lines, header_line, has_decimal_commas: separator != b',' })
    }

    /// Whether there is a column of this name.
    pub fn has(&self, name: &str) -> bool {
        self.columns.iter().any(|(known, _)| known == name)
    }

    /// The names of the columns, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(name, _)| name.as_str())
    }

    /// A column as texts, empty where there is none.
    ///
    /// # Errors
    /// A missing column.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, Error> {
        Ok(match self.column(name)? {
            Column::Texts(texts) => texts.clone(),
            Column::Numbers(numbers) => numbers
                .iter()
                .map(|value| value.map_or_else(String::new, |value| value.to_string()))
                .collect(),
        })
    }

    /// A column of numbers; `None` where there is none.
    ///
    /// # Errors
    /// A missing column, or a cell that is no finite number.
    pub fn numbers(&self, name: &str) -> Result<Vec<Option<f64>>, Error> {
        match self.column(name)? {
            Column::Numbers(numbers) => Ok(numbers.clone()),
            Column::Texts(texts) => {
                texts.iter().enumerate().map(|(row, text)| self.number(name, row, text)).collect()
            }
        }
    }

    /// A column of numbers without gaps.
    ///
    /// # Errors
    /// As [`Table::numbers`], and an empty cell.
    pub fn full_numbers(&self, name: &str) -> Result<Vec<f64>, Error> {
        let numbers = self.numbers(name)?.into_iter().enumerate();
        numbers.map(|(row, value)| value.ok_or_else(|| self.cell(row, name, "a number", "nothing"))).collect()
    }

    /// A column of whole numbers from 0 without gaps.
    ///
    /// # Errors
    /// As [`Table::full_numbers`], and a number that is negative or not whole.
    pub fn counts(&self, name: &str) -> Result<Vec<usize>, Error> {
        let numbers = self.full_numbers(name)?.into_iter().enumerate();
        numbers
            .map(|(row, value)| match value >= 0.0 && value.fract() == 0.0 && value < 1e15 {
                true => Ok(value as usize),
                false => Err(self.cell(row, name, "a whole number from 0", &shown(value))),
            })
            .collect()
    }

    /// An error that names a cell; `row` counts from 0 below the header.
    pub fn cell(&self, row: usize, name: &str, expected: &str, found: &str) -> Error {
        Error::Cell {
            path: self.path.clone(),
            place: format!("line {}, column {name}", self.line(row)),
            expected: expected.into(),
            found: found.into(),
        }
    }

    /// The line of the file on which a row stands, from 1; `row` counts from 0 below the header.
    pub(crate) fn line(&self, row: usize) -> u64 {
        self.lines.get(row).copied().unwrap_or(row as u64 + 2)
    }

    fn number(&self, name: &str, row: usize, text: &str) -> Result<Option<f64>, Error> {
        let parsed = match self.has_decimal_commas && !text.contains('.') {
            true => text.replacen(',', ".", 1).parse::<f64>(),
            false => text.parse::<f64>(),
        };
        match (text.is_empty(), parsed) {
            (true, _) => Ok(None),
            (false, Ok(value)) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.cell(row, name, "a number", &format!("{text:?}"))),
        }
    }

    fn column(&self, name: &str) -> Result<&Column, Error> {
        let found = self.columns.iter().find(|(known, _)| known == name);
        found.map(|(_, column)| column).ok_or_else(|| Error::Cell {
            path: self.path.clone(),
            place: format!("line {}", self.header_line),
            expected: format!("a column named {name}"),
            found: match self.columns.is_empty() {
                true => "an empty file".into(),
                false => self.names().collect::<Vec<_>>().join(","),
            },
        })
    }
}

/// Where the names of a table's columns stand, and what separates its cells.
struct TableHead<'a> {
    /// The text from the names on.
    text: &'a str,
    /// Line of the file on which they stand, from 1.
    header_line: u64,
    separator: u8,
}

impl<'a> TableHead<'a> {
    fn of(text: &'a str) -> Self {
        let mut text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (mut header_line, mut stated) = (1, None);
        while let Some((line, rest)) = text.split_once('\n') {
            let is_blank =
                line.chars().all(|letter| letter.is_whitespace() || letter == ',' || letter == ';');
            let said = said_separator(line).filter(|_| stated.is_none());
            if !is_blank && said.is_none() {
                break;
            }
            stated = stated.or(said);
            (text, header_line) = (rest, header_line + 1);
        }
        let separator = stated.unwrap_or_else(|| separator(text.lines().next().unwrap_or_default()));
        Self { text, header_line, separator }
    }
}

/// The separator that a line before the table tells Excel of, such as `sep=;`.
fn said_separator(line: &str) -> Option<u8> {
    let line = line.trim_end_matches(['\r', '"']).trim_start_matches('"');
    let (name, mark) = line.split_at_checked("sep=".len())?;
    match mark.as_bytes() {
        [mark] if name.eq_ignore_ascii_case("sep=") => Some(*mark),
        _ => None,
    }
}

/// The names of columns, as far as the last that has one.
fn names(path: &Path, header: &csv::StringRecord, line: u64) -> Result<Vec<String>, Error> {
    let mut names: Vec<String> = header.iter().map(str::to_owned).collect();
    let n_named = names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    names.truncate(n_named);
    match names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
        None => Ok(names),
        Some((_, twice)) => Err(Error::Cell {
            path: path.to_owned(),
            place: format!("line {line}"),
            expected: "each column once".into(),
            found: format!("{twice} twice"),
        }),
    }
}

/// The line on which a row begins; its position is where the row before it ends, with empty lines still to come.
fn line_of(text: &str, position: &csv::Position) -> u64 {
    let before = usize::try_from(position.byte()).ok().and_then(|byte| text.get(byte..)).unwrap_or_default();
    let empty = before.bytes().take_while(|byte| matches!(byte, b'\r' | b'\n')).filter(|byte| *byte == b'\n');
    position.line() + empty.count() as u64
}

/// What separates the names of a header; a decimal comma has no place there.
fn separator(header: &str) -> u8 {
    [b';', b'\t'].into_iter().find(|mark| header.as_bytes().contains(mark)).unwrap_or(b',')
}

/// What is said of a row that has not as many cells as the header, of which the line is given too.
fn unequal(
    path: &Path,
    line: u64,
    (expected, header_line): (usize, u64),
    found: usize,
    separator: u8,
) -> Error {
    let hint = match separator == b',' && found > expected {
        true => " (hint: where numbers have decimal commas, cells are separated by ; or tabs)",
        false => "",
    };
    Error::Cell {
        path: path.to_owned(),
        place: format!("line {line}"),
        expected: format!(
            "{expected} cell{}, as in line {header_line}",
            if expected == 1 { "" } else { "s" }
        ),
        found: format!("{found}{hint}"),
    }
}

/// A number as messages show it: with all its digits, and a very large one with its power of ten.
pub(crate) fn shown(value: f64) -> String {
    const LARGE: f64 = 1e15;
    match value.abs() < LARGE {
        true => value.to_string(),
        false => format!("{value:e}"),
    }
}

fn row_error(path: &Path, error: &csv::Error, header_line: u64) -> Error {
    let line = |at: &csv::Position| format!("line {}", at.line() + header_line - 1);
    let place = error.position().map_or_else(|| "the table".into(), line);
    let (expected, found) = ("a row of cells".into(), error.to_string());
    Error::Cell { path: path.to_owned(), place, expected, found }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Table, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Tabelle-äöü.csv");
        std::fs::write(&path, bytes).unwrap();
        Table::read_csv(&path)
    }

    #[test]
    fn tables_of_every_laboratory_say_the_same() {
        let usual = read(b"name,x_px\na,1.5\nb,\n").unwrap();
        for text in [
            "name;x_px\na;1.5\nb;\n",
            "name;x_px\r\na;1,5\r\nb;\r\n",
            "name\tx_px\na\t1,5\nb\t\n",
            "\u{feff}name, x_px\n a , 1.5 \nb,\n\n",
        ] {
            let table = read(text.as_bytes()).unwrap();
            assert_eq!(table.texts("name").unwrap(), usual.texts("name").unwrap(), "{text}");
            assert_eq!(table.numbers("x_px").unwrap(), [Some(1.5), None], "{text}");
        }
    }

    #[test]
    fn what_spreadsheets_put_around_a_table_counts_for_nothing() {
        for text in [
            "name;x_px;;\na;1,5;;\nb;;;\n",
            "name,x_px,,\na,1.5,,\nb,\n",
            "name;x_px\na;1,5;;;\nb;;\n",
            "\nname;x_px\na;1,5\nb;\n",
            "\u{feff}\r\n ;;\r\nname;x_px\r\na;1,5\r\nb;\r\n",
            "sep=;\nname;x_px\na;1,5\nb;\n",
            "SEP=,\r\nname,x_px\r\na,1.5\r\nb,\r\n",
            "sep=\t\nname\tx_px\na\t1,5\nb\t\n",
            "\"sep=|\"\n\nname|x_px\na|1,5\nb|\n",
        ] {
            let table = read(text.as_bytes()).unwrap_or_else(|error| panic!("{text:?}: {error}"));
            assert_eq!(table.names().collect::<Vec<_>>(), ["name", "x_px"], "{text:?}");
            assert_eq!(table.texts("name").unwrap(), ["a", "b"], "{text:?}");
            assert_eq!(table.numbers("x_px").unwrap(), [Some(1.5), None], "{text:?}");
        }
        // Lines are those of the file.
        let told = |text: &str| {
            let found = read(text.as_bytes()).and_then(|table| table.full_numbers("x").map(drop));
            found.unwrap_err().to_string()
        };
        let message = told("sep=;\n\nn;x\na;1\n\nb;one\n");
        assert!(message.contains("line 6, column x: expected a number"), "{message}");
        let message = told("\nn;x;\na;1;7\n");
        assert!(message.contains("line 3: expected 2 cells, as in line 2, found 3"), "{message}");
        assert!(told("sep=;\nn;y\na;1\n").contains("line 2: expected a column named x, found n,y"));
        assert!(told("\nx,x,,\n1,2,,\n").contains("line 2: expected each column once, found x twice"));
        assert!(told("\n\n").contains("expected a column named x, found an empty file"));
    }

    #[test]
    fn text_is_read_in_the_encodings_that_spreadsheets_write() {
        let text = "name;x_px\nHöhe;1,5\n";
        let utf_16 = |of: fn(u16) -> [u8; 2]| -> Vec<u8> {
            [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(of).collect()
        };
        let latin_1: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        for bytes in [text.as_bytes().to_vec(), utf_16(u16::to_le_bytes), utf_16(u16::to_be_bytes), latin_1] {
            let table = read(&bytes).unwrap();
            assert_eq!(table.texts("name").unwrap(), ["Höhe"]);
            assert_eq!(table.numbers("x_px").unwrap(), [Some(1.5)]);
        }
        for bytes in [&b"\xff\xfea\0b"[..], b"\xff\xfe\0\xd8", b"PAR1\x15\0"] {
            let message = read(bytes).unwrap_err().to_string();
            assert!(message.contains("expected text in UTF-8, UTF-16 or Latin-1"), "{message}");
        }
    }

    #[test]
    fn rows_of_separators_alone_are_no_rows() {
        let table = read(b"name,x\na,1\n,\n , \n\nb,2\n,,,\nc,three\n,\n").unwrap();
        assert_eq!(table.texts("name").unwrap(), ["a", "b", "c"]);
        let message = table.numbers("x").unwrap_err().to_string();
        assert!(message.contains("line 8, column x: expected a number, found \"three\""), "{message}");
        // A single column has no separators: its empty cells are rows.
        assert_eq!(read(b"x\n1\n\"\"\n2\n").unwrap().numbers("x").unwrap(), [Some(1.0), None, Some(2.0)]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let told = |text: &str, ask: fn(&Table) -> Result<(), Error>| {
            let found = read(text.as_bytes()).and_then(|table| ask(&table));
            found.unwrap_err().to_string()
        };
        let numbers = |table: &Table| table.full_numbers("x").map(drop);
        assert!(
            told("n,x\na,1\nb,1,5\n", numbers).contains("line 3: expected 2 cells, as in line 1, found 3")
        );
        assert!(
            told("n,x\na,1\n\nb,one\n", numbers)
                .contains("line 4, column x: expected a number, found \"one\"")
        );
        assert!(told("n,x\na,\n", numbers).contains("line 2, column x: expected a number, found nothing"));
        assert!(told("n,y\na,1\n", numbers).contains("line 1: expected a column named x, found n,y"));
        assert!(told("x,x\n1,2\n", numbers).contains("each column once, found x twice"));
        assert!(told("x\n1e999\n", numbers).contains("found \"1e999\""));
        let counts = |table: &Table| table.counts("x").map(drop);
        assert!(told("x\n1e300\n", counts).ends_with("expected a whole number from 0, found 1e300"));
        assert!(
            told("n,x\na,1,5\n", numbers)
                .ends_with("(hint: where numbers have decimal commas, cells are separated by ; or tabs)")
        );
        assert!(told("n;x\na;1;5\n", numbers).ends_with("found 3"));
    }
}
