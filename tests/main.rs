//! Tests of the workspace as a whole, in one binary: `cargo test --release -p chainwave-tests`.
//!
//! - `architecture`: what `Cargo.toml`s and sources must keep to;
//! - `bad_inputs`: what the command refuses, and how.
//!
//! A test that runs the command starts it with [`command::chainwave`]. One that takes more than some seconds lives in a
//! module named `slow`, which `cargo xtask test --fast` leaves out and which has the machine for itself under nextest.

// The attribute on each module tells the lints that helpers outside of `#[test]` functions are tests too.
#[cfg(test)]
mod architecture;
#[cfg(test)]
mod bad_inputs;
#[cfg(test)]
mod command;
#[cfg(test)]
mod repository;
