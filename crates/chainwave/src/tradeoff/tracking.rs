//! The ladder of tracking methods on a scene.

use std::time::Instant;

use chainwave_correlation::{Method, Settings, self_test};
use chainwave_experiment::View;
use chainwave_measurement::{Excerpt, Recording};

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
    let n_frames = scene.recording.info().n_frames.min(TIMED_FRAMES);
    let head = Excerpt::new(scene.recording.as_ref(), (0..n_frames).collect());
    let mut shortest_s = f64::INFINITY;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        method.track(&head, &scene.subsets, &scene.reference, settings, &|_| ())?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
    }
    Ok((shortest_s, (n_frames * scene.subsets.len()) as u64))
}
