//! Readings that deserve a look, and what is corrected in them.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use chainwave_measurement::RecordingInfo;
use serde::{Deserialize, Serialize};

use crate::refusal::Refusal;

/// Most corrections that are taken at once.
const MOST_CORRECTIONS: usize = 10_000;
const MOST_NOTE_CHARS: usize = 200;

/// Readings in the order in which they are to be looked at, and what keeps corrections.
#[derive(Debug, Clone)]
pub struct Review {
    /// The readings, the most doubtful first.
    pub queue: Vec<QueuedReading>,
    /// What is corrected so far.
    pub corrections: Vec<ShownCorrection>,
    /// Where corrections are kept, for the page.
    pub path: String,
    /// Keeps all corrections in place of those before.
    pub keep: KeepCorrections,
}

/// Keeps a list of corrections; what hinders it is said in words.
#[derive(Clone)]
pub struct KeepCorrections(Arc<Keep>);

type Keep = dyn Fn(&[ShownCorrection]) -> Result<(), String> + Send + Sync;

impl KeepCorrections {
    /// Keeps them by a function.
    pub fn by(keep: impl Fn(&[ShownCorrection]) -> Result<(), String> + Send + Sync + 'static) -> Self {
        Self(Arc::new(keep))
    }
}

impl fmt::Debug for KeepCorrections {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("KeepCorrections")
    }
}

/// A reading to look at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QueuedReading {
    /// Its recording's place in the collection.
    pub recording: usize,
    /// Name of the track.
    pub name: String,
    /// Number of the frame, from 0.
    pub frame: usize,
    /// First and last frame of the doubtful ones around it.
    pub stretch: [usize; 2],
    /// How doubtful; larger is more so.
    pub doubt: f64,
    /// Why.
    pub reason: String,
}

/// A correction of readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShownCorrection {
    /// The recording's place in the collection.
    pub recording: usize,
    /// Name of the track; none for all of the recording.
    pub name: Option<String>,
    /// The first frame that it is about.
    pub first_frame: usize,
    /// The last one; none for the recording's last.
    pub last_frame: Option<usize>,
    /// What is done.
    pub remedy: ShownRemedy,
    /// Column and row of the place that a seed tells, in pixels.
    pub place_px: Option<[f64; 2]>,
    /// Why.
    #[serde(default)]
    pub note: String,
}

/// What is done about readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShownRemedy {
    /// They are taken out.
    Exclude,
    /// The subset is followed anew from a place in the first of the frames.
    Seed,
    /// The subset lies elsewhere at rest.
    Place,
}

/// What is sent to be kept: all corrections, and the number of the list that they were made from.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sent {
    version: u64,
    corrections: Vec<ShownCorrection>,
}

/// The corrections as they are now, with the number of times that they were kept.
pub(crate) struct Kept(Mutex<(u64, Vec<ShownCorrection>)>);

impl Kept {
    pub(crate) fn of(review: Option<&Review>) -> Self {
        Self(Mutex::new((0, review.map_or_else(Vec::new, |review| review.corrections.clone()))))
    }

    /// The number of the list, and the list.
    pub(crate) fn now(&self) -> (u64, Vec<ShownCorrection>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Takes what was sent in place of the list that it was made from; the number of the new one.
    pub(crate) fn replace(
        &self,
        review: &Review,
        path: &str,
        body: &[u8],
        info_of: impl Fn(usize) -> Result<RecordingInfo, Refusal>,
    ) -> Result<u64, Refusal> {
        let expected = "{\"version\", \"corrections\": [{recording, name, first_frame, last_frame, remedy, place_px, note}]}";
        let sent: Sent = serde_json::from_slice(body)
            .map_err(|error| Refusal::new(400, path, expected, error.to_string()))?;
        if sent.corrections.len() > MOST_CORRECTIONS {
            let found = sent.corrections.len().to_string();
            return Err(Refusal::new(400, path, format!("at most {MOST_CORRECTIONS} corrections"), found));
        }
        for one in &sent.corrections {
            check(one, &info_of(one.recording)?)
                .map_err(|(expected, found)| Refusal::new(400, path, expected, found))?;
        }
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.0 != sent.version {
            let found = format!("list {} where there is list {}", sent.version, kept.0);
            return Err(Refusal::new(409, path, "corrections made from what is there now", found)
                .with_hint("reload the page"));
        }
        (review.keep.0)(&sent.corrections)
            .map_err(|found| Refusal::new(409, review.path.clone(), "a file that can be written", found))?;
        *kept = (kept.0 + 1, sent.corrections);
        Ok(kept.0)
    }
}

/// Refuses a correction that cannot be meant, as what was expected and found.
fn check(one: &ShownCorrection, info: &RecordingInfo) -> Result<(), (String, String)> {
    let refuse = |expected: String, found: String| Err((expected, found));
    let last = one.last_frame.unwrap_or(one.first_frame);
    if one.first_frame > last || last >= info.n_frames {
        let found = format!("{} to {last}", one.first_frame);
        return refuse(format!("frames in their order, below {}", info.n_frames), found);
    }
    if one.remedy == ShownRemedy::Place && (one.first_frame, one.last_frame) != (0, None) {
        return refuse("no frames beside a place at rest".into(), format!("{} to {last}", one.first_frame));
    }
    let note = &one.note;
    if note.chars().count() > MOST_NOTE_CHARS || note.chars().any(char::is_control) {
        let found: String = note.chars().filter(|c| !c.is_control()).take(MOST_NOTE_CHARS).collect();
        return refuse(format!("a note of a line of at most {MOST_NOTE_CHARS} letters"), found);
    }
    let inside = |place: f64, n: usize| place >= 0.0 && place <= n as f64 - 1.0;
    match (one.remedy, one.place_px, &one.name) {
        (ShownRemedy::Exclude, None, _) => Ok(()),
        (ShownRemedy::Exclude, Some(place_px), _) => {
            refuse("no place beside an exclusion".into(), format!("{place_px:?}"))
        }
        (_, Some([x, y]), Some(_)) if inside(x, info.width_px) && inside(y, info.height_px) => Ok(()),
        (_, place_px, name) => {
            let expected = format!("a subset and a place within {} x {} px", info.width_px, info.height_px);
            refuse(expected, format!("{name:?} at {place_px:?}"))
        }
    }
}
