//! What is shown: recordings by name, opened when they are first looked at.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use chainwave_camera::OpenOptions;
use chainwave_measurement::{Recording, Subset};

use crate::refusal::Refusal;
use crate::review::Review;
use crate::set_up::ExperimentDraft;
use crate::wave::ShownWave;

/// Recordings that are kept open. Those that are decoded keep their frame, the others a mapping.
const MOST_OPEN: usize = 4;

/// Recordings to show, with a title.
#[derive(Debug, Clone, Default)]
pub struct Collection {
    /// What they are: the name of an experiment, a folder or a file.
    pub title: String,
    /// The recordings, in the order in which they are listed.
    pub recordings: Vec<ShownRecording>,
    /// What is to be said before anything else, such as recordings that are named and not there.
    pub notes: Vec<String>,
    /// Readings to look at, where there are results.
    pub review: Option<Review>,
    /// What was measured, where there are results.
    pub wave: Option<ShownWave>,
    /// How an experiment is set up from these recordings, where none is.
    pub set_up: Option<ExperimentDraft>,
}

/// A recording to show, and what is drawn on it.
#[derive(Debug, Clone)]
pub struct ShownRecording {
    /// Its name in the list, such as `view 1, trial 2`.
    pub name: String,
    /// Where it lies.
    pub path: PathBuf,
    /// How it is opened.
    pub options: OpenOptions,
    /// Subsets in the rest frame.
    pub subsets: Vec<Subset>,
    /// Where subsets were found in each frame; empty where nothing was tracked.
    pub tracks: Vec<ShownTrack>,
}

/// Where a subset's centre was found.
#[derive(Debug, Clone)]
pub struct ShownTrack {
    /// The subset's name.
    pub name: String,
    /// Columns and rows on each side of its centre.
    pub half_px: [usize; 2],
    /// Column and row in each frame; `None` where it is lost.
    pub places_px: Vec<Option<[f64; 2]>>,
}

impl ShownRecording {
    /// A recording with nothing drawn on it, under its file's name.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Self { name, path, options: OpenOptions::default(), subsets: Vec::new(), tracks: Vec::new() }
    }
}

/// The recordings that were looked at last, the latest first.
#[derive(Default)]
pub(crate) struct OpenRecordings(Mutex<Vec<(usize, Arc<dyn Recording>)>>);

impl OpenRecordings {
    /// The recording at a place of the list.
    ///
    /// Another thread may open the same one meanwhile; both then serve, and one of them stays.
    pub(crate) fn get(&self, index: usize, shown: &ShownRecording) -> Result<Arc<dyn Recording>, Refusal> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        {
            let mut open = kept();
            if let Some(at) = open.iter().position(|(found, _)| *found == index) {
                open[..=at].rotate_right(1);
                return Ok(Arc::clone(&open[0].1));
            }
        }
        let recording = chainwave_camera::open_with(&shown.path, &shown.options)
            .map_err(|error| Refusal::of_file(&shown.path, &error))?;
        let recording: Arc<dyn Recording> = Arc::from(recording);
        let mut open = kept();
        open.insert(0, (index, Arc::clone(&recording)));
        open.truncate(MOST_OPEN);
        Ok(recording)
    }
}
