//! Any bytes, opened as every kind of recording: the property that the tests hold on samples.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

#[path = "../../tests/camera/property.rs"]
mod property;

static FOLDER: LazyLock<TempDir> =
    LazyLock::new(|| tempfile::tempdir().expect("a folder for the recordings"));

fuzz_target!(|bytes: &[u8]| property::try_everything(FOLDER.path(), bytes));
