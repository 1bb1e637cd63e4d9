//! `chainwave track`: points followed through recordings.

use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::{Path, PathBuf};

use chainwave_correlation::ReferenceFrames;
use chainwave_experiment::{
    Followed, FollowedPoints, FollowedSubset, MethodChoice, Monitor, PlacedPoint, PlacedSubset,
    PointTracking, SensorFiles, TrackRows, threads_of_each, unreadable_frames,
};
use chainwave_figures::PointMotion;
use chainwave_measurement::{Estimate, Lost, Position, Recording, Subset, map_in_parallel};
use serde_json::json;

use crate::choices::{Choices, ChosenSize, file_name};
use crate::cli;
use crate::closing_line::{PointReadings, all_lost, closing_json, closing_line};
use crate::error::Error;
use crate::matching;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_each_once, expect_folder_of};
use crate::parallel::threads;
use crate::progress;
use crate::saturation::saturation;
use crate::table;
use crate::terminal::{say, tell};

/// Follows points through every recording, writes the tracks, names the recordings that failed, and closes with how well it went.
pub(crate) fn track(arguments: &cli::Track) -> Result<Outcome, Error> {
    let points = read_points(&arguments.points)?;
    let choice = matching::choice(&arguments.matching)?;
    let options = arguments.reading.options(arguments.frame_rate.rate_hz);
    on_demand::expect_readable(&arguments.recordings, &options)?;
    let left_out = match choice.accuracy_px() {
        Some(_) => on_demand::expect_all_methods()?,
        None => None,
    };
    table::expect_writable(&arguments.out)?;
    let picture = arguments.picture.as_deref().map(stem_of_picture).transpose()?;
    picture.iter().try_for_each(|stem| expect_folder_of(stem))?;
    expect_files_apart(arguments, picture.as_deref())?;
    let cli::Sensor { dark, flat } = &arguments.sensor;
    let sensor = SensorFiles::read(dark.as_deref(), flat.as_deref(), &options)?;
    let recordings: Vec<String> =
        arguments.recordings.iter().map(|path| path.display().to_string()).collect();
    let bar = progress::bar("tracking", 0);
    let show = progress::shown_on(&bar);
    let job = Job {
        arguments,
        points: &points,
        choice,
        sensor: sensor.as_ref(),
        reference: ReferenceFrames::Single(arguments.reference),
        n_threads: threads_of_each(threads(arguments.jobs), recordings.len()),
        monitor: Monitor { on_progress: &show, ..Monitor::SILENT },
    };
    let results = map_in_parallel(recordings.len(), threads(arguments.jobs), |index| {
        job.carry_out(&arguments.recordings[index])
    });
    bar.finish_and_clear();
    let Found { mut outcome, choices, done } = Found::of(&recordings, results, arguments.matching.accuracy);
    if done.is_empty() {
        return Err(Error::nothing_left("recordings", recordings.len()));
    }
    expect_any_found(&done, arguments.reference)?;
    let mut rows = TrackRows::default();
    done.iter().for_each(|(name, tracked)| rows.add_points(name, tracked));
    table::write_result(&arguments.out, rows.table())?;
    if let Some(stem) = &picture {
        draw(stem, &done)?;
    }
    if arguments.matching.accuracy.is_some() {
        let losses = done.iter().filter_map(|(name, tracked)| loses_most(name, tracked));
        losses.for_each(|loss| outcome.fail(loss));
    }
    choices.write_beside(&arguments.out)?;
    left_out.iter().chain(&choices.lines()).for_each(|line| print(line));
    let readings = readings(&done);
    print(&closing_line(&readings, &[]));
    tell("readings", closing_json(&readings, 0));
    tell("out", json!(arguments.out));
    Ok(outcome)
}

/// What was found in the recordings.
struct Found<'a> {
    outcome: Outcome,
    choices: Choices,
    /// What was followed, by the recording's name.
    done: Vec<(&'a str, Followed)>,
}

impl<'a> Found<'a> {
    /// Of recordings by their names; failures and notes are said.
    fn of(recordings: &'a [String], results: Vec<Result<Carried, Error>>, accuracy_px: Option<f64>) -> Self {
        let mut outcome = Outcome::default();
        let (mut told, mut done) = (BTreeSet::new(), Vec::new());
        let mut choices = Choices::new(accuracy_px);
        for (name, result) in recordings.iter().zip(results) {
            match result {
                Ok(Carried { found, unread }) => {
                    unread.iter().for_each(|unread| outcome.fail(format!("{name}: {unread}")));
                    let FollowedPoints { followed: tracked, notes, placed, method } = found;
                    choices.add_sizes(placed.iter().filter_map(|placed| chosen_in(placed, Path::new(name))));
                    if accuracy_px.is_some() {
                        choices.add_method(Path::new(name), method);
                    }
                    // once for each thing that is said, however many recordings give cause to say it
                    let new = notes.into_iter().filter(|note| told.insert(note.clone()));
                    new.for_each(|note| print(&format!("warning: {name}: {note}")));
                    done.push((name.as_str(), tracked));
                }
                Err(error) => outcome.fail(error),
            }
        }
        Self { outcome, choices, done }
    }
}

/// Endings of pictures and pages that no figure is written as here.
const OTHER_PICTURES: [&str; 10] = ["jpg", "jpeg", "gif", "tif", "tiff", "bmp", "webp", "pdf", "eps", "ps"];

/// The name of a figure without the ending of one of its files. A dot that no ending follows stays part of the name.
///
/// # Errors
/// The ending of a picture that is not written.
fn stem_of_picture(path: &Path) -> Result<PathBuf, Error> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if chainwave_figures::files_of(Path::new("stem")).iter().any(|file| file.extension() == Some(&ending)) {
        return Ok(path.with_extension(""));
    }
    match OTHER_PICTURES.iter().any(|other| ending == *other) {
        false => Ok(path.to_owned()),
        true => Err(Error::Argument(format!(
            "{}: --picture: expected a name that ends in .svg or .png, or in none of a picture's endings, found .{}",
            path.display(),
            ending.display()
        ))),
    }
}

/// Draws what was followed.
fn draw(stem: &Path, done: &[(&str, Followed)]) -> Result<(), Error> {
    // One axis of time needs the rate of each recording.
    let in_frames = done.iter().any(|(_, tracked)| !tracked.has_rate);
    let of_recording = |(_, tracked): &(&str, Followed)| motions(tracked, in_frames);
    let moved: Vec<PointMotion> = done.iter().flat_map(of_recording).collect();
    Ok(chainwave_figures::tracks(stem, &moved)?)
}

/// Refuses a recording that is named twice, and a table or a picture in the place of another, or of a file that is read.
fn expect_files_apart(arguments: &cli::Track, picture: Option<&Path>) -> Result<(), Error> {
    let cli::Track { recordings, points, out, sensor, .. } = arguments;
    expect_each_once(recordings)?;
    let of_sensor = [&sensor.dark, &sensor.flat].into_iter().flatten();
    let read: Vec<&Path> = recordings.iter().chain([points]).chain(of_sensor).map(PathBuf::as_path).collect();
    let drawn = picture.into_iter().flat_map(chainwave_figures::files_of);
    let mut written = vec![("the table", out.clone()), ("what was chosen", Choices::path_beside(out))];
    written.extend(drawn.map(|path| ("a file of the picture", path)));
    expect_apart(&read, &written)
}

/// What every recording is tracked with.
struct Job<'a> {
    arguments: &'a cli::Track,
    points: &'a [PlacedPoint],
    choice: MethodChoice,
    sensor: Option<&'a SensorFiles>,
    reference: ReferenceFrames,
    n_threads: NonZero<usize>,
    monitor: Monitor<'a>,
}

/// What was followed through one recording.
struct Carried {
    found: FollowedPoints,
    /// Which of its frames could not be read.
    unread: Option<String>,
}

impl Job<'_> {
    /// Follows the points through one recording.
    fn carry_out(&self, path: &Path) -> Result<Carried, Error> {
        let arguments = self.arguments;
        let opened =
            chainwave_camera::open_with(path, &arguments.reading.options(arguments.frame_rate.rate_hz))?;
        let recording = match self.sensor {
            Some(sensor) => sensor.correct(opened)?,
            None => opened,
        };
        expect_reference(recording.as_ref(), arguments.reference)?;
        let &Self { points, choice, ref reference, n_threads, .. } = self;
        let tracking = PointTracking { points, choice, reference, n_threads };
        let mut found = tracking.follow(recording.as_ref(), &self.monitor)?;
        found.notes.extend(saturation(recording.as_ref()));
        let positions = found.followed.tracks.iter().map(|one| one.track.positions.as_slice());
        let unread = unreadable_frames(recording.as_ref(), positions);
        Ok(Carried { found, unread })
    }
}

/// Refuses a reference frame that a recording does not have.
fn expect_reference(recording: &dyn Recording, reference: usize) -> Result<(), Error> {
    let n_frames = recording.info().n_frames;
    match reference < n_frames {
        true => Ok(()),
        false => {
            let path = recording.path().display();
            Err(Error::Argument(format!(
                "{path}: --reference: expected a frame below {n_frames}, found {reference}"
            )))
        }
    }
}

fn print(line: &str) {
    say!("{line}");
}

/// Refuses tracks that hold in no frame but the reference, where a point always finds itself.
fn expect_any_found(done: &[(&str, Followed)], reference: usize) -> Result<(), Error> {
    let elsewhere = |n_frames: usize, frame: usize| n_frames == 1 || frame != reference;
    let of_track = |one: &FollowedSubset| {
        let positions = &one.track.positions;
        (0..positions.len()).any(|frame| elsewhere(positions.len(), frame) && positions[frame].is_ok())
    };
    let tracks = || done.iter().flat_map(|(_, tracked)| &tracked.tracks);
    match tracks().any(of_track) {
        true => Ok(()),
        false => Err(all_lost(
            tracks().flat_map(|one| &one.track.positions).filter_map(|found| found.as_ref().err()),
        )),
    }
}

/// What is to be said of a recording of which more than a third of the readings in view is lost: its self-test saw another film than this.
fn loses_most(name: &str, tracked: &Followed) -> Option<String> {
    let in_view = || {
        let all = tracked.tracks.iter().flat_map(|one| &one.track.positions);
        all.filter(|found| !matches!(found, Err(Lost::OutOfView | Lost::NoTexture | Lost::Unreadable)))
    };
    let (n, n_lost) = (in_view().count(), in_view().filter(|found| found.is_err()).count());
    (3 * n_lost > n).then(|| {
        format!(
            "{name}: the method that was chosen for its accuracy loses {n_lost} of {n} readings in view (hint: --method names another, \
             --shape auto finds the shape function)"
        )
    })
}

/// What became of each point in each recording; of several, their names stand with it.
fn readings(done: &[(&str, Followed)]) -> Vec<PointReadings> {
    let of_recording = |(recording, tracked): &(&str, Followed)| -> Vec<PointReadings> {
        let of_track = |one: &FollowedSubset| {
            let name = match done.len() {
                1 => one.track.name.clone(),
                _ => format!("{} of {recording}", one.track.name),
            };
            PointReadings::new(name, one.track.positions.iter().map(Result::as_ref))
        };
        tracked.tracks.iter().map(of_track).collect()
    };
    done.iter().flat_map(of_recording).collect()
}

/// Name of a coordinate, and how it is read from a position.
type Coordinate = (&'static str, fn(&Position) -> Estimate);

/// How far each point moved along columns and rows from where it was first seen, over time or over the frames' numbers.
fn motions(followed: &Followed, in_frames: bool) -> Vec<PointMotion> {
    let times: Vec<f64> = match in_frames {
        true => (0..followed.times_s.len()).map(|frame| frame as f64).collect(),
        false => followed.times_s.clone(),
    };
    let coordinates: [Coordinate; 2] = [("x", |position| position.x_px), ("y", |position| position.y_px)];
    let of_track = |one: &FollowedSubset| {
        let track = &one.track;
        coordinates.map(|(coordinate, of)| {
            let seen: Vec<Option<Estimate>> =
                track.positions.iter().map(|position| position.as_ref().ok().map(of)).collect();
            let first_px = seen.iter().flatten().next().map_or(0.0, |first| first.value);
            let from_first = |place: Estimate| Estimate::new(place.value - first_px, place.sigma);
            let samples = times.iter().copied().zip(seen.iter().map(|place| place.map(from_first)));
            let name = format!("{}, {coordinate}", track.name);
            PointMotion { name, samples: samples.collect(), in_frames }
        })
    };
    followed.tracks.iter().flat_map(of_track).collect()
}

/// The choice of a subset's size, where it was left open, for a recording.
fn chosen_in(placed: &PlacedSubset, recording: &Path) -> Option<ChosenSize> {
    let Subset { name, half_width_px, half_height_px, .. } = &placed.subset;
    placed.chosen.map(|chosen| ChosenSize {
        recording: file_name(recording),
        point: name.clone(),
        half_width_px: *half_width_px,
        half_height_px: *half_height_px,
        step_px: None,
        noise_px: chosen.floor_px,
        reason: chosen.reason.to_string(),
    })
}

/// Reads a table of points.
pub(crate) fn read_points(path: &Path) -> Result<Vec<PlacedPoint>, Error> {
    Ok(PlacedPoint::of_table(&table::read(path)?)?)
}
