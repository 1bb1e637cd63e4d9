//! When frames were taken: rates that differ from what is stated, frames that are missing, motion that is too fast for them.

pub(crate) mod clocks;
pub(crate) mod exposure;
pub(crate) mod frame_steps;
pub(crate) mod repeated_frames;
pub(crate) mod rough_clocks;
pub(crate) mod unresolved;
