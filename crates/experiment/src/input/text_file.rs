//! Texts that people write: their encodings, and configurations in TOML.

use std::path::Path;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::Error;

/// Reads a configuration in TOML, in any encoding that editors write; a message points at the line.
///
/// # Errors
/// A file that cannot be read, that is no text, or whose text is no such configuration; a number that is not finite.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    parse_toml(path, &read_text(path)?)
}

/// The configuration of a text; `path` is where that was read.
///
/// # Errors
/// A text that is no such configuration; a number that is not finite.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Error> {
    let wrong = |message| Error::Configuration { path: path.to_owned(), message };
    let parsed = toml::from_str(text).map_err(|error| wrong(without_type_names(&error.to_string())))?;
    not_finite(text).map_or(Ok(parsed), |message| Err(wrong(message)))
}

/// What is said of the first key whose value is `nan` or `inf`, which TOML knows and no quantity is.
fn not_finite(text: &str) -> Option<String> {
    let table = DeTable::parse(text).ok()?;
    let mut keys = table.get_ref().iter();
    let NotFinite { key, place, found } =
        keys.find_map(|(key, value)| NotFinite::first(key.get_ref(), value))?;
    let line = 1 + text.get(..place)?.matches('\n').count();
    Some(format!("line {line}: {key}: expected a finite number, found {found}"))
}

/// A number that is none, where it stands in a text, and as it is written there.
struct NotFinite {
    key: String,
    place: usize,
    found: String,
}

impl NotFinite {
    /// The first one in the value of a key.
    fn first(key: &str, value: &Spanned<DeValue<'_>>) -> Option<Self> {
        match value.get_ref() {
            DeValue::Float(number) => {
                let is_finite = number.as_str().replace('_', "").parse().is_ok_and(f64::is_finite);
                let (place, found) = (value.span().start, number.as_str().to_owned());
                (!is_finite).then(|| Self { key: key.to_owned(), place, found })
            }
            DeValue::Array(entries) => entries.iter().find_map(|entry| Self::first(key, entry)),
            DeValue::Table(table) => {
                table.iter().find_map(|(own, value)| Self::first(&format!("{key}.{}", own.get_ref()), value))
            }
            _ => None,
        }
    }
}

/// Reads a text.
///
/// # Errors
/// A file that cannot be read or is no text, and a folder, in which a file is looked for that may have been meant.
pub fn read_text(path: &Path) -> Result<String, Error> {
    if path.is_dir() {
        return Err(a_folder(path));
    }
    let bytes = std::fs::read(path).map_err(Error::file(path, "read"))?;
    decoded(bytes).ok_or_else(|| Error::Cell {
        path: path.to_owned(),
        place: "the file".into(),
        expected: "text in UTF-8, UTF-16 or Latin-1".into(),
        found: "bytes that are none".into(),
    })
}

fn a_folder(path: &Path) -> Error {
    of_a_folder(path, "")
}

/// What is said of a folder where an experiment was expected.
pub(crate) fn a_folder_of_recordings(path: &Path) -> Error {
    let hint =
        format!(" (hint: `chainwave init {}` writes an experiment.toml for recordings)", path.display());
    of_a_folder(path, &hint)
}

/// An experiment that lies in the folder is named, else a hint is given.
fn of_a_folder(path: &Path, otherwise: &str) -> Error {
    let experiment = path.join("experiment.toml");
    let hint = match experiment.is_file() {
        true => format!(" (hint: {} is there)", experiment.display()),
        false => otherwise.to_owned(),
    };
    Error::Configuration { path: path.to_owned(), message: format!("expected a file, found a folder{hint}") }
}

/// A message of the TOML library in the words of those who do not know the types that values are kept in.
fn without_type_names(message: &str) -> String {
    const NAMES: [(&str, &str); 6] = [
        ("expected usize", "expected a whole number from 0"),
        ("expected u64", "expected a whole number from 0"),
        ("expected u32", "expected a whole number from 0"),
        ("expected i64", "expected a whole number"),
        ("expected f64", "expected a number"),
        ("expected a boolean", "expected true or false"),
    ];
    NAMES.iter().fold(message.to_owned(), |said, (name, plain)| said.replace(name, plain))
}

/// The text of a file, without its byte order mark: UTF-16 where that says so, UTF-8 where it is, else Latin-1, whose bytes are the first 256
/// characters. `None` where it is none of them: a zero byte stands in no text of single bytes.
fn decoded(bytes: Vec<u8>) -> Option<String> {
    let wide = |of: fn([u8; 2]) -> u16| {
        let (pairs, rest) = bytes[2..].as_chunks::<2>();
        let units: Vec<u16> = pairs.iter().map(|pair| of(*pair)).collect();
        String::from_utf16(&units).ok().filter(|_| rest.is_empty())
    };
    match bytes.as_slice() {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, text @ ..] => String::from_utf8(text.to_vec()).ok(),
        _ if bytes.contains(&0) => None,
        _ => Some(
            String::from_utf8(bytes)
                .unwrap_or_else(|wrong| wrong.into_bytes().into_iter().map(char::from).collect()),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Named {
        name: String,
        n: usize,
    }

    fn read(bytes: &[u8]) -> Result<Named, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Versuch.toml");
        std::fs::write(&path, bytes).unwrap();
        read_toml(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn configurations_are_read_in_the_encodings_that_editors_write() {
        let text = "name = \"Höhe\"\nn = 3\n";
        let utf_16 = |of: fn(u16) -> [u8; 2]| -> Vec<u8> {
            [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(of).collect()
        };
        let latin_1: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        let marked = [&b"\xef\xbb\xbf"[..], text.as_bytes()].concat();
        for bytes in
            [text.as_bytes().to_vec(), marked, utf_16(u16::to_le_bytes), utf_16(u16::to_be_bytes), latin_1]
        {
            assert_eq!(read(&bytes).unwrap(), Named { name: "Höhe".into(), n: 3 });
        }
        assert!(read(b"PAR1\x15\0").unwrap_err().contains("expected text in UTF-8, UTF-16 or Latin-1"));
    }

    #[test]
    fn messages_name_no_types() {
        let told = read(b"name = \"a\"\nn = -1\n").unwrap_err();
        assert!(told.contains("expected a whole number from 0") && !told.contains("usize"), "{told}");
        assert!(told.contains("line 2"), "{told}");
    }

    #[test]
    fn numbers_that_are_none_are_refused_with_their_line() {
        let values = |text: &str| parse_toml::<toml::Table>(Path::new("a.toml"), text).map(drop);
        assert!(values("a = 1_000.5e3\nb = [1, -2.0]\n[c]\nd = \"nan\"\n").is_ok());
        for (text, told) in [
            ("a = 1\n[b]\nc = nan\n", "line 3: b.c: expected a finite number, found nan"),
            ("a = [1.0,\n -inf]\n", "line 2: a: expected a finite number, found -inf"),
            ("[[a]]\nb = { c = +inf }\n", "line 2: a.b.c: expected a finite number, found +inf"),
        ] {
            let found = values(text).unwrap_err().to_string();
            assert!(found.contains(told), "{found}");
        }
    }

    #[test]
    fn a_folder_is_said_to_be_one() {
        let folder = tempfile::tempdir().unwrap();
        let told = || read_text(folder.path()).unwrap_err().to_string();
        assert!(told().ends_with("expected a file, found a folder"), "{}", told());
        let experiment = a_folder_of_recordings(folder.path()).to_string();
        assert!(experiment.contains("found a folder (hint: `chainwave init "), "{experiment}");
        std::fs::write(folder.path().join("experiment.toml"), "").unwrap();
        assert!(told().contains("(hint: ") && told().contains("experiment.toml is there)"), "{}", told());
    }
}
