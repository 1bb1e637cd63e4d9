//! Arrays of NumPy, and their files `.npy` (NEP 1).

use std::path::Path;

use crate::error::Error;

/// With what a `.npy` file begins.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// An array of numbers, the last index running fastest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NumpyArray {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f64>,
}

impl NumpyArray {
    /// An array of another shape than a program writes.
    pub(super) fn refused(&self, path: &Path, expected: &str) -> Error {
        Error::place(path, "the array", expected, &format!("shape {:?}", self.shape))
    }

    /// An array of its parts.
    ///
    /// # Errors
    /// A type that holds no real numbers, or bytes that do not fill the shape.
    pub(super) fn new(kind: &str, is_fortran: bool, shape: Vec<usize>, bytes: &[u8]) -> Result<Self, Wrong> {
        let wrong = || (String::from("numbers of 4 or 8 bytes (f4, f8, i4, i8)"), format!("{kind:?}"));
        let (is_big, kind) = match kind.strip_prefix(['<', '=', '|']) {
            Some(kind) => (false, kind),
            None => kind.strip_prefix('>').map_or((false, kind), |kind| (true, kind)),
        };
        let size: usize = kind.get(1..).and_then(|size| size.parse().ok()).ok_or_else(wrong)?;
        let n = shape.iter().try_fold(1_usize, |n, length| n.checked_mul(*length));
        if !matches!(size, 4 | 8) || n.and_then(|n| n.checked_mul(size)) != Some(bytes.len()) {
            let expected = format!("numbers for the shape {shape:?}");
            return Err((expected, format!("{} bytes of {kind:?}", bytes.len())));
        }
        let value = |bytes: &[u8]| -> Option<f64> {
            let mut bytes = bytes.to_vec();
            if is_big {
                bytes.reverse();
            }
            Some(match kind {
                "f8" => f64::from_le_bytes(bytes.try_into().ok()?),
                "f4" => f32::from_le_bytes(bytes.try_into().ok()?).into(),
                "i4" => i32::from_le_bytes(bytes.try_into().ok()?).into(),
                "i8" => i64::from_le_bytes(bytes.try_into().ok()?) as f64,
                _ => return None,
            })
        };
        let values: Vec<f64> =
            bytes.chunks_exact(size).map(value).collect::<Option<_>>().ok_or_else(wrong)?;
        let values = if is_fortran { last_index_fastest(&shape, &values) } else { values };
        Ok(Self { shape, values })
    }
}

/// What was expected and found.
pub(super) type Wrong = (String, String);

/// Values whose first index runs fastest, in the usual order.
fn last_index_fastest(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let strides: Vec<usize> = shape
        .iter()
        .scan(1, |next, length| {
            let stride = *next;
            *next *= length;
            Some(stride)
        })
        .collect();
    let place = |mut index: usize| {
        let mut place = 0;
        for (length, stride) in shape.iter().zip(&strides).rev() {
            place += index % length * stride;
            index /= length;
        }
        place
    };
    (0..values.len()).map(|index| values[place(index)]).collect()
}

/// An array after the magic bytes: version, length of the header, the header as a Python dict, and the values.
pub(super) fn of_npy(rest: &[u8]) -> Result<NumpyArray, Wrong> {
    let cut = || (String::from("a whole .npy file"), String::from("one that was cut short"));
    let major = *rest.first().ok_or_else(cut)?;
    let (length, start) = match major {
        1 => (usize::from(u16::from_le_bytes(piece(rest, 2).ok_or_else(cut)?)), 4),
        _ => (u32::from_le_bytes(piece(rest, 2).ok_or_else(cut)?) as usize, 6),
    };
    let header = rest.get(start..).and_then(|rest| rest.get(..length)).ok_or_else(cut)?;
    let header = String::from_utf8_lossy(header);
    let after = |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start_matches([':', ' ']));
    let wrong = || (String::from("a header with descr, fortran_order and shape"), format!("{header:?}"));
    let kind = after("'descr'").and_then(|rest| rest.split('\'').nth(1)).ok_or_else(wrong)?;
    let is_fortran = after("'fortran_order'").ok_or_else(wrong)?.starts_with("True");
    let shape =
        after("'shape'").and_then(|rest| rest.strip_prefix('(')?.split(')').next()).ok_or_else(wrong)?;
    let lengths = shape.split(',').map(str::trim).filter(|length| !length.is_empty());
    let shape =
        lengths.map(|length| length.parse().map_err(|_| wrong())).collect::<Result<Vec<usize>, _>>()?;
    NumpyArray::new(kind, is_fortran, shape, rest.get(start + length..).ok_or_else(cut)?)
}

/// Some bytes from a place.
fn piece<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_both_orders_are_the_same() {
        let bytes =
            |values: [f64; 6]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let usual = NumpyArray::new("<f8", false, vec![2, 3], &bytes([0., 1., 2., 3., 4., 5.])).unwrap();
        let fortran = NumpyArray::new("<f8", true, vec![2, 3], &bytes([0., 3., 1., 4., 2., 5.])).unwrap();
        assert_eq!(usual, fortran);
    }

    #[test]
    fn what_does_not_fill_its_shape_is_refused() {
        assert!(NumpyArray::new("<f8", false, vec![2, 3], &[0; 40]).is_err());
        assert!(NumpyArray::new("<f8", false, vec![usize::MAX, 3], &[0; 8]).is_err());
        assert!(NumpyArray::new("|O8", false, vec![1], &[0; 8]).is_err());
    }

    #[test]
    fn a_file_that_was_cut_anywhere_is_refused() {
        let mut file = vec![1, 0, 70, 0];
        file.extend(format!("{:<70}", "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }").bytes());
        file.extend([1.0_f32, 2.0].iter().flat_map(|value| value.to_le_bytes()));
        assert_eq!(of_npy(&file).unwrap(), NumpyArray { shape: vec![2, 1], values: vec![1.0, 2.0] });
        (0..file.len()).for_each(|n| assert!(of_npy(&file[..n]).is_err(), "{n} bytes"));
    }
}
