//! Which vector instructions the inner loops of analysis, correlation, mechanics and the synthetic camera run with: the best of the machine,
//! or those that the environment names. All give the same bits; the tests of these crates hold that.
//!
//! ```
//! use chainwave_vectors::{InstructionSet, dispatch};
//! use pulp::{Simd, WithSimd};
//!
//! struct Width;
//!
//! impl WithSimd for Width {
//!     type Output = usize;
//!
//!     fn with_simd<S: Simd>(self, _: S) -> usize {
//!         S::F64_LANES
//!     }
//! }
//!
//! println!("{}: {} numbers at a time", InstructionSet::in_use(), dispatch(Width));
//! # assert!(dispatch(Width) >= 1);
//! ```

mod instruction_set;

pub use instruction_set::InstructionSet;

use pulp::{Simd, WithSimd};

/// Runs `work` with the vectors of the instruction set in use.
#[inline]
pub fn dispatch<W: WithSimd>(work: W) -> W::Output {
    instruction_set::arch().dispatch(work)
}

/// Runs a loop over plain numbers compiled for the instruction set in use, for the compiler to make vectors of. The closure is to be
/// `#[inline(always)]`, as what it calls: what is not put in line has none of the vectors' instructions.
///
/// It is called by reference: called by value, a closure is put in line into a function of its own first, which is compiled without them.
#[inline]
pub fn dispatch_loop<T>(work: impl FnMut() -> T) -> T {
    dispatch(Loop(work))
}

struct Loop<F>(F);

impl<T, F: FnMut() -> T> WithSimd for Loop<F> {
    type Output = T;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> T {
        let Self(mut work) = self;
        work()
    }
}
