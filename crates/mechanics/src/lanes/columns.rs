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

    /// Calls a function for each of the row's first blocks with the block's number and its coefficients, vector by vector.
    ///
    /// The middle has a loop of its own, in which the coefficients stay in registers and nothing is asked of the block.
    #[inline(always)]
    pub(crate) fn for_each_block<S: Simd>(
        &self,
        simd: S,
        n_blocks: usize,
        mut of_block: impl FnMut(usize, [[S::f64s; N]; PADDING]),
    ) {
        let mut same = [simd.splat_f64s(0.0); N];
        for (vector, value) in same.iter_mut().zip(self.same) {
            *vector = simd.splat_f64s(value);
        }
        let (before, behind) = self.others.split_at(self.middle.start);
        for (block, own) in before.iter().enumerate().take(n_blocks) {
            of_block(block, own.vectors::<S>(same));
        }
        for block in self.middle.start..self.middle.end.min(n_blocks) {
            of_block(block, [same; PADDING]);
        }
        for (block, own) in (self.middle.end..n_blocks).zip(behind) {
            of_block(block, own.vectors::<S>(same));
        }
    }
}

impl<const N: usize> Block<N> {
    /// The columns, vector by vector; behind the last vector stands `rest`, which no vector needs.
    #[inline(always)]
    fn vectors<S: Simd>(&self, rest: [S::f64s; N]) -> [[S::f64s; N]; PADDING] {
        let mut vectors = [rest; PADDING];
        for (k, column) in self.0.iter().enumerate() {
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
        let mut found = Vec::new();
        // All blocks up to that of the place, so that rows that end before, in or behind their middle are asked.
        columns.for_each_block(pulp::Scalar::new(), place / PADDING + 1, |block, vectors| {
            assert_eq!(block, found.len() / PADDING);
            found.extend(vectors);
        });
        found.len() == (place / PADDING + 1) * PADDING
            && found[place].map(f64::to_bits) == numbers.map(f64::to_bits)
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
