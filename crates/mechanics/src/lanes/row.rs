//! Rows of numbers that begin a line of the cache.

use std::ops::{Deref, DerefMut};

/// Values in a row whose first one begins a line of the cache, so that no whole vector of them lies across two lines.
#[derive(Debug, Default)]
pub(crate) struct AlignedRow {
    values: Vec<f64>,
    first: usize,
    length: usize,
}

/// Bytes of a line of the cache, and of the widest vector.
const LINE_BYTES: usize = 64;

impl AlignedRow {
    pub(crate) fn zeros(length: usize) -> Self {
        let values = vec![0.0; length + LINE_BYTES / size_of::<f64>()];
        let first = values.as_ptr().align_offset(LINE_BYTES).min(values.len() - length);
        Self { values, first, length }
    }

    /// The values, and zeros behind them up to this length.
    pub(crate) fn padded(values: impl IntoIterator<Item = f64>, length: usize) -> Self {
        let mut row = Self::zeros(length);
        for (place, value) in row.iter_mut().zip(values) {
            *place = value;
        }
        row
    }
}

impl Clone for AlignedRow {
    fn clone(&self) -> Self {
        let mut row = Self::zeros(self.length);
        row.copy_from_slice(self);
        row
    }
}

impl Deref for AlignedRow {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.values[self.first..self.first + self.length]
    }
}

impl DerefMut for AlignedRow {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.first..self.first + self.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_their_copies_begin_a_line() {
        for length in [1, 8, 27, 312] {
            let row = AlignedRow::padded([1.0, 2.0], length);
            for row in [&row, &row.clone()] {
                assert_eq!(row.as_ptr().align_offset(LINE_BYTES), 0);
                assert!(row.len() == length && row.iter().take(2).eq([1.0, 2.0][..length.min(2)].iter()));
            }
        }
    }
}
