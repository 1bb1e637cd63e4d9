//! Arithmetic on vectors of numbers of any width, with the same bits on each instruction set.

pub(crate) mod columns;
pub(crate) mod row;
mod table;

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::{Simd, WithSimd, bytemuck};

/// Rows of values are padded to a multiple of this, the widest vector of any machine in f64.
pub(crate) const PADDING: usize = 8;

/// Numbers in a record of a table that vectors look up.
pub(crate) const COLUMNS: usize = 4;

/// A table of records, one for each byte that can name it.
pub(crate) type Records = [[f64; COLUMNS]; 256];

/// Numbers in a vector of the instruction set in use.
pub(crate) fn width() -> usize {
    struct Width;

    impl WithSimd for Width {
        type Output = usize;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }

    chainwave_vectors::dispatch(Width)
}

/// `n` rounded up to a multiple of [`PADDING`].
pub(crate) fn padded(n: usize) -> usize {
    n.next_multiple_of(PADDING)
}

/// The sum of the partial sums of a row, one for each place in [`PADDING`], in an order that no vector width changes.
#[inline(always)]
pub(crate) fn total(sums: [f64; PADDING]) -> f64 {
    let quarter = |i: usize| sums[i] + sums[i + PADDING / 2];
    (quarter(0) + quarter(2)) + (quarter(1) + quarter(3))
}

/// The whole blocks of [`PADDING`] numbers of a row, which loops that keep [`PartialSums`] go through one by one.
#[inline(always)]
pub(crate) fn blocks(row: &[f64]) -> &[[f64; PADDING]] {
    row.as_chunks().0
}

/// Copies a row of whole vectors, which at these lengths beats the general copy's set-up.
#[inline(always)]
pub(crate) fn copy<S: Simd>(_simd: S, from: &[f64], to: &mut [f64]) {
    for (to, from) in S::as_mut_simd_f64s(to).0.iter_mut().zip(S::as_simd_f64s(from).0) {
        *to = *from;
    }
}

/// A sum over a row as [`PADDING`] partial sums, which no vector width changes: places of the row that differ by a multiple
/// of it share one.
#[derive(Clone, Copy)]
pub(crate) struct PartialSums<S: Simd> {
    sums: [S::f64s; PADDING],
}

impl<S: Simd> PartialSums<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        Self { sums: [simd.splat_f64s(0.0); PADDING] }
    }

    /// Vectors among [`PADDING`] numbers: so many sums are kept, and rows are gone through in blocks of as many vectors. A sum's
    /// number is then known when the loop is compiled, and the sums stay in registers.
    pub(crate) const VECTORS: usize = PADDING / S::F64_LANES;

    /// Adds the products of a block's vector number `i`, each rounded once with its sum.
    #[inline(always)]
    pub(crate) fn add_product(&mut self, simd: S, i: usize, a: S::f64s, b: S::f64s) {
        self.sums[i] = simd.mul_add_f64s(a, b, self.sums[i]);
    }

    #[inline(always)]
    pub(crate) fn total(self) -> f64 {
        let mut row = [0.0; PADDING];
        for (out, sum) in S::as_mut_simd_f64s(&mut row).0.iter_mut().zip(self.sums) {
            *out = sum;
        }
        total(row)
    }
}

/// `U` vectors that go through a formula side by side, so that one hides the latency of the other and both share the
/// loads of its constants.
pub(crate) struct Lanes<S: Simd, const U: usize> {
    simd: S,
    values: [S::f64s; U],
}

impl<S: Simd, const U: usize> Clone for Lanes<S, U> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd, const U: usize> Copy for Lanes<S, U> {}

macro_rules! lane_by_lane {
    ($operator:ident, $name:ident, $instruction:ident) => {
        impl<S: Simd, const U: usize> $operator for Lanes<S, U> {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for (a, b) in self.values.iter_mut().zip(other.values) {
                    *a = self.simd.$instruction(*a, b);
                }
                self
            }
        }
    };
}

lane_by_lane!(Add, add, add_f64s);
lane_by_lane!(Sub, sub, sub_f64s);
lane_by_lane!(Mul, mul, mul_f64s);
lane_by_lane!(Div, div, div_f64s);

impl<S: Simd, const U: usize> Neg for Lanes<S, U> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for a in &mut self.values {
            *a = self.simd.neg_f64s(*a);
        }
        self
    }
}

impl<S: Simd, const U: usize> Lanes<S, U> {
    #[inline(always)]
    pub(crate) fn new(simd: S, values: [S::f64s; U]) -> Self {
        Self { simd, values }
    }

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self { simd, values: [simd.splat_f64s(value); U] }
    }

    /// The same number in every lane of vectors like these.
    #[inline(always)]
    pub(crate) fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// Takes the lanes from as many vectors.
    #[inline(always)]
    pub(crate) fn load(&mut self, vectors: &[S::f64s]) {
        for (lane, vector) in self.values.iter_mut().zip(vectors) {
            *lane = *vector;
        }
    }

    #[inline(always)]
    pub(crate) fn values(self) -> [S::f64s; U] {
        self.values
    }

    /// `self * factor + term`, rounded once.
    #[inline(always)]
    pub(crate) fn mul_add(mut self, factor: Self, term: Self) -> Self {
        for i in 0..U {
            self.values[i] = self.simd.mul_add_f64s(self.values[i], factor.values[i], term.values[i]);
        }
        self
    }

    /// `term - self * factor`, rounded once.
    #[inline(always)]
    pub(crate) fn mul_sub_from(mut self, factor: Self, term: Self) -> Self {
        for i in 0..U {
            self.values[i] = self.simd.negate_mul_add_f64s(self.values[i], factor.values[i], term.values[i]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn sqrt(mut self) -> Self {
        for a in &mut self.values {
            *a = self.simd.sqrt_f64s(*a);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn max(mut self, other: Self) -> Self {
        for i in 0..U {
            self.values[i] = self.simd.max_f64s(self.values[i], other.values[i]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn min(mut self, other: Self) -> Self {
        for i in 0..U {
            self.values[i] = self.simd.min_f64s(self.values[i], other.values[i]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn abs(mut self) -> Self {
        for a in &mut self.values {
            *a = self.simd.abs_f64s(*a);
        }
        self
    }

    /// `yes` where `self < than`, else `no`.
    #[inline(always)]
    pub(crate) fn select_less(self, than: Self, yes: Self, mut no: Self) -> Self {
        for i in 0..U {
            let less = self.simd.less_than_f64s(self.values[i], than.values[i]);
            no.values[i] = self.simd.select_f64s(less, yes.values[i], no.values[i]);
        }
        no
    }

    /// `yes` where `self == to`, else `no`.
    #[inline(always)]
    pub(crate) fn select_equal(self, to: Self, yes: Self, mut no: Self) -> Self {
        for i in 0..U {
            let equal = self.simd.equal_f64s(self.values[i], to.values[i]);
            no.values[i] = self.simd.select_f64s(equal, yes.values[i], no.values[i]);
        }
        no
    }

    /// `yes` where the bits, as a whole number, are less than these, else `no`.
    #[inline(always)]
    pub(crate) fn select_bits_below(self, bits: u64, yes: Self, mut no: Self) -> Self {
        let bits = self.simd.splat_u64s(bits);
        for i in 0..U {
            let below = self.simd.less_than_u64s(bytemuck::cast(self.values[i]), bits);
            no.values[i] = self.simd.select_f64s(below, yes.values[i], no.values[i]);
        }
        no
    }

    /// Whether no lane is further from zero than a limit.
    #[inline(always)]
    pub(crate) fn all_within(self, limit: f64) -> bool {
        let mut largest = self.simd.splat_f64s(0.0);
        for value in self.values {
            largest = self.simd.max_f64s(largest, self.simd.abs_f64s(value));
        }
        let beyond = self.simd.less_than_f64s(self.simd.splat_f64s(limit), largest);
        self.simd.first_true_m64s(beyond) >= S::F64_LANES
    }

    /// The columns of the records that keys in memory name, each by the last four bits of its exponent and the first four of its
    /// fraction.
    #[inline(always)]
    pub(crate) fn records(simd: S, keys: &[f64], table: &Records) -> [Self; COLUMNS] {
        let mut columns = [Self::splat(simd, 0.0); COLUMNS];
        for i in 0..U {
            let found = table::records(simd, &keys[i * S::F64_LANES..][..S::F64_LANES], table);
            for (column, found) in columns.iter_mut().zip(found) {
                column.values[i] = found;
            }
        }
        columns
    }

    /// Takes a whole number from the bits, wrapping round.
    #[inline(always)]
    pub(crate) fn bits_less(mut self, bits: u64) -> Self {
        let bits = self.simd.splat_u64s(bits);
        for a in &mut self.values {
            *a = bytemuck::cast(self.simd.sub_u64s(bytemuck::cast(*a), bits));
        }
        self
    }

    /// Takes the bits from a whole number, wrapping round.
    #[inline(always)]
    pub(crate) fn less_bits(mut self, bits: u64) -> Self {
        let bits = self.simd.splat_u64s(bits);
        for a in &mut self.values {
            *a = bytemuck::cast(self.simd.sub_u64s(bits, bytemuck::cast(*a)));
        }
        self
    }

    #[inline(always)]
    pub(crate) fn and_bits(mut self, bits: u64) -> Self {
        let bits = self.simd.splat_u64s(bits);
        for a in &mut self.values {
            *a = bytemuck::cast(self.simd.and_u64s(bytemuck::cast(*a), bits));
        }
        self
    }

    #[inline(always)]
    pub(crate) fn or_bits(mut self, bits: u64) -> Self {
        let bits = self.simd.splat_u64s(bits);
        for a in &mut self.values {
            *a = bytemuck::cast(self.simd.or_u64s(bytemuck::cast(*a), bits));
        }
        self
    }

    /// Shifts the upper half of the bits of each lane to the left within that half; the lower half must be zero.
    #[inline(always)]
    pub(crate) fn upper_bits_left(mut self, by: u32) -> Self {
        for a in &mut self.values {
            *a = match bytemuck::try_cast::<S::f64s, S::u32s>(*a) {
                Ok(halves) => {
                    bytemuck::cast(self.simd.wrapping_dyn_shl_u32s(halves, self.simd.splat_u32s(by)))
                }
                Err(_one_lane) => from_bits::<S>(to_bits::<S>(*a) << by),
            };
        }
        self
    }

    /// Shifts the upper half of the bits of each lane to the right within that half; the lower half must be zero.
    #[inline(always)]
    pub(crate) fn upper_bits_right(mut self, by: u32) -> Self {
        for a in &mut self.values {
            *a = match bytemuck::try_cast::<S::f64s, S::u32s>(*a) {
                Ok(halves) => {
                    bytemuck::cast(self.simd.wrapping_dyn_shr_u32s(halves, self.simd.splat_u32s(by)))
                }
                Err(_one_lane) => from_bits::<S>(to_bits::<S>(*a) >> by),
            };
        }
        self
    }
}

impl<S: Simd, const U: usize> Lanes<S, U> {
    /// The sum of whole numbers, which no order changes.
    #[inline(always)]
    pub(crate) fn total(self) -> f64 {
        let mut total = 0.0;
        for vector in self.values {
            total += self.simd.reduce_sum_f64s(vector);
        }
        total
    }
}

impl<S: Simd> Lanes<S, 1> {
    /// The first numbers of a slice that is long enough.
    #[inline(always)]
    pub(crate) fn read(simd: S, numbers: &[f64]) -> Self {
        Self::new(simd, [S::as_simd_f64s(numbers).0[0]])
    }

    /// Writes the lanes to the front of a slice that is long enough.
    #[inline(always)]
    pub(crate) fn write(self, numbers: &mut [f64]) {
        S::as_mut_simd_f64s(numbers).0[0] = self.vector();
    }

    #[inline(always)]
    pub(crate) fn vector(self) -> S::f64s {
        let [vector] = self.values;
        vector
    }

    /// The largest number of any lane.
    #[inline(always)]
    pub(crate) fn largest(self) -> f64 {
        self.simd.reduce_max_f64s(self.values[0])
    }

    /// The number in the first lane.
    #[inline(always)]
    pub(crate) fn first(self) -> f64 {
        let mut lanes = [0.0; PADDING];
        if let Some(vector) = S::as_mut_simd_f64s(&mut lanes).0.first_mut() {
            [*vector] = self.values;
        }
        lanes[0]
    }
}

/// The bits of a vector of one lane.
#[inline(always)]
fn to_bits<S: Simd>(value: S::f64s) -> u64 {
    bytemuck::cast(value)
}

/// A vector of one lane from its bits.
#[inline(always)]
fn from_bits<S: Simd>(bits: u64) -> S::f64s {
    bytemuck::cast(bits)
}
