//! What is shown for a path: recordings as plain values, with subsets or tracks.

use std::collections::BTreeMap;
use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::ReferenceFrames;
use chainwave_experiment::{Setup, planned_view, subsets_in};
use chainwave_view::{Collection, ShownRecording, ShownTrack};

use crate::cli;
use crate::error::Error;
use crate::listing::recordings_in;
use crate::on_demand;
use crate::table;
use crate::track::read_points;

/// Tables that `run` leaves.
const TRACKS: &str = "tracks.parquet";
const PROVENANCE: &str = "provenance.toml";

/// Recordings for a recording, a folder of them, an experiment or the results of one.
pub(crate) fn collection(arguments: &cli::View) -> Result<Collection, Error> {
    let path = &arguments.path;
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return of_experiment(arguments);
    }
    if path.join(TRACKS).is_file() {
        return of_results(arguments);
    }
    let options = arguments.reading.options(arguments.rate_hz);
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
    Ok(Collection { title, recordings, notes: failed.iter().map(ToString::to_string).collect() })
}

/// The recordings of the trials table, with the subsets that are followed in each.
fn of_experiment(arguments: &cli::View) -> Result<Collection, Error> {
    let mut setup = Setup::read(&arguments.path, arguments.recordings.as_deref())?;
    setup.takes_partial = arguments.reading.partial;
    on_demand::expect_recordings_of(&setup)?;
    let (mut recordings, mut notes) = (Vec::new(), Vec::new());
    for trial in &setup.trials {
        match planned_view(&setup, trial) {
            Ok(view) => recordings.push(ShownRecording {
                name: format!("view {}, trial {}: {}", trial.view, trial.trial, trial.recording),
                options: view.options,
                subsets: view.subsets,
                ..ShownRecording::new(view.path)
            }),
            Err(error) => notes.push(error.to_string()),
        }
    }
    if recordings.is_empty() {
        let reason = notes.first().map_or("trials.csv names none", String::as_str);
        return Err(Error::Argument(format!("no recording can be shown: {reason}")));
    }
    Ok(Collection { title: setup.experiment.name, recordings, notes })
}

/// The recordings that a run tracked, with where it found the bodies.
fn of_results(arguments: &cli::View) -> Result<Collection, Error> {
    let results = &arguments.path;
    let Some(folder) = &arguments.recordings else {
        return Err(Error::Argument(format!(
            "{}: expected --recordings FOLDER beside a folder of results, which names its recordings and not where they lie",
            results.display()
        )));
    };
    let provenance = provenance(&results.join(PROVENANCE))?;
    let half = |key: &str| whole(&provenance, &["experiment", "tracking", key]).unwrap_or(16);
    let half_px = [half("half_width_px"), half("half_height_px")];
    let camera = provenance.get("experiment").and_then(|experiment| experiment.get("camera"));
    let rate_hz = camera.and_then(|camera| camera.get("rate_hz")).and_then(toml::Value::as_float);
    let options = arguments.reading.options(arguments.rate_hz.or(rate_hz));
    let tracks = tracks(&results.join(TRACKS), half_px)?;
    on_demand::expect_readable(tracks.keys().map(|name| folder.join(name)), &options)?;
    let (mut recordings, mut notes) = (Vec::new(), Vec::new());
    for (name, tracks) in tracks {
        let path = folder.join(&name);
        match path.exists() {
            true => recordings.push(ShownRecording {
                name,
                options: options.clone(),
                tracks,
                ..ShownRecording::new(path)
            }),
            false => notes.push(format!("{}: tracked, and not there", path.display())),
        }
    }
    let title = results.file_name().unwrap_or(results.as_os_str()).to_string_lossy().into_owned();
    match recordings.is_empty() {
        true => Err(Error::Argument(format!(
            "{}: expected the recordings that {} names, found none of them",
            folder.display(),
            TRACKS
        ))),
        false => Ok(Collection { title, recordings, notes }),
    }
}

fn provenance(path: &Path) -> Result<toml::Table, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::file(path, "read"))?;
    text.parse().map_err(|wrong: toml::de::Error| Error::configuration(path, wrong.to_string()))
}

/// A whole number from 0 at a place of a table.
fn whole(table: &toml::Table, [first, second, last]: &[&str; 3]) -> Option<usize> {
    let value = table.get(*first)?.get(*second)?.get(*last)?;
    usize::try_from(value.as_integer()?).ok()
}

/// The tracks of each recording, in the order of their names.
fn tracks(path: &Path, half_px: [usize; 2]) -> Result<BTreeMap<String, Vec<ShownTrack>>, Error> {
    let table = table::read(path)?;
    let (recordings, names) = (table.texts("recording")?, table.texts("name")?);
    let (frames, x_px, y_px) = (table.full_numbers("frame")?, table.numbers("x_px")?, table.numbers("y_px")?);
    let mut all: BTreeMap<String, Vec<ShownTrack>> = BTreeMap::new();
    for (row, (recording, name)) in recordings.into_iter().zip(names).enumerate() {
        let tracks = all.entry(recording).or_default();
        // The rows of a track follow each other, frame by frame.
        if tracks.last().is_none_or(|last| last.name != name) {
            tracks.push(ShownTrack { name, half_px, places_px: Vec::new() });
        }
        let places = tracks.last_mut().map(|last| &mut last.places_px);
        if let Some(places) = places.filter(|places| places.len() as f64 <= frames[row]) {
            places.resize(frames[row] as usize, None);
            places.push(x_px[row].zip(y_px[row]).map(Into::into));
        }
    }
    Ok(all)
}
