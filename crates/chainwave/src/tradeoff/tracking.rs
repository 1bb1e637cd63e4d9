//! The ladder of tracking methods on a scene.

use std::path::Path;
use std::time::Instant;

use chainwave_correlation::{Method, Settings, self_test};
use chainwave_experiment::View;
use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};

use super::Rung;
use crate::error::Error;
use crate::progress;

/// Frames of the recording that each method is timed on.
const TIMED_FRAMES: usize = 150;
/// Repetitions of which the shortest counts.
const REPETITIONS: usize = 3;

/// Every method on a scene: its error in the self-test, and its time on the recording's first frames.
pub(super) fn ladder(scene: &View) -> Result<Vec<Rung>, Error> {
    let settings = Settings::default();
    let methods = Method::all();
    let bar = progress::bar("methods", methods.len() as u64);
    let mut rungs = Vec::with_capacity(methods.len());
    for method in methods {
        let errors =
            self_test(&[method], scene.recording.as_ref(), &scene.subsets, &scene.reference, &settings)?;
        let (seconds, items) = timed(scene, method, &settings)?;
        for found in errors {
            let lost = if found.n_lost > 0 { format!("{} lost", found.n_lost) } else { String::new() };
            rungs.push(Rung {
                step: "tracking",
                method: method.to_string(),
                settings: lost,
                error: found.error_px,
                error_unit: "px",
                seconds_per_item: seconds / items as f64,
                items,
            });
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rungs)
}

/// Time in seconds that a method takes on one thread, and positions that it gave.
fn timed(scene: &View, method: Method, settings: &Settings) -> Result<(f64, u64), Error> {
    let head = Head::of(scene.recording.as_ref(), TIMED_FRAMES);
    let mut shortest_s = f64::INFINITY;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        method.track(&head, &scene.subsets, &scene.reference, settings, &|_| ())?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
    }
    Ok((shortest_s, (head.info.n_frames * scene.subsets.len()) as u64))
}

/// The first frames of a recording.
struct Head<'a> {
    recording: &'a dyn Recording,
    info: RecordingInfo,
}

impl<'a> Head<'a> {
    fn of(recording: &'a dyn Recording, n_frames: usize) -> Self {
        let info = recording.info();
        let n_frames = info.n_frames.min(n_frames);
        let times_s = info.times_s.iter().take(n_frames).copied().collect();
        Self { recording, info: RecordingInfo { n_frames, times_s, ..info.clone() } }
    }
}

impl Recording for Head<'_> {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.recording.read_region(frame, region, pixels)
    }
}
