//! The ladder of tracking methods on a scene.

use std::time::Instant;

use chainwave_correlation::{FilmError, Method, RungError, Settings, film_test, self_test};
use chainwave_experiment::View;
use chainwave_measurement::Excerpt;

use super::Rung;
use crate::error::Error;
use crate::progress;

/// Frames of the recording that each method is timed on.
const TIMED_FRAMES: usize = 150;
/// Repetitions of which the shortest counts.
const REPETITIONS: usize = 3;

/// Every method that the program has on a scene: its error in the self-test or on the film itself, whichever is larger, and its time on the recording's first frames.
pub(super) fn ladder(scene: &View) -> Result<Vec<Rung>, Error> {
    let settings = Settings::default();
    let methods = Method::available();
    let View { subsets, reference, .. } = scene;
    let recording = scene.recording.as_ref();
    let on_film = film_test(&methods, recording, subsets, reference, &settings)?;
    let bar = progress::bar("methods", methods.len() as u64);
    let mut rungs = Vec::with_capacity(methods.len());
    for (method, film) in methods.into_iter().zip(&on_film) {
        let errors = self_test(&[method], recording, subsets, reference, &settings)?;
        let (seconds, items) = timed(scene, method, &settings)?;
        for found in errors {
            rungs.push(Rung {
                step: "tracking",
                method: method.to_string(),
                settings: lost(&found, film),
                error: larger_px(&found, film),
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

/// What a method lost, of patches that were shifted and of the film.
fn lost(shifted: &RungError, film: &FilmError) -> String {
    let counts = [(shifted.n_lost, "lost"), (film.n_lost as usize, "lost on the film")];
    let told: Vec<String> =
        counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    told.join(", ")
}

/// The larger of a method's errors, on shifted patches and on the film; none where it finds nothing on either. A film of its reference alone
/// says nothing.
fn larger_px(shifted: &RungError, film: &FilmError) -> Option<f64> {
    let of_film = match film.error_px {
        None if film.n_lost == 0 => Some(0.0),
        found => found,
    };
    shifted.error_px.zip(of_film).map(|(shifted_px, film_px)| shifted_px.max(film_px))
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
