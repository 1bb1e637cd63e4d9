//! What tests of several crates share: where third-party reference data lie, how a test says that it skips, and how it asks every
//! instruction set for the same bits.
//!
//! No runner knows of a test that finds out only while it runs that it lacks something: it returns, and counts as passed. So each such
//! test tells [`skip`] why, and `cargo xtask test` counts them after the runner's summary. This crate is a dependency of tests alone.

mod instruction_sets;

pub use self::instruction_sets::hold_each_to_the_same_bits;

use std::env;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::thread;

/// Variable that names the folder of third-party recordings and pictures, which are not part of the repository.
const REFERENCE_DATA: &str = "CHAINWAVE_REFERENCE_DATA";

/// Variable that names the list to which skipping tests add a line, `package test <tab> reason`.
const SKIPPED: &str = "CHAINWAVE_SKIPPED";

/// A file or folder of the reference data; `None`, and the test is told to skip, where no folder is named.
pub fn reference_data(name: &str) -> Option<PathBuf> {
    let folder = env::var_os(REFERENCE_DATA);
    if folder.is_none() {
        skip("CHAINWAVE_REFERENCE_DATA is not set");
    }
    folder.map(|folder| PathBuf::from(folder).join(name))
}

/// The hash FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo) of the bits of some words, or bytes.
pub fn digest(words: impl IntoIterator<Item = u64>) -> u64 {
    let step = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0100_0000_01B3);
    words.into_iter().fold(0xCBF2_9CE4_8422_2325, step)
}

/// Says that the present test skips, and why (in one line): on standard error, and in the list where one is kept.
#[expect(clippy::print_stderr, reason = "the runner shows it with the test's output")]
pub fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
    let Some(list) = env::var_os(SKIPPED) else { return };
    let package = env::var("CARGO_PKG_NAME").unwrap_or_default();
    let test = thread::current().name().unwrap_or_default().to_owned();
    // One write a line, so that lines of tests that run side by side stay whole.
    let line = format!("{package} {test}\t{reason}\n");
    let written =
        OpenOptions::new().append(true).open(list).and_then(|mut list| list.write_all(line.as_bytes()));
    if let Err(error) = written {
        eprintln!("{SKIPPED}: {error}");
    }
}
