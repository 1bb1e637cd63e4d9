//! Vectors of 16 values, and the choice of instruction set.
//!
//! The hot loops are written over arrays of [`LANES`] values, whatever the machine's vectors are, and multiply and add
//! in one rounding. So a sum is split in the same way everywhere, and results have the same bits with AVX-512, with
//! AVX2 and without either; [`chainwave_vectors::dispatch`] compiles a loop for each, of which only what is inlined profits, and the
//! [`chainwave_vectors::InstructionSet`] in use is chosen at run time. (A processor of before 2013
//! that cannot multiply and add in one rounding does so by the C library, slowly.)

use pulp::{Simd, WithSimd};

/// Values that are handled together.
pub(crate) const LANES: usize = 16;

/// Work on blocks of [`LANES`] values, which are `VECTORS` vectors of the instruction set `S`.
pub(crate) trait InBlocks: Sized {
    type Output;

    /// To be `#[inline(always)]`, as what it calls.
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> Self::Output;

    /// Does the work with the best instruction set of this machine.
    fn dispatch(self) -> Self::Output {
        chainwave_vectors::dispatch(Blocks(self))
    }

    /// Does the work value by value, for comparison.
    #[cfg(test)]
    fn scalar(self) -> Self::Output {
        Blocks(self).with_simd(pulp::Scalar)
    }
}

struct Blocks<T>(T);

impl<T: InBlocks> WithSimd for Blocks<T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Output {
        match S::F32_LANES {
            16 => self.0.run::<S, 1>(simd),
            8 => self.0.run::<S, 2>(simd),
            4 => self.0.run::<S, 4>(simd),
            _ => self.0.run::<S, LANES>(simd),
        }
    }
}

/// The first vector of some values.
#[inline(always)]
pub(crate) fn load<S: Simd>(values: &[f32]) -> S::f32s {
    S::as_simd_f32s(&values[..S::F32_LANES]).0[0]
}

/// Ones in a vector's first places, at most so many as it has, and zeros behind them.
#[inline(always)]
pub(crate) fn first_ones<S: Simd>(n: usize) -> S::f32s {
    const ONES: [f32; 2 * LANES] = {
        let mut values = [0.0; 2 * LANES];
        let mut i = 0;
        while i < LANES {
            values[i] = 1.0;
            i += 1;
        }
        values
    };
    load::<S>(&ONES[LANES - n.min(LANES)..])
}

/// The sum of the lanes of a block.
#[inline(always)]
pub(crate) fn total<S: Simd, const VECTORS: usize>(block: &[S::f32s; VECTORS]) -> f64 {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(pulp::bytemuck::cast_slice(block));
    sum_of_lanes(lanes)
}

/// The sum of the products of two images' pixels, as far as both go: those of two f32 are exact in f64.
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f64 {
    let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    chainwave_vectors::dispatch_loop(
        #[inline(always)]
        || {
            let ((a_lanes, a_rest), (b_lanes, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
            let mut lanes = [0.0; LANES];
            for (a, b) in a_lanes.iter().zip(b_lanes) {
                for i in 0..LANES {
                    lanes[i] += product(a[i], b[i]);
                }
            }
            sum_in_pairs(lanes) + a_rest.iter().zip(b_rest).map(|(&a, &b)| product(a, b)).sum::<f64>()
        },
    )
}

/// The values, then zeros up to whole blocks: so many that a block from any value on lies inside.
pub(crate) fn padded(values: impl Iterator<Item = f32>) -> Vec<f32> {
    let mut padded: Vec<f32> = values.collect();
    padded.resize(padded_length(padded.len()), 0.0);
    padded
}

/// How many [`padded`] values there are.
pub(crate) fn padded_length(n: usize) -> usize {
    (n + LANES - 1).next_multiple_of(LANES)
}

/// The sum of the squares of an image's pixels: [`dot`] with itself, for less.
pub(crate) fn square_sum(values: &[f32]) -> f64 {
    chainwave_vectors::dispatch_loop(
        #[inline(always)]
        || {
            let (blocks, rest) = values.as_chunks::<LANES>();
            let mut lanes = [0.0; LANES];
            for block in blocks {
                for i in 0..LANES {
                    let value = f64::from(block[i]);
                    lanes[i] += value * value;
                }
            }
            sum_in_pairs(lanes) + rest.iter().map(|&value| f64::from(value) * f64::from(value)).sum::<f64>()
        },
    )
}

/// The sum of the lanes.
#[inline(always)]
pub(crate) fn sum_of_lanes(lanes: [f32; LANES]) -> f64 {
    let mut sums = [0.0; LANES];
    for i in 0..LANES {
        sums[i] = f64::from(lanes[i]);
    }
    sum_in_pairs(sums)
}

/// The sum of the lanes, in pairs, so that its order does not depend on the vectors' width.
#[inline(always)]
fn sum_in_pairs(mut sums: [f64; LANES]) -> f64 {
    let mut n = LANES / 2;
    while n > 0 {
        for i in 0..n {
            sums[i] += sums[i + n];
        }
        n /= 2;
    }
    sums[0]
}
