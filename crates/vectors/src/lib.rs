//! Which vector instructions the inner loops of analysis, correlation and mechanics run with: the best of the machine, or those that the
//! environment names. All give the same bits; the tests of these crates hold that.
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

use pulp::WithSimd;

/// Runs `work` with the vectors of the instruction set in use.
#[inline]
pub fn dispatch<W: WithSimd>(work: W) -> W::Output {
    instruction_set::arch().dispatch(work)
}
