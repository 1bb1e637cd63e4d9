//! `chainwave track`: points followed through recordings.

use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::{METHODS, Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, Position, Recording, Subset, Track};
use indicatif::ProgressBar;
use polars::prelude::Column;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::expect_folder_of;
use crate::parallel::map_in_parallel;
use crate::progress;
use crate::table::{self, Table, column};

/// Follows points through every recording, writes the tracks, and names the recordings that failed.
pub(crate) fn track(arguments: &cli::Track) -> Result<Outcome, Error> {
    let subsets = read_points(&arguments.points)?;
    let method = chosen_method(arguments)?;
    expect_folder_of(&arguments.out)?;
    let recordings: Vec<String> =
        arguments.recordings.iter().map(|path| path.display().to_string()).collect();
    let bar = progress::bar("tracking", 0);
    let reference = ReferenceFrames::Single(arguments.reference);
    let of_recording = |path: &std::path::PathBuf| -> Result<Tracked, Error> {
        let options = OpenOptions { rate_hz: arguments.rate_hz, ..OpenOptions::default() };
        let recording = chainwave_camera::open_with(path, &options)?;
        follow(recording.as_ref(), &subsets, &reference, method, &bar)
    };
    let results = map_in_parallel(arguments.jobs, &arguments.recordings, of_recording);
    bar.finish_and_clear();
    let mut outcome = Outcome::default();
    let mut rows = TrackRows::default();
    for (name, result) in recordings.iter().zip(results) {
        match result {
            Ok(tracked) => rows.add(name, &tracked),
            Err(error) => outcome.fail(error),
        }
    }
    if outcome.n_failures() == recordings.len() {
        return Err(Error::NothingLeft { what: "recordings", n: recordings.len() });
    }
    rows.write(&arguments.out)?;
    Ok(outcome)
}

/// The tracks of one recording, with its time stamps.
pub(crate) struct Tracked {
    /// Time of each frame after the trigger, in seconds.
    pub(crate) times_s: Vec<f64>,
    /// One track for each subset.
    pub(crate) tracks: Vec<Track>,
}

/// Follows subsets through an opened recording.
pub(crate) fn follow(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    method: Method,
    bar: &ProgressBar,
) -> Result<Tracked, Error> {
    bar.inc_length((subsets.len() * recording.info().n_frames) as u64);
    let tracks = method.track(recording, subsets, reference, &Settings::default(), &|n| bar.inc(n))?;
    Ok(Tracked { times_s: recording.info().times_s.clone(), tracks })
}

/// The method that --method names, or the one of --shape and --interpolation.
fn chosen_method(arguments: &cli::Track) -> Result<Method, Error> {
    if let Some(name) = &arguments.method {
        let unknown = || format!("--method {name}: expected one of {}", METHODS.join(", "));
        return name.parse().map_err(|_unknown| Error::Argument(unknown()));
    }
    let usual = Settings::default();
    let shape = arguments.shape.as_deref().map(str::parse).transpose()?.unwrap_or(usual.shape);
    let interpolation =
        arguments.interpolation.as_deref().map(str::parse).transpose()?.unwrap_or(usual.interpolation);
    Ok(Method::IcGn { interpolation, shape })
}

fn read_points(path: &Path) -> Result<Vec<Subset>, Error> {
    let table = Table::read(path)?;
    let names = table.texts("name")?;
    let (x_px, y_px) = (table.full_numbers("x_px")?, table.full_numbers("y_px")?);
    let (half_widths, half_heights) = (table.counts("half_width_px")?, table.counts("half_height_px")?);
    let subset = |(row, name): (usize, String)| Subset {
        name,
        x_px: x_px[row],
        y_px: y_px[row],
        half_width_px: half_widths[row],
        half_height_px: half_heights[row],
    };
    let subsets: Vec<Subset> = names.into_iter().enumerate().map(subset).collect();
    match subsets.is_empty() {
        true => Err(table.cell(0, "name", "at least one point", "none")),
        false => Ok(subsets),
    }
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
    zncc: Vec<Option<f64>>,
    iterations: Vec<Option<u32>>,
    status: Vec<&'static str>,
}

impl TrackRows {
    /// Adds the tracks of one recording.
    pub(crate) fn add(&mut self, recording: &str, tracked: &Tracked) {
        for track in &tracked.tracks {
            for (frame, (position, time_s)) in track.positions.iter().zip(&tracked.times_s).enumerate() {
                self.recording.push(recording.to_owned());
                self.name.push(track.name.clone());
                self.frame.push(frame as u32);
                self.t_s.push(*time_s);
                self.add_position(position);
            }
        }
    }

    fn add_position(&mut self, position: &Result<Position, Lost>) {
        let found = position.as_ref().ok();
        self.x_px.push(found.map(|position| position.x_px.value));
        self.y_px.push(found.map(|position| position.y_px.value));
        self.sigma_x_px.push(found.map(|position| position.x_px.sigma));
        self.sigma_y_px.push(found.map(|position| position.y_px.sigma));
        self.zncc.push(found.map(|position| position.zncc));
        self.iterations.push(found.map(|position| position.iterations));
        self.status.push(position.as_ref().err().map_or("ok", |lost| lost.as_str()));
    }

    /// Writes the table.
    pub(crate) fn write(self, path: &Path) -> Result<(), Error> {
        table::write(path, self.columns())
    }

    fn columns(self) -> Vec<Column> {
        vec![
            column("recording", self.recording),
            column("name", self.name),
            column("frame", self.frame),
            column("t_s", self.t_s),
            column("x_px", self.x_px),
            column("y_px", self.y_px),
            column("sigma_x_px", self.sigma_x_px),
            column("sigma_y_px", self.sigma_y_px),
            column("zncc", self.zncc),
            column("iterations", self.iterations),
            column("status", self.status),
        ]
    }
}
