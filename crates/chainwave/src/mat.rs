//! MATLAB's MAT-files of level 5, as MATLAB 5 and later, Octave and SciPy read them: structures whose fields are columns of tables.
//!
//! The format is that of "MAT-File Format" (The MathWorks, R2021b), chapter 1: elements with a tag of type and length, each filled up to a
//! multiple of 8 bytes; those of the file itself are compressed by zlib. Counts are little-endian, as the header says.

use crate::error::Error;

/// Field names have room for MATLAB's longest, 63 letters, and an ending zero.
const NAME_BYTES: usize = 64;
/// What zlib spends: its usual balance of time and size.
const COMPRESSION: u8 = 6;

/// A variable of the file: a structure of one element.
pub(crate) struct Structure {
    /// Its name; what MATLAB does not take in a name becomes `_`.
    pub(crate) name: String,
    /// Its fields, in their order.
    pub(crate) fields: Vec<(String, Field)>,
}

/// What a field holds.
pub(crate) enum Field {
    /// Numbers below each other; NaN where one was lost, as MATLAB writes it.
    Numbers(Vec<f64>),
    /// Whole numbers below each other, `uint32`.
    Counts(Vec<u32>),
    /// Texts below each other, a cell array.
    Texts(Vec<String>),
    /// A text.
    Text(String),
    /// A structure within.
    Fields(Vec<(String, Field)>),
}

/// Types of elements.
mod element {
    pub(super) const INT8: u32 = 1;
    pub(super) const UINT16: u32 = 4;
    pub(super) const INT32: u32 = 5;
    pub(super) const UINT32: u32 = 6;
    pub(super) const DOUBLE: u32 = 9;
    pub(super) const MATRIX: u32 = 14;
    pub(super) const COMPRESSED: u32 = 15;
}

/// Classes of arrays.
mod class {
    pub(super) const CELL: u32 = 1;
    pub(super) const STRUCT: u32 = 2;
    pub(super) const CHAR: u32 = 4;
    pub(super) const DOUBLE: u32 = 6;
    pub(super) const UINT32: u32 = 13;
}

/// The bytes of a file with these variables.
///
/// # Errors
/// A variable of more than 4 GiB, which the format cannot hold.
pub(crate) fn bytes(variables: &[Structure]) -> Result<Vec<u8>, Error> {
    let mut file = format!("{:<116}", concat!("MATLAB 5.0 MAT-file, chainwave ", env!("CARGO_PKG_VERSION")));
    file.truncate(116);
    let mut file = file.into_bytes();
    // No data of a subsystem; version 1; the machine's order of bytes, little first.
    file.extend([0; 8]);
    file.extend(0x0100_u16.to_le_bytes());
    file.extend(b"IM");
    for variable in variables {
        let matrix = structure(&identifier(&variable.name), &variable.fields)?;
        let packed = miniz_oxide::deflate::compress_to_vec_zlib(&matrix, COMPRESSION);
        file.extend(tag(element::COMPRESSED, packed.len())?);
        file.extend(packed);
    }
    Ok(file)
}

/// A name as MATLAB takes it: letters, digits and `_`, a letter first, at most 63.
pub(crate) fn identifier(name: &str) -> String {
    let usable = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
    let mut name: String = name.chars().map(usable).collect();
    if !name.starts_with(|first: char| first.is_ascii_alphabetic()) {
        name.insert(0, 'x');
    }
    name.truncate(NAME_BYTES - 1);
    name
}

fn structure(name: &str, fields: &[(String, Field)]) -> Result<Vec<u8>, Error> {
    let mut parts = small_int32(NAME_BYTES as u32);
    let mut names = Vec::with_capacity(NAME_BYTES * fields.len());
    for (name, _) in fields {
        let mut name = identifier(name).into_bytes();
        name.resize(NAME_BYTES, 0);
        names.extend(name);
    }
    parts.extend(whole(element::INT8, &names)?);
    for (_, field) in fields {
        parts.extend(matrix_of(field)?);
    }
    matrix(class::STRUCT, [1, 1], name, &parts)
}

/// The array of a field, which has no name of its own.
fn matrix_of(field: &Field) -> Result<Vec<u8>, Error> {
    match field {
        Field::Numbers(values) => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            matrix(class::DOUBLE, [values.len(), 1], "", &whole(element::DOUBLE, &bytes)?)
        }
        Field::Counts(values) => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            matrix(class::UINT32, [values.len(), 1], "", &whole(element::UINT32, &bytes)?)
        }
        Field::Texts(texts) => {
            let cells = texts.iter().map(|text| text_matrix(text)).collect::<Result<Vec<_>, _>>()?;
            matrix(class::CELL, [texts.len(), 1], "", &cells.concat())
        }
        Field::Text(text) => text_matrix(text),
        Field::Fields(fields) => structure("", fields),
    }
}

fn text_matrix(text: &str) -> Result<Vec<u8>, Error> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let bytes: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
    let n_rows = usize::from(!units.is_empty());
    matrix(class::CHAR, [n_rows, units.len()], "", &whole(element::UINT16, &bytes)?)
}

/// An array: its class, rows and columns, name, and what it holds.
fn matrix(
    class: u32,
    [n_rows, n_columns]: [usize; 2],
    name: &str,
    contents: &[u8],
) -> Result<Vec<u8>, Error> {
    let mut parts = whole(element::UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
    let size = [n_rows, n_columns].map(|n| i32::try_from(n).map(i32::to_le_bytes).map_err(|_| too_large()));
    let [n_rows, n_columns] = size;
    parts.extend(whole(element::INT32, &[n_rows?, n_columns?].concat())?);
    parts.extend(whole(element::INT8, name.as_bytes())?);
    parts.extend(contents);
    Ok([&tag(element::MATRIX, parts.len())?[..], &parts].concat())
}

/// An element, filled up to a multiple of 8 bytes.
fn whole(kind: u32, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let mut element = [&tag(kind, bytes.len())?[..], bytes].concat();
    element.resize(element.len().next_multiple_of(8), 0);
    Ok(element)
}

/// A number in the short form of an element, whose length stands beside its type.
fn small_int32(value: u32) -> Vec<u8> {
    [((4 << 16) | element::INT32).to_le_bytes(), value.to_le_bytes()].concat()
}

fn tag(kind: u32, n_bytes: usize) -> Result<[u8; 8], Error> {
    let n_bytes = u32::try_from(n_bytes).map_err(|_| too_large())?;
    let mut tag = [0; 8];
    tag[..4].copy_from_slice(&kind.to_le_bytes());
    tag[4..].copy_from_slice(&n_bytes.to_le_bytes());
    Ok(tag)
}

fn too_large() -> Error {
    Error::Argument(
        "expected a table of less than 4 GiB for a MAT-file, found a larger one (hint: write .parquet, which MATLAB reads as well)"
            .into(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_that_matlab_takes() {
        assert_eq!(identifier("x_px"), "x_px");
        assert_eq!(identifier("2.73 m/s"), "x2_73_m_s");
        assert_eq!(identifier(""), "x");
        assert_eq!(identifier(&"a".repeat(70)).len(), 63);
    }

    #[test]
    fn a_file_is_a_header_and_whole_elements() {
        let fields = vec![("t_s".to_owned(), Field::Numbers(vec![1.0, f64::NAN]))];
        let file = bytes(&[Structure { name: "motion".into(), fields }]).unwrap();
        assert!(file.starts_with(b"MATLAB 5.0 MAT-file"));
        assert_eq!(&file[124..128], [0, 1, b'I', b'M']);
        assert_eq!(file[128], 15);
        let n_packed = u32::from_le_bytes(file[132..136].try_into().unwrap()) as usize;
        assert_eq!(file.len(), 136 + n_packed);
        let matrix = miniz_oxide::inflate::decompress_to_vec_zlib(&file[136..]).unwrap();
        assert_eq!(matrix.len() % 8, 0);
        assert_eq!(matrix[..8], [[14, 0, 0, 0], ((matrix.len() - 8) as u32).to_le_bytes()].concat());
    }
}
