//! Where tracks are kept, so that what was tracked stays tracked.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use crate::error::Error;
use crate::tracking::key::TrackKey;
use crate::tracks::RecordingTracks;

/// Keeps the tracks of recordings by their key. Asked from several threads, for different recordings.
pub trait TrackStore: Sync {
    /// What is kept under a key.
    ///
    /// # Errors
    /// A store that cannot be read at all; a torn entry is no error but [`Kept::Unusable`].
    fn load(&self, key: &TrackKey) -> Result<Kept, Error>;

    /// Keeps tracks under a key, in place of any that were there.
    ///
    /// # Errors
    /// A store that cannot be written.
    fn keep(&self, key: &TrackKey, tracks: &RecordingTracks) -> Result<(), Error>;

    /// Why nothing is kept under a key, where the store can tell: which parts of the keys under which it keeps tracks of the same
    /// recording differ.
    fn differences(&self, key: &TrackKey) -> Vec<&'static str>;
}

/// What a store has under a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Kept {
    /// Nothing.
    Nothing,
    /// Something that is torn or belongs elsewhere, and what is wrong with it.
    Unusable(String),
    /// Tracks.
    Tracks(RecordingTracks),
}

/// Keeps tracks in memory.
#[derive(Debug, Default)]
pub struct MemoryStore {
    kept: Mutex<BTreeMap<String, (TrackKey, RecordingTracks)>>,
}

impl TrackStore for MemoryStore {
    fn load(&self, key: &TrackKey) -> Result<Kept, Error> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept.get(&key.name()).filter(|(known, _)| known == key);
        Ok(found.map_or(Kept::Nothing, |(_, tracks)| Kept::Tracks(tracks.clone())))
    }

    fn keep(&self, key: &TrackKey, tracks: &RecordingTracks) -> Result<(), Error> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(key.name(), (key.clone(), tracks.clone()));
        Ok(())
    }

    fn differences(&self, key: &TrackKey) -> Vec<&'static str> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let of_recording = kept.values().filter(|(known, _)| known.recording == key.recording);
        of_recording.map(|(known, _)| key.differs_in(&known.parts)).min_by_key(Vec::len).unwrap_or_default()
    }
}
