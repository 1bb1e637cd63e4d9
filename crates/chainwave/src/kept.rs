//! Kept tables: Parquet files in the folder `.work` of the results, each with what it depends on and a checksum beside it.
//!
//! `NAME.toml` is written before `NAME.parquet`: alone it says that a table was never finished. A table whose checksum differs, or whose key
//! is another's, counts as torn and is made anew.

use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use chainwave_experiment::{
    Error as ExperimentError, Kept, RecordingTracks, Table, TrackKey, TrackRows, TrackStore,
};
use polars_core::prelude::Column;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::Error;
use crate::output::{make_folder, remove_unfinished, write_text, write_whole};
use crate::table;
use crate::tracks_table::tracks_of;

/// Keeps tables in a folder, and tracks as such tables.
pub(crate) struct KeptFolder {
    folder: PathBuf,
}

/// What `NAME.toml` says of `NAME.parquet`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Sidecar {
    /// What the table is about, such as a recording.
    subject: String,
    sha256: String,
    key: Vec<Dependency>,
}

/// One thing that the table depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Dependency {
    name: String,
    value: String,
}

impl Dependency {
    /// A thing by its name; the value is compared and never read back.
    pub(crate) fn new(name: &str, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into() }
    }
}

impl KeptFolder {
    /// The folder of kept tables in a folder of results, made where it is missing.
    pub(crate) fn in_results(out: &Path) -> Result<Self, Error> {
        let folder = out.join(".work");
        make_folder(&folder)?;
        Ok(Self { folder })
    }

    /// Removes what killed processes left unfinished.
    pub(crate) fn remove_unfinished(&self) -> Result<(), Error> {
        remove_unfinished(&self.folder)
    }

    /// Where the table of a name lies.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.parquet"))
    }

    fn sidecar(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.toml"))
    }

    /// The kept table of a name about a subject that depends on `key`; `None` where there is none, and what is wrong with a torn one.
    pub(crate) fn table(
        &self,
        name: &str,
        subject: &str,
        key: &[Dependency],
    ) -> Result<Option<Table>, String> {
        let path = self.path(name);
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(self.sidecar(name))
            .map_err(|_| "what it depends on is not written beside it".to_owned())?;
        let sidecar: Sidecar =
            toml::from_str(&text).map_err(|_| "what it depends on cannot be read".to_owned())?;
        if sidecar.subject != subject || sidecar.key != key {
            return Err("it belongs to something else".into());
        }
        let bytes = fs::read(&path).map_err(|error| error.to_string())?;
        if digest(&bytes) != sidecar.sha256 {
            return Err("its checksum does not hold".into());
        }
        table::read(&path).map(Some).map_err(|error| error.to_string())
    }

    /// Keeps a table.
    pub(crate) fn keep_table(
        &self,
        name: &str,
        subject: &str,
        key: &[Dependency],
        columns: Vec<Column>,
    ) -> Result<(), Error> {
        let path = self.path(name);
        let bytes = table::to_parquet(&path, columns)?;
        let sidecar = Sidecar { subject: subject.into(), sha256: digest(&bytes), key: key.to_vec() };
        let text = toml::to_string(&sidecar).map_err(|wrong| Error::Argument(wrong.to_string()))?;
        write_text(&self.sidecar(name), &text)?;
        write_whole(&path, |writer| writer.write_all(&bytes).map_err(Error::file(&path, "write")))
    }

    /// What the tables kept about a subject depend on.
    fn keys_about(&self, subject: &str) -> Vec<Vec<Dependency>> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let key = |path: PathBuf| {
            let text =
                path.extension().is_some_and(|ending| ending == "toml").then(|| fs::read_to_string(&path))?;
            let sidecar: Sidecar = toml::from_str(&text.ok()?).ok()?;
            (sidecar.subject == subject).then_some(sidecar.key)
        };
        entries.flatten().filter_map(|entry| key(entry.path())).collect()
    }
}

impl TrackStore for KeptFolder {
    fn load(&self, key: &TrackKey) -> Result<Kept, ExperimentError> {
        let kept = self.table(&key.name(), &key.recording, &parts(key));
        Ok(
            match kept.and_then(|table| {
                table.map(|table| only_tracks(&table)).transpose().map_err(|e| e.to_string())
            }) {
                Ok(Some(tracks)) => Kept::Tracks(tracks),
                Ok(None) => Kept::Nothing,
                Err(reason) => Kept::Unusable(reason),
            },
        )
    }

    fn keep(&self, key: &TrackKey, tracks: &RecordingTracks) -> Result<(), ExperimentError> {
        let mut rows = TrackRows::default();
        rows.add_bodies(&key.recording, tracks);
        let kept = self.keep_table(&key.name(), &key.recording, &parts(key), table::columns(rows.table()));
        kept.map_err(|error| ExperimentError::Store(error.into()))
    }

    fn differences(&self, key: &TrackKey) -> Vec<&'static str> {
        let differing = self.keys_about(&key.recording).into_iter().map(|parts| {
            let others: Vec<(String, String)> =
                parts.into_iter().map(|part| (part.name, part.value)).collect();
            key.differs_in(&others)
        });
        differing.min_by_key(|names| (names.len(), names.clone())).unwrap_or_default()
    }
}

/// The tracks of a table about one recording; of no body where it has no rows.
fn only_tracks(table: &Table) -> Result<RecordingTracks, ExperimentError> {
    let nothing = RecordingTracks { times_s: Vec::new(), bodies: Vec::new() };
    Ok(tracks_of(table)?.pop().map_or(nothing, |(_, tracks)| tracks))
}

fn parts(key: &TrackKey) -> Vec<Dependency> {
    key.parts.iter().map(|(name, value)| Dependency::new(name, value)).collect()
}

/// The SHA-256 of bytes, in hexadecimal digits.
pub(crate) fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut hex, byte| {
        let _infallible = write!(hex, "{byte:02x}");
        hex
    })
}

#[cfg(test)]
mod tests {
    use chainwave_experiment::FollowedBody;
    use chainwave_measurement::{Estimate, Lost, Position};

    use super::*;

    fn key(recording: &str, content: &str) -> TrackKey {
        TrackKey {
            recording: recording.into(),
            parts: vec![("recording", content.into()), ("method", "a".into())],
        }
    }

    fn some_tracks(seed: f64) -> RecordingTracks {
        let place = |k: u32| {
            let x = seed + 0.1 * f64::from(k);
            let (x_px, y_px) = (Estimate::new(x, 1e-3), Estimate::new(-x / 3.0, 2e-3));
            if k % 5 == 4 {
                Err(Lost::LowCorrelation)
            } else {
                let theta_rad = k.is_multiple_of(2).then(|| Estimate::new(0.01 * x, 3e-4));
                Ok(Position { x_px, y_px, theta_rad, zncc: 0.99, iterations: k })
            }
        };
        let body =
            |body| FollowedBody { body, method: "icgn".into(), positions: (0..40).map(place).collect() };
        RecordingTracks {
            times_s: (0..40).map(|k| 1e-5 * f64::from(k)).collect(),
            bodies: vec![body(3), body(4)],
        }
    }

    #[test]
    fn what_was_kept_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let store = KeptFolder::in_results(folder.path()).unwrap();
        let (one, other) = (key("a.cine", "1"), key("b.cine", "2"));
        assert_eq!(store.load(&one).unwrap(), Kept::Nothing);
        store.keep(&one, &some_tracks(1.0 / 3.0)).unwrap();
        assert_eq!(store.load(&one).unwrap(), Kept::Tracks(some_tracks(1.0 / 3.0)));
        assert_eq!(store.load(&other).unwrap(), Kept::Nothing);
        assert_eq!(store.differences(&key("a.cine", "changed")), ["recording"]);
        assert!(store.differences(&other).is_empty());
    }

    #[test]
    fn what_is_cut_zeroed_swapped_or_garbage_is_never_taken_for_tracks() {
        let folder = tempfile::tempdir().unwrap();
        let store = KeptFolder::in_results(folder.path()).unwrap();
        let (one, other) = (key("a.cine", "1"), key("a.cine", "2"));
        store.keep(&one, &some_tracks(1.0)).unwrap();
        store.keep(&other, &some_tracks(2.0)).unwrap();
        let is_torn = |what: &str| {
            assert!(matches!(store.load(&one).unwrap(), Kept::Unusable(_)), "{what}");
        };
        for path in [store.path(&one.name()), store.sidecar(&one.name())] {
            let whole = fs::read(&path).unwrap();
            for at in (0..whole.len()).step_by(256) {
                fs::write(&path, &whole[..at]).unwrap();
                is_torn(&format!("cut at {at}"));
                let mut zeroed = whole.clone();
                zeroed[at..whole.len().min(at + 256)].fill(0);
                // A block that held zeros alone is as it was.
                if zeroed != whole {
                    fs::write(&path, &zeroed).unwrap();
                    is_torn(&format!("zeroed from {at}"));
                }
            }
            fs::write(&path, "garbage").unwrap();
            is_torn("garbage");
            fs::write(&path, &whole).unwrap();
        }
        assert_eq!(store.load(&one).unwrap(), Kept::Tracks(some_tracks(1.0)));
        fs::remove_file(store.sidecar(&one.name())).unwrap();
        is_torn("without what it depends on");
        store.keep(&one, &some_tracks(1.0)).unwrap();
        for of in [KeptFolder::path, KeptFolder::sidecar] {
            let swapped = folder.path().join("swapped");
            fs::rename(of(&store, &one.name()), &swapped).unwrap();
            fs::rename(of(&store, &other.name()), of(&store, &one.name())).unwrap();
            fs::rename(&swapped, of(&store, &other.name())).unwrap();
            is_torn("swapped");
        }
        store.keep(&one, &some_tracks(1.0)).unwrap();
        assert_eq!(store.load(&one).unwrap(), Kept::Tracks(some_tracks(1.0)));
    }
}
