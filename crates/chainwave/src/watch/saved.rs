//! Which files of a folder are saved: those whose size and time have stood still since the last look.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::error::Error;
use crate::listing::entries_of;

/// How long a file that cannot be read may stand still before it counts as broken: cameras pause while they save.
const PATIENCE: Duration = Duration::from_secs(5);

/// A folder that is looked into again and again.
pub(super) struct Folder {
    path: PathBuf,
    known: BTreeMap<PathBuf, Known>,
}

/// What is known of an entry.
struct Known {
    state: State,
    since: Instant,
    is_done: bool,
}

/// Bytes, files and the latest change of an entry: of a folder those of what lies in it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State {
    n_bytes: u64,
    n_files: usize,
    changed: Option<SystemTime>,
}

impl Folder {
    /// A folder that can be listed.
    pub(super) fn of(path: &Path) -> Result<Self, Error> {
        entries_of(path)?;
        Ok(Self { path: path.to_owned(), known: BTreeMap::new() })
    }

    /// The entries that have stood still since the last time and are not done with, by name. One that changes later comes again.
    pub(super) fn newly_saved(&mut self) -> Result<Vec<PathBuf>, Error> {
        let mut saved = Vec::new();
        for path in entries_of(&self.path)? {
            // What is gone by now, or hidden while it is written, is none.
            let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            let Some(state) = State::of(&path).filter(|state| !is_hidden && state.n_bytes > 0) else {
                continue;
            };
            match self.known.get_mut(&path) {
                Some(known) if known.state == state => {
                    if !known.is_done {
                        saved.push(path);
                    }
                }
                _ => {
                    let known = Known { state, since: Instant::now(), is_done: false };
                    self.known.insert(path, known);
                }
            }
        }
        Ok(saved)
    }

    /// Notes that nothing more is to be said of an entry unless it changes.
    pub(super) fn is_done(&mut self, path: &Path) {
        if let Some(known) = self.known.get_mut(path) {
            known.is_done = true;
        }
    }

    /// Whether an entry that cannot be read has stood still for so long that it is done with; it is from then on.
    pub(super) fn has_settled(&mut self, path: &Path) -> bool {
        let has_settled = self.known.get(path).is_some_and(|known| known.since.elapsed() >= PATIENCE);
        if has_settled {
            self.is_done(path);
        }
        has_settled
    }
}

impl State {
    fn of(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        if !metadata.is_dir() {
            // The pixels of a header grow beside it.
            let beside = std::fs::metadata(path.with_extension("mraw")).ok();
            let others = ["cih", "cihx"].map(|ending| std::fs::metadata(path.with_extension(ending)).ok());
            let n_bytes = metadata.len()
                + beside.map_or(0, |found| found.len())
                + others.into_iter().flatten().map(|found| found.len()).sum::<u64>();
            return Some(Self { n_bytes, n_files: 1, changed: metadata.modified().ok() });
        }
        let inner: Vec<std::fs::Metadata> =
            std::fs::read_dir(path).ok()?.flatten().filter_map(|entry| entry.metadata().ok()).collect();
        Some(Self {
            n_bytes: inner.iter().map(std::fs::Metadata::len).sum(),
            n_files: inner.len(),
            changed: inner.iter().filter_map(|one| one.modified().ok()).max(),
        })
    }
}
