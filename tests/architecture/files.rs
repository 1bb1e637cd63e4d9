//! What lies where: the top of the repository, sizes of files, and samples beside their sidecars.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::Table;

use crate::support::repository::{files, files_below, names_in, root};

/// What stands at the top of the repository beside files and folders whose names begin with a dot.
const TOP: [&str; 14] = [
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "crates",
    "data-samples",
    "docs",
    "pipelines",
    "tests",
];

/// A clone stays small: what is larger is made by a command.
const LARGEST_BYTES: u64 = 2 * 1024 * 1024;

#[test]
fn the_top_holds_only_what_is_known() {
    let unknown: Vec<String> = names_in(Path::new(""))
        .into_iter()
        .filter(|name| !name.starts_with('.') && name != "target" && !TOP.contains(&name.as_str()))
        .collect();
    assert!(unknown.is_empty(), "unknown at the top of the repository: {unknown:?}");
}

#[test]
fn no_file_is_large() {
    let size = |path: &PathBuf| fs::metadata(root().join(path)).expect("a listed file has a size").len();
    let large: Vec<PathBuf> = files().into_iter().filter(|path| size(path) > LARGEST_BYTES).collect();
    assert!(large.is_empty(), "above {LARGEST_BYTES} bytes: {large:?}");
}

#[test]
fn every_sample_agrees_with_its_sidecar() {
    for sample in samples() {
        let sidecar = sidecar_of(&sample);
        let text = fs::read_to_string(root().join(&sidecar)).unwrap_or_else(|error| {
            panic!("{}: expected a sidecar {}: {error}", sample.display(), sidecar.display())
        });
        let said: Table = text.parse().unwrap_or_else(|error| panic!("{}: {error}", sidecar.display()));
        let bytes = fs::read(root().join(&sample)).expect("a listed file can be read");
        let said_size = said.get("size_bytes").and_then(toml::Value::as_integer);
        assert_eq!(said_size, i64::try_from(bytes.len()).ok(), "{}: size_bytes", sidecar.display());
        let said_digest = said.get("sha256").and_then(toml::Value::as_str);
        assert_eq!(said_digest, Some(sha256(&bytes).as_str()), "{}: sha256", sidecar.display());
    }
}

#[test]
fn every_sidecar_has_its_sample() {
    for path in sample_files().iter().filter(|path| path.extension().is_some_and(|ending| ending == "toml")) {
        assert!(root().join(path.with_extension("")).is_file(), "{} speaks of no file", path.display());
    }
}

/// The files of `data-samples` that hold data: all but the README and the sidecars.
fn samples() -> Vec<PathBuf> {
    let mut samples = sample_files();
    samples.retain(|path| path.extension().is_none_or(|ending| ending != "toml"));
    samples
}

fn sample_files() -> Vec<PathBuf> {
    let folder = Path::new("data-samples");
    let mut files = files_below(folder);
    files.retain(|path| path != &folder.join("README.md"));
    files
}

/// What speaks of `NAME` stands in `NAME.toml` beside it, as in `shot.cine.toml`.
fn sidecar_of(sample: &Path) -> PathBuf {
    let mut name = sample.as_os_str().to_owned();
    name.push(".toml");
    name.into()
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut hex, byte| {
        write!(hex, "{byte:02x}").expect("a string can be written to");
        hex
    })
}

#[test]
fn the_digest_is_the_published_one() {
    // FIPS 180-4, example "abc".
    assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
