//! Coefficients of a row that are the same nearly everywhere.

use std::ops::Range;

use pulp::Simd;

use super::PADDING;

/// Coefficients of a row's places, `N` for each, kept block by block only where they differ from those of the row's middle: loads
/// are what loops over rows take longest for.
#[derive(Debug)]
pub(crate) struct Columns<const N: usize> {
    /// Blocks around the middle whose places all have the coefficients `same`.
    middle: Range<usize>,
    same: [f64; N],
    /// The blocks before them and behind.
    others: Vec<Block<N>>,
}

/// [`PADDING`] places, column by column.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
struct Block<const N: usize>([[f64; PADDING]; N]);

impl<const N: usize> Columns<N> {
    /// From as many numbers for each place; the rows are of the same length, a multiple of [`PADDING`].
    pub(crate) fn new(rows: [&[f64]; N]) -> Self {
        let n_blocks = rows.iter().map(|row| row.len() / PADDING).min().unwrap_or(0);
        let block =
            |block: usize| Block(rows.map(|row| std::array::from_fn(|place| row[block * PADDING + place])));
        let first = n_blocks / 2;
        let same = rows.map(|row| row.get(first * PADDING).copied().unwrap_or(0.0));
        let is_same = |index: &usize| block(*index) == Block(same.map(|value| [value; PADDING]));
        let n_before = (0..first).rev().take_while(is_same).count();
        let n_behind = (first..n_blocks).take_while(is_same).count();
        let middle = if n_behind > 0 { first - n_before..first + n_behind } else { 0..0 };
        Self { same, others: (0..middle.start).chain(middle.end..n_blocks).map(block).collect(), middle }
    }

    /// A function of the coefficients of every place.
    pub(crate) fn map<const M: usize>(&self, function: impl Fn([f64; N]) -> [f64; M]) -> Columns<M> {
        let of_block = |Block(columns): &Block<N>| {
            let mut found = [[0.0; PADDING]; M];
            for place in 0..PADDING {
                let values = function(columns.map(|column| column[place]));
                for (column, value) in found.iter_mut().zip(values) {
                    column[place] = value;
                }
            }
            Block(found)
        };
        Columns {
            middle: self.middle.clone(),
            same: function(self.same),
            others: self.others.iter().map(of_block).collect(),
        }
    }

    /// The coefficients of the row's middle.
    #[inline(always)]
    pub(crate) fn same<S: Simd>(&self, simd: S) -> [S::f64s; N] {
        let mut same = [simd.splat_f64s(0.0); N];
        for (vector, value) in same.iter_mut().zip(self.same) {
            *vector = simd.splat_f64s(value);
        }
        same
    }

    /// The coefficients of a block of [`PADDING`] places, vector by vector, given [`Columns::same`].
    #[inline(always)]
    pub(crate) fn of_block<S: Simd>(&self, same: [S::f64s; N], block: usize) -> [[S::f64s; N]; PADDING] {
        let mut vectors = [same; PADDING];
        if self.middle.contains(&block) {
            return vectors;
        }
        let index = if block < self.middle.start { block } else { block - self.middle.len() };
        let Block(columns) = &self.others[index];
        for (k, column) in columns.iter().enumerate() {
            for (vectors, vector) in vectors.iter_mut().zip(S::as_simd_f64s(column).0) {
                vectors[k] = *vector;
            }
        }
        vectors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds<const N: usize>(columns: &Columns<N>, place: usize, numbers: [f64; N]) -> bool {
        let same = columns.same(pulp::Scalar::new());
        let found = columns.of_block::<pulp::Scalar>(same, place / PADDING)[place % PADDING];
        found.map(f64::to_bits) == numbers.map(f64::to_bits)
    }

    /// One place differs, first, last or between, in rows of one block and more.
    #[test]
    fn coefficients_are_those_of_the_rows() {
        for (n_blocks, other) in [(1, 0), (2, 0), (5, 3), (5, 17), (5, 39), (6, 30)] {
            let mut row = vec![2.0; n_blocks * PADDING];
            row[other] = 3.0;
            let columns = Columns::new([&row, &vec![1.0; row.len()]]);
            let squares = columns.map(|[value, one]| [value * value + one]);
            for (place, value) in row.iter().enumerate() {
                assert!(holds(&columns, place, [*value, 1.0]), "{n_blocks} {other} {place}");
                assert!(holds(&squares, place, [value * value + 1.0]), "{n_blocks} {other} {place}");
            }
        }
    }

    #[test]
    fn a_row_of_equal_places_is_kept_once() {
        let columns = Columns::new([&[2.0; 5 * PADDING]]);
        assert!(columns.others.is_empty() && columns.middle == (0..5));
    }
}
