//! What OpenCV does for the inner crates, against the same truths as their own ways: videos and boards of known pictures, methods of
//! tracking on films of known motion.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "what each method gave is a table to be read")]

#[cfg(test)]
mod board_pictures;
#[cfg(test)]
mod ladder;
#[cfg(test)]
mod lucas_kanade;
#[cfg(test)]
mod methods;
#[cfg(test)]
mod video;

// Truths that the tests of the inner crates share.
#[cfg(test)]
#[path = "../../../camera/tests/camera/board_truth.rs"]
mod board_truth;
#[expect(dead_code, reason = "the other crate counts with films of its own, which are shared with these")]
#[path = "../../../correlation/tests/support/films.rs"]
mod films;
#[path = "../../../correlation/tests/support/foreign.rs"]
mod stated;
#[path = "../../../correlation/tests/support/mod.rs"]
mod support;
