//! What is shown for a path: recordings as plain values, with subsets or tracks.

use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::ReferenceFrames;
use chainwave_experiment::{Setup, planned_view, subsets_in};
use chainwave_view::{Collection, ShownRecording};

use crate::check::said_of;
use crate::cli;
use crate::error::Error;
use crate::listing::recordings_in;
use crate::on_demand;
use crate::parallel::threads;
use crate::run::PROVENANCE;
use crate::run_files::TRACKS;
use crate::track::read_points;
use crate::view::results::of_results;
use crate::view::set_up;

/// Recordings for a recording, a folder of them, an experiment or the results of one.
pub(crate) fn collection(arguments: &cli::View) -> Result<Collection, Error> {
    let path = &arguments.path;
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return of_experiment(arguments);
    }
    if path.join(TRACKS).is_file() {
        return of_results(arguments);
    }
    if path.join(PROVENANCE).is_file() {
        return Err(Error::Argument(format!(
            "{}: expected the results of one striker velocity, found a folder of several (hint: view one of its folders striker-...)",
            path.display()
        )));
    }
    let options = arguments.reading.options(arguments.frame_rate.rate_hz);
    let mut collection = of_recordings(path, &options)?;
    if let Some(points) = &arguments.points {
        let points = read_points(points)?;
        for shown in &mut collection.recordings {
            let recording = chainwave_camera::open_with(&shown.path, &shown.options)?;
            let placed = subsets_in(recording.as_ref(), &points, &ReferenceFrames::Single(0), None)?;
            shown.subsets = placed.into_iter().map(|placed| placed.subset).collect();
        }
    }
    Ok(collection)
}

/// A recording, or those of a folder; a folder of images is one.
fn of_recordings(path: &Path, options: &OpenOptions) -> Result<Collection, Error> {
    let shown = |path: &Path| ShownRecording { options: options.clone(), ..ShownRecording::new(path) };
    let title = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let (found, failed) = match path.is_dir() {
        true => recordings_in(path, options)?,
        false => (Vec::new(), Vec::new()),
    };
    let recordings = match found.is_empty() {
        // What cannot be opened is said here and not first in the page.
        true => chainwave_camera::open_with(path, options).map(|_| vec![shown(path)])?,
        false => found.iter().map(|(path, _)| shown(path)).collect(),
    };
    let notes = failed.iter().map(ToString::to_string).collect();
    let listed = || found.iter().map(|(path, _)| path.clone()).collect();
    let set_up = (!found.is_empty()).then(|| set_up::of_folder(path, listed(), options.clone()));
    Ok(Collection { set_up, title, recordings, notes, ..Collection::default() })
}

/// The recordings of the trials table, with the subsets that are followed in each.
fn of_experiment(arguments: &cli::View) -> Result<Collection, Error> {
    let mut setup = Setup::read(&arguments.path, arguments.recordings.as_deref())?;
    setup.takes_partial = arguments.reading.partial;
    on_demand::expect_recordings_of(&setup)?;
    let (mut recordings, mut notes) = (Vec::new(), said_of(&setup, threads(None)));
    for trial in &setup.trials {
        match planned_view(&setup, trial) {
            Ok(view) => recordings.push(ShownRecording {
                name: format!("view {}, trial {}: {}", trial.view, trial.trial, trial.recording),
                options: view.options,
                subsets: view.subsets,
                ..ShownRecording::new(view.path)
            }),
            // A check says it of recordings already.
            Err(error) if !notes.iter().any(|said| said.contains(&error.to_string())) => {
                notes.push(error.to_string());
            }
            Err(_) => {}
        }
    }
    if recordings.is_empty() {
        let reason = notes.first().map_or("trials.csv names none", String::as_str);
        return Err(Error::Argument(format!("no recording can be shown: {reason}")));
    }
    Ok(Collection { title: setup.experiment.name, recordings, notes, ..Collection::default() })
}
