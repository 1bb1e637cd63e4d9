//! Vectors of 16 values, and the choice of instruction set.
//!
//! The hot loops are written over arrays of [`LANES`] values, whatever the machine's vectors are, and multiply and add
//! in one rounding. So a sum is split in the same way everywhere, and results have the same bits with AVX-512, with
//! AVX2 and without either; [`vectorised`] compiles a loop for each and chooses at run time. (A processor of before 2013
//! that cannot multiply and add in one rounding does so by the C library, slowly.)

/// Values that are handled together.
pub(crate) const LANES: usize = 16;

/// Runs `work` compiled for the best instruction set of this machine. Only what is inlined into `work` profits, so the
/// functions that it calls are `#[inline(always)]`.
pub(crate) fn vectorised<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// The sum of the lanes, in pairs, so that its order does not depend on the vectors' width.
#[inline(always)]
pub(crate) fn sum_of_lanes(lanes: [f32; LANES]) -> f64 {
    let mut sums = lanes.map(f64::from);
    let mut n = LANES / 2;
    while n > 0 {
        for i in 0..n {
            sums[i] += sums[i + n];
        }
        n /= 2;
    }
    sums[0]
}
