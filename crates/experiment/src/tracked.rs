//! Recordings that were tracked, those that could not be, and where tracks come from.

use chainwave_camera::PlaneMap;
use chainwave_measurement::Observation;

use crate::calibration::ChainMap;
use crate::configuration::Trial;
use crate::failed_recording::FailedRecording;
use crate::finding::Finding;
use crate::stages::Stages;
use crate::tracks::{Coordinate, RecordingTracks};

/// The tracks of all recordings that could be read.
pub struct Tracked {
    /// The recordings, in the order of the trials table.
    pub recordings: Vec<TrackedRecording>,
    /// The same as positions along the chain in metres.
    pub observations: Vec<Observation>,
    /// The recordings that could not be read, and why.
    pub failed: Vec<FailedRecording>,
    /// Where the stage stood.
    pub stages: Stages,
    /// What contradicts the experiment, before work and by the tracks.
    pub findings: Vec<Finding>,
}

/// A recording that was tracked.
#[derive(Clone)]
pub struct TrackedRecording {
    /// Its row of the trials table.
    pub trial: Trial,
    /// The tracks.
    pub tracks: RecordingTracks,
    /// From its pictures to the chain.
    pub(crate) map: ChainMap,
    /// Where the tracks come from.
    pub origin: Origin,
    /// What the file says against itself.
    pub(crate) remarks: Vec<String>,
}

impl TrackedRecording {
    /// A coordinate of its bodies by a map of its pictures, each line of which is exposed `line_time_s` after the one above.
    pub(crate) fn observation_of(
        &self,
        coordinate: Coordinate,
        map: &PlaneMap,
        line_time_s: f64,
    ) -> Observation {
        self.tracks.observation_of(coordinate, &self.trial, map, line_time_s)
    }
}

/// Where the tracks of a recording come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// They were kept.
    Kept,
    /// They were made, as nothing was kept under their key: the parts of the key in which what is kept of the same recording differs.
    New(Vec<&'static str>),
    /// They were made anew, as what was kept is torn: what is wrong with it.
    Torn(String),
}
