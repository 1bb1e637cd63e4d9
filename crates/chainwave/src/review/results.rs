//! What `run` left of its tracks, with the view of each recording.

use std::path::Path;

use chainwave_experiment::{RecordingTracks, read_text};
use serde_json::Value;

use crate::error::Error;
use crate::output::found_in_place_of;
use crate::run_files::{RESULTS, TRACKS};
use crate::table;
use crate::tracks_table::tracks_of;

/// The tracks of a run.
pub(crate) struct ReviewedResults {
    /// The recordings, in the order of the tracks.
    pub(crate) recordings: Vec<RecordingResult>,
}

/// The tracks of a recording.
pub(crate) struct RecordingResult {
    pub(crate) name: String,
    pub(crate) view: u32,
    pub(crate) tracks: RecordingTracks,
}

impl ReviewedResults {
    /// Reads a folder that `run` wrote for one striker velocity.
    pub(crate) fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(TRACKS);
        if !path.is_file() {
            return Err(Error::Argument(format!(
                "{}: expected a folder with {TRACKS}, as `chainwave run` writes it, found {} (hint: of several striker velocities each has \
                 a folder)",
                folder.display(),
                found_in_place_of(folder, "a folder without it")
            )));
        }
        let views = views(&folder.join(RESULTS))?;
        let view_of = |name: &str| views.iter().find(|(known, _)| known == name).map_or(0, |(_, view)| *view);
        let of = |(name, tracks): (String, RecordingTracks)| RecordingResult {
            view: view_of(&name),
            name,
            tracks,
        };
        Ok(Self { recordings: tracks_of(&table::read(&path)?)?.into_iter().map(of).collect() })
    }
}

/// The view of each recording that results name.
fn views(path: &Path) -> Result<Vec<(String, u32)>, Error> {
    let text = read_text(path)?;
    let results: Value = serde_json::from_str(&text)
        .map_err(|wrong| Error::place(path, RESULTS, "JSON", &wrong.to_string()))?;
    let of = |one: &Value| {
        Some((one["recording"].as_str()?.to_owned(), u32::try_from(one["view"].as_u64()?).ok()?))
    };
    Ok(results["recordings"].as_array().into_iter().flatten().filter_map(of).collect())
}
