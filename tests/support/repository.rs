//! The files of this repository, as the architecture tests read them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A text file of the repository.
#[derive(Debug)]
pub(crate) struct Source {
    /// Path from the top of the repository.
    pub(crate) path: PathBuf,
    /// Its contents.
    pub(crate) text: String,
}

impl Source {
    /// The lines that satisfy `matches`, as `path:line: text`.
    pub(crate) fn lines_where(&self, matches: impl Fn(&str) -> bool) -> Vec<String> {
        self.text
            .lines()
            .enumerate()
            .filter(|(_, line)| matches(line))
            .map(|(index, line)| format!("{}:{}: {}", self.path.display(), index + 1, line.trim()))
            .collect()
    }
}

/// The top of the repository that the tests run for. Checkouts that share a target directory share this program too, so the
/// place where it was compiled may be another one.
pub(crate) fn root() -> &'static Path {
    static HERE: OnceLock<PathBuf> = OnceLock::new();
    let of_cargo =
        || std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    HERE.get_or_init(|| of_cargo().into()).parent().expect("this package lies in the repository")
}

/// The text files that people write: Rust, TOML, Markdown, tables, and scripts without an ending.
pub(crate) fn sources() -> Vec<Source> {
    let written = ["rs", "toml", "md", "csv", "sh", "py", ""];
    let is_written = |path: &PathBuf| {
        let ending = path.extension().unwrap_or_default();
        written.iter().any(|known| ending == *known)
    };
    let read = |path: PathBuf| {
        let text =
            String::from_utf8(fs::read(root().join(&path)).expect("a listed file can be read")).ok()?;
        Some(Source { path, text })
    };
    files().into_iter().filter(is_written).filter_map(read).collect()
}

/// The Rust files alone.
pub(crate) fn rust_sources() -> Vec<Source> {
    let mut sources = sources();
    sources.retain(|source| source.path.extension().is_some_and(|ending| ending == "rs"));
    sources
}

/// The files of the repository, from its top: those that git tracks or would add; without git all but `target`.
pub(crate) fn files() -> Vec<PathBuf> {
    let mut files = git_files().unwrap_or_else(|| files_below(Path::new("")));
    files.retain(|path| root().join(path).is_file());
    files.sort();
    files.dedup();
    files
}

/// All files in a folder of the repository and below it, from the top of the repository.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let skipped = [Path::new("target"), Path::new(".git")];
    let mut files = Vec::new();
    for name in names_in(folder) {
        let path = folder.join(name);
        if skipped.contains(&path.as_path()) {
            continue;
        }
        if root().join(&path).is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files
}

/// The names in a folder of the repository, in alphabetic order; none when there is no such folder.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(root().join(folder))
        .into_iter()
        .flatten()
        .map(|entry| entry.expect("a folder can be listed").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn git_files() -> Option<Vec<PathBuf>> {
    let arguments = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let output = Command::new("git").args(arguments).current_dir(root()).output().ok()?;
    let listed = String::from_utf8(output.stdout).ok()?;
    let files: Vec<PathBuf> = listed.split_terminator('\0').map(PathBuf::from).collect();
    (output.status.success() && !files.is_empty()).then_some(files)
}
