//! Rates of all stages of a Runge-Kutta method, and their weighted sums.

use pulp::Simd;

use crate::lanes::{PartialSums, row::AlignedRow};

/// One row for each stage of a method, in one piece of memory.
#[derive(Debug, Clone)]
pub(super) struct StageRates {
    length: usize,
    values: AlignedRow,
}

impl StageRates {
    pub(super) fn new(n_rows: usize, length: usize) -> Self {
        Self { length, values: AlignedRow::zeros(n_rows * length) }
    }

    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.length..(i + 1) * self.length]
    }

    #[inline(always)]
    pub(super) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.length..(i + 1) * self.length]
    }

    /// The first row to write, and another one to read.
    #[inline(always)]
    pub(super) fn first_and(&mut self, other: usize) -> (&mut [f64], &[f64]) {
        let (first, others) = self.values.split_at_mut(self.length);
        (first, &others[(other - 1) * self.length..other * self.length])
    }

    /// Copies a row to another one behind it.
    #[inline(always)]
    pub(super) fn copy_row(&mut self, from: usize, to: usize) {
        self.values.copy_within(from * self.length..(from + 1) * self.length, to * self.length);
    }

    /// `out = base + h sum a_j row_j` over the terms `(j, a_j)`, for as many values as `out` holds.
    #[inline(always)]
    pub(super) fn combine<S: Simd>(
        &self,
        simd: S,
        base: &[f64],
        h: f64,
        terms: &[(usize, f64)],
        out: &mut [f64],
    ) {
        if let [(j, a)] = *terms {
            // Half of a classical method's sums have one term, and want no loop over terms inside that over vectors.
            return add_product(simd, base, h * a, self.row(j), out);
        }
        let h = simd.splat_f64s(h);
        let (base_blocks, base_rest) = S::as_simd_f64s(&base[..out.len()]).0.as_chunks::<BLOCK>();
        let (blocks, rest) = S::as_mut_simd_f64s(out).0.as_chunks_mut::<BLOCK>();
        let n_done = BLOCK * blocks.len();
        for (i, (out, base)) in blocks.iter_mut().zip(base_blocks).enumerate() {
            let sums: [S::f64s; BLOCK] = self.sum_at(simd, BLOCK * i, terms);
            for k in 0..BLOCK {
                out[k] = simd.mul_add_f64s(h, sums[k], base[k]);
            }
        }
        for (i, (out, base)) in rest.iter_mut().zip(base_rest).enumerate() {
            let [sum] = self.sum_at(simd, n_done + i, terms);
            *out = simd.mul_add_f64s(h, sum, *base);
        }
    }

    /// `out += h sum a_j row_j` over the terms `(j, a_j)`.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&self, simd: S, h: f64, terms: &[(usize, f64)], out: &mut [f64]) {
        let h = simd.splat_f64s(h);
        for (i, out) in S::as_mut_simd_f64s(out).0.iter_mut().enumerate() {
            let [sum] = self.sum_at(simd, i, terms);
            *out = simd.mul_add_f64s(h, sum, *out);
        }
    }

    /// The largest magnitude of `sum a_j row_j` among the first `n` values.
    #[inline(always)]
    pub(super) fn largest<S: Simd>(&self, simd: S, n: usize, terms: &[(usize, f64)]) -> f64 {
        let mut largest = simd.splat_f64s(0.0);
        let mut doubt = simd.splat_f64s(0.0);
        for i in 0..n / S::F64_LANES {
            let [sum] = self.sum_at(simd, i, terms);
            largest = simd.max_f64s(largest, simd.abs_f64s(sum));
            doubt = simd.add_f64s(doubt, simd.sub_f64s(sum, sum));
        }
        // What is not finite may be lost in a maximum, but its difference to itself is not a number.
        simd.reduce_max_f64s(largest) + simd.reduce_sum_f64s(doubt)
    }

    /// `U` vectors of `sum a_j row_j` from vector number `i` on.
    #[inline(always)]
    fn sum_at<S: Simd, const U: usize>(&self, simd: S, i: usize, terms: &[(usize, f64)]) -> [S::f64s; U] {
        let mut sums = [simd.splat_f64s(0.0); U];
        for &(j, a) in terms {
            let values = &self.values[j * self.length + i * S::F64_LANES..][..U * S::F64_LANES];
            let a = simd.splat_f64s(a);
            for (sum, value) in sums.iter_mut().zip(S::as_simd_f64s(values).0) {
                *sum = simd.mul_add_f64s(a, *value, *sum);
            }
        }
        sums
    }
}

/// `out = base + factor row`.
#[inline(always)]
fn add_product<S: Simd>(simd: S, base: &[f64], factor: f64, row: &[f64], out: &mut [f64]) {
    let factor = simd.splat_f64s(factor);
    let n_vectors = PartialSums::<S>::VECTORS;
    let bases = S::as_simd_f64s(&base[..out.len()]).0.chunks_exact(n_vectors);
    let rows = S::as_simd_f64s(&row[..out.len()]).0.chunks_exact(n_vectors);
    let outs = S::as_mut_simd_f64s(out).0.chunks_exact_mut(n_vectors);
    for (out, (base, row)) in outs.zip(bases.zip(rows)) {
        for i in 0..n_vectors {
            out[i] = simd.mul_add_f64s(factor, row[i], base[i]);
        }
    }
}

/// Vectors that are summed side by side.
const BLOCK: usize = 4;
