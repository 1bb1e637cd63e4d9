//! `chainwave track`: points followed through recordings.

use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::Path;

use chainwave_correlation::{CorrelationError, Method, Reference, ReferenceFrames, SubsetSize, subset_size};
use chainwave_experiment::{
    Followed, FollowedSubset, Monitor, RecordingTracks, SensorFiles, Table, edges_beside, follow,
    threads_of_each,
};
use chainwave_figures::PointMotion;
use chainwave_measurement::{Estimate, Lost, Position, Recording, Subset, map_in_parallel};
use polars::prelude::Column;

use crate::choices::{Choices, ChosenSize, file_name, noise_px};
use crate::cli;
use crate::closing::{PointReadings, all_lost, closing_line};
use crate::error::Error;
use crate::matching::Chosen;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::progress;
use crate::table::{self, column};

/// Follows points through every recording, writes the tracks, names the recordings that failed, and closes with how well it went.
pub(crate) fn track(arguments: &cli::Track) -> Result<Outcome, Error> {
    let points = read_points(&arguments.points)?;
    let chosen = Chosen::of(&arguments.matching)?;
    table::expect_writable(&arguments.out)?;
    let files = &arguments.sensor;
    let options = arguments.reading.options(arguments.rate_hz);
    let sensor = SensorFiles::read(files.dark.as_deref(), files.flat.as_deref(), &options)?;
    let recordings: Vec<String> =
        arguments.recordings.iter().map(|path| path.display().to_string()).collect();
    let bar = progress::bar("tracking", 0);
    let show = progress::shown_on(&bar);
    let job = Job {
        arguments,
        points: &points,
        chosen,
        sensor: sensor.as_ref(),
        reference: ReferenceFrames::Single(arguments.reference),
        n_threads: threads_of_each(threads(arguments.jobs), recordings.len()),
        monitor: Monitor { on_progress: &show, ..Monitor::SILENT },
    };
    let results = map_in_parallel(recordings.len(), threads(arguments.jobs), |index| {
        job.carry_out(&arguments.recordings[index])
    });
    bar.finish_and_clear();
    let mut outcome = Outcome::default();
    let (mut told, mut done) = (BTreeSet::new(), Vec::new());
    let mut choices = Choices::new(arguments.matching.accuracy);
    for (name, result) in recordings.iter().zip(results) {
        match result {
            Ok(carried_out) => {
                let CarriedOut { tracked, notes, sizes, method } = carried_out;
                choices.add_sizes(sizes);
                if arguments.matching.accuracy.is_some() {
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
    if done.is_empty() {
        return Err(Error::nothing_left("recordings", recordings.len()));
    }
    expect_any_found(&done, arguments.reference)?;
    let mut rows = TrackRows::default();
    done.iter().for_each(|(name, tracked)| rows.add_points(name, tracked));
    rows.write(&arguments.out)?;
    if let Some(stem) = &arguments.picture {
        let moved: Vec<PointMotion> = done.iter().flat_map(|(_, tracked)| motions(tracked)).collect();
        chainwave_figures::tracks(stem, &moved)?;
    }
    if arguments.matching.accuracy.is_some() {
        done.iter()
            .filter_map(|(name, tracked)| loses_most(name, tracked))
            .for_each(|loss| outcome.fail(loss));
    }
    choices.write_beside(&arguments.out)?;
    choices.lines().iter().for_each(|line| print(line));
    print(&closing_line(&readings(&done), 0));
    Ok(outcome)
}

/// What came of one recording.
struct CarriedOut {
    tracked: Followed,
    /// What is to be said of it.
    notes: Vec<String>,
    /// Sizes of subsets that were left open.
    sizes: Vec<ChosenSize>,
    method: Method,
}

/// What every recording is tracked with.
struct Job<'a> {
    arguments: &'a cli::Track,
    points: &'a [PlacedPoint],
    chosen: Chosen,
    sensor: Option<&'a SensorFiles>,
    reference: ReferenceFrames,
    n_threads: NonZero<usize>,
    monitor: Monitor<'a>,
}

impl Job<'_> {
    /// Follows the points through one recording.
    fn carry_out(&self, path: &Path) -> Result<CarriedOut, Error> {
        let (arguments, reference) = (self.arguments, &self.reference);
        let opened = chainwave_camera::open_with(path, &arguments.reading.options(arguments.rate_hz))?;
        let recording = match self.sensor {
            Some(sensor) => sensor.correct(opened)?,
            None => opened,
        };
        let placed = subsets_in(recording.as_ref(), self.points, reference, arguments.matching.accuracy)?;
        let sizes = placed.iter().filter_map(|placed| placed.chosen_in(path)).collect();
        let subsets: Vec<Subset> = placed.into_iter().map(|placed| placed.subset).collect();
        let (inside, outside): (Vec<Subset>, Vec<Subset>) =
            subsets.iter().cloned().partition(|subset| Reference::lies_inside(recording.as_ref(), subset));
        let mut notes = recording.info().warnings.clone();
        notes.extend(outside.iter().map(|Subset { name, x_px, y_px, .. }| {
            format!("point {name} at ({x_px}, {y_px}): its subset reaches outside the image, so it is lost")
        }));
        notes.extend(edges_beside(recording.as_ref(), &inside, reference)?.iter().map(ToString::to_string));
        let method = self.chosen.method(recording.as_ref(), &inside, reference)?;
        let tracked = follow(recording.as_ref(), &subsets, reference, method, self.n_threads, &self.monitor)?;
        Ok(CarriedOut { tracked, notes, sizes, method })
    }
}

#[expect(clippy::print_stdout, reason = "what was tracked is no failure: standard error stays empty")]
fn print(line: &str) {
    println!("{line}");
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
            PointReadings::new(name, one.track.positions.iter().map(|found| found.as_ref().ok()))
        };
        tracked.tracks.iter().map(of_track).collect()
    };
    done.iter().flat_map(of_recording).collect()
}

/// Name of a coordinate, and how it is read from a position.
type Coordinate = (&'static str, fn(&Position) -> Estimate);

/// How far each point moved along columns and rows from where it was first seen.
fn motions(followed: &Followed) -> Vec<PointMotion> {
    let coordinates: [Coordinate; 2] = [("x", |position| position.x_px), ("y", |position| position.y_px)];
    let of_track = |one: &FollowedSubset| {
        let track = &one.track;
        coordinates.map(|(coordinate, of)| {
            let seen: Vec<Option<Estimate>> =
                track.positions.iter().map(|position| position.as_ref().ok().map(of)).collect();
            let first_px = seen.iter().flatten().next().map_or(0.0, |first| first.value);
            let from_first = |place: Estimate| Estimate::new(place.value - first_px, place.sigma);
            let samples =
                followed.times_s.iter().copied().zip(seen.iter().map(|place| place.map(from_first)));
            PointMotion { name: format!("{}, {coordinate}", track.name), samples: samples.collect() }
        })
    };
    followed.tracks.iter().flat_map(of_track).collect()
}

/// Half size of a subset of no given size that lies in no frame.
const LEAST_HALF_PX: usize = 5;

/// A point to follow; the size of its subset may be left open.
pub(crate) struct PlacedPoint {
    name: String,
    place_px: [f64; 2],
    half_px: [Option<usize>; 2],
}

impl PlacedPoint {
    /// The subset in a recording: of the given size, or of one that the texture, the frame and the other points ask for.
    fn placed(
        &self,
        recording: &dyn Recording,
        others: &[[f64; 2]],
        reference: &ReferenceFrames,
        error_px: f64,
    ) -> Result<PlacedSubset, Error> {
        let [width, height] = self.half_px;
        let chosen = match width.or(height) {
            Some(_) => None,
            None => match subset_size(recording, self.place_px, others, reference, error_px) {
                // No subset fits there: the point is lost, whatever the size.
                Err(CorrelationError::SubsetOutside { .. }) => None,
                found => Some(found?),
            },
        };
        let [x_px, y_px] = self.place_px;
        let given = |half: Option<usize>, other: Option<usize>| half.or(other).unwrap_or(LEAST_HALF_PX);
        let (half_width_px, half_height_px) = match chosen {
            Some(size) => (size.half_width_px, size.half_height_px),
            None => (given(width, height), given(height, width)),
        };
        let subset = Subset { name: self.name.clone(), x_px, y_px, half_width_px, half_height_px };
        Ok(PlacedSubset { subset, chosen })
    }
}

/// A subset, and how its size was chosen where it was left open.
pub(crate) struct PlacedSubset {
    pub(crate) subset: Subset,
    chosen: Option<SubsetSize>,
}

impl PlacedSubset {
    /// The choice, for a recording.
    fn chosen_in(&self, recording: &Path) -> Option<ChosenSize> {
        let Subset { name, half_width_px, half_height_px, .. } = &self.subset;
        self.chosen.map(|chosen| ChosenSize {
            recording: file_name(recording),
            point: name.clone(),
            half_width_px: *half_width_px,
            half_height_px: *half_height_px,
            step_px: None,
            noise_px: chosen.floor_px,
            reason: chosen.reason.to_string(),
        })
    }
}

/// The subsets around points; one of no given size is as small as an error (0.01 px where none is asked for) allows.
pub(crate) fn subsets_in(
    recording: &dyn Recording,
    points: &[PlacedPoint],
    reference: &ReferenceFrames,
    error_px: Option<f64>,
) -> Result<Vec<PlacedSubset>, Error> {
    let error_px = noise_px(error_px);
    let all: Vec<[f64; 2]> = points.iter().map(|point| point.place_px).collect();
    let one = |(i, point): (usize, &PlacedPoint)| {
        let others = [&all[..i], &all[i + 1..]].concat();
        point.placed(recording, &others, reference, error_px)
    };
    points.iter().enumerate().map(one).collect()
}

/// Reads a table of points.
pub(crate) fn read_points(path: &Path) -> Result<Vec<PlacedPoint>, Error> {
    let table = table::read(path)?;
    let names = table.texts("name")?;
    if let Some(row) = (1..names.len()).find(|row| names[..*row].contains(&names[*row])) {
        return Err(table.cell(row, "name", "each name once", &names[row]).into());
    }
    let (x_px, y_px) = (table.full_numbers("x_px")?, table.full_numbers("y_px")?);
    let halves = |name: &str| -> Result<Vec<Option<usize>>, Error> {
        let whole = |value: f64| value >= 0.0 && value.fract() == 0.0 && value < 1e6;
        let half = |(row, value): (usize, Option<f64>)| match value {
            Some(value) if !whole(value) => {
                Err(table.cell(row, name, "a whole number from 0, or nothing", &value.to_string()).into())
            }
            value => Ok(value.map(|value| value as usize)),
        };
        table.numbers(name)?.into_iter().enumerate().map(half).collect()
    };
    let (half_widths, half_heights) = match sizes_left_out(&table) {
        true => (vec![None; names.len()], vec![None; names.len()]),
        false => (halves("half_width_px")?, halves("half_height_px")?),
    };
    let point = |(row, name): (usize, String)| PlacedPoint {
        name,
        place_px: [x_px[row], y_px[row]],
        half_px: [half_widths[row], half_heights[row]],
    };
    let points: Vec<PlacedPoint> = names.into_iter().enumerate().map(point).collect();
    match points.is_empty() {
        true => Err(table.cell(0, "name", "at least one point", "none").into()),
        false => Ok(points),
    }
}

/// Whether a table of points has no column of sizes, nor one that may be meant for one.
fn sizes_left_out(table: &Table) -> bool {
    !table.names().any(|name| name.contains("half"))
}

/// The rows of a table of tracks.
#[derive(Default)]
pub(crate) struct TrackRows {
    recording: Vec<String>,
    name: Vec<String>,
    frame: Vec<u32>,
    t_s: Vec<f64>,
    x_px: Vec<Option<f64>>,
    y_px: Vec<Option<f64>>,
    sigma_x_px: Vec<Option<f64>>,
    sigma_y_px: Vec<Option<f64>>,
    theta_rad: Vec<Option<f64>>,
    sigma_theta_rad: Vec<Option<f64>>,
    zncc: Vec<Option<f64>>,
    iterations: Vec<Option<u32>>,
    status: Vec<&'static str>,
    method: Vec<String>,
}

impl TrackRows {
    /// Adds the points of one recording.
    pub(crate) fn add_points(&mut self, recording: &str, followed: &Followed) {
        for one in &followed.tracks {
            self.add(recording, &one.track.name, &one.method, &followed.times_s, &one.track.positions);
        }
    }

    /// Adds the bodies of one recording.
    pub(crate) fn add_bodies(&mut self, recording: &str, tracks: &RecordingTracks) {
        for one in &tracks.bodies {
            self.add(recording, &one.body.to_string(), &one.method, &tracks.times_s, &one.positions);
        }
    }

    fn add(
        &mut self,
        recording: &str,
        name: &str,
        method: &str,
        times_s: &[f64],
        positions: &[Result<Position, Lost>],
    ) {
        for (frame, (position, time_s)) in positions.iter().zip(times_s).enumerate() {
            self.recording.push(recording.to_owned());
            self.name.push(name.to_owned());
            self.frame.push(frame as u32);
            self.t_s.push(*time_s);
            self.add_position(position);
            self.method.push(method.to_owned());
        }
    }

    fn add_position(&mut self, position: &Result<Position, Lost>) {
        let found = position.as_ref().ok();
        self.x_px.push(found.map(|position| position.x_px.value));
        self.y_px.push(found.map(|position| position.y_px.value));
        self.sigma_x_px.push(found.map(|position| position.x_px.sigma));
        self.sigma_y_px.push(found.map(|position| position.y_px.sigma));
        let theta_rad = found.and_then(|position| position.theta_rad);
        self.theta_rad.push(theta_rad.map(|theta| theta.value));
        self.sigma_theta_rad.push(theta_rad.map(|theta| theta.sigma));
        self.zncc.push(found.map(|position| position.zncc));
        self.iterations.push(found.map(|position| position.iterations));
        self.status.push(position.as_ref().err().map_or("ok", |lost| lost.as_str()));
    }

    /// Writes the table.
    pub(crate) fn write(self, path: &Path) -> Result<(), Error> {
        table::write(path, self.columns())
    }

    /// The columns of the table.
    pub(crate) fn columns(self) -> Vec<Column> {
        vec![
            column("recording", self.recording),
            column("name", self.name),
            column("frame", self.frame),
            column("t_s", self.t_s),
            column("x_px", self.x_px),
            column("y_px", self.y_px),
            column("sigma_x_px", self.sigma_x_px),
            column("sigma_y_px", self.sigma_y_px),
            column("theta_rad", self.theta_rad),
            column("sigma_theta_rad", self.sigma_theta_rad),
            column("zncc", self.zncc),
            column("iterations", self.iterations),
            column("status", self.status),
            column("method", self.method),
        ]
    }
}
