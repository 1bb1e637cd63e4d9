use std::fs::File;
use std::io::Read;
use std::num::NonZero;
use std::ops::Range;
use std::path::Path;
use std::time::UNIX_EPOCH;

use chainwave_camera::{OpenOptions, PlaneMap};
use chainwave_correlation::{Method, ReferenceFrames};
use chainwave_measurement::{BodyTrack, Estimate, Observation, Recording, RecordingInfo, Subset};
use chainwave_stitching::Outlier;
use indicatif::ProgressBar;
use sha2::{Digest, Sha256};

use super::Job;
use super::notices::remarks;
use super::share::Share;
use super::stages::Stages;
use crate::error::Error;
use crate::experiment::{Positive, Trial};
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished};
use crate::parallel::map_in_parallel;
use crate::progress;
use crate::table::Table;
use crate::track::{TrackRows, edges_beside, follow, threads_of_each};

/// Changes whenever the same recording and settings would give other tracks, so that kept ones are not mistaken for them.
const TRACKS_VERSION: u32 = 2;

/// Rows and columns that a subset must keep from the frame's border at rest: the tracker interpolates around it.
const BORDER_PX: f64 = 4.0;

/// The tracks of all recordings that could be read.
pub(crate) struct Tracked {
    /// The kept tables, in the order of the trials.
    pub(crate) tables: Vec<Table>,
    /// The recordings that they belong to.
    pub(crate) trials: Vec<Trial>,
    /// The same as positions along the chain in metres.
    pub(crate) observations: Vec<Observation>,
    /// What the files say against themselves, by recording.
    pub(crate) remarks: Vec<(String, String)>,
    /// Where the stage stood.
    pub(crate) stages: Stages,
}

impl Tracked {
    /// The same without some recordings.
    pub(crate) fn without(&self, left_out: &[Outlier]) -> Self {
        let kept = |index: &usize| left_out.iter().all(|outlier| outlier.index != *index);
        let kept: Vec<usize> = (0..self.tables.len()).filter(kept).collect();
        Self {
            tables: kept.iter().map(|index| self.tables[*index].clone()).collect(),
            trials: kept.iter().map(|index| self.trials[*index].clone()).collect(),
            observations: kept.iter().map(|index| self.observations[*index].clone()).collect(),
            remarks: self.remarks.clone(),
            stages: self.stages.clone(),
        }
    }
}

/// Tracks every recording that has not been tracked yet, and names those that fail.
pub(crate) fn track_all(job: &Job, outcome: &mut Outcome) -> Result<Tracked, Error> {
    make_folder(&job.kept())?;
    remove_unfinished(&job.kept())?;
    remove_unfinished(&job.out)?;
    let stages = Stages::refine(job, method(job)?)?;
    let results = track_each(job, &job.trials, &stages)?;
    let (tables, trials, observations, remarks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut tracked = Tracked { tables, trials, observations, remarks, stages };
    for (trial, result) in job.trials.iter().zip(results) {
        match result {
            Ok((table, observation, remarks)) => {
                tracked.remarks.extend(remarks);
                tracked.tables.push(table);
                tracked.trials.push(trial.clone());
                tracked.observations.push(observation);
            }
            Err(error) => outcome.fail(error),
        }
    }
    match tracked.tables.is_empty() {
        true => Err(Error::NothingLeft { what: "recordings", n: job.trials.len() }),
        false => Ok(tracked),
    }
}

/// Tracks the recordings of a share that have not been tracked yet, for a run that evaluates all of them later, and names those
/// that fail; returns how many are tracked. What other processes are writing into the same folder is left alone.
pub(crate) fn track_share(job: &Job, share: Share, outcome: &mut Outcome) -> Result<usize, Error> {
    make_folder(&job.kept())?;
    let stages = Stages::refine(job, method(job)?)?;
    let results = track_each(job, &share.of(&job.trials), &stages)?;
    let n_tracked = results.iter().filter(|result| result.is_ok()).count();
    results.into_iter().filter_map(Result::err).for_each(|error| outcome.fail(error));
    Ok(n_tracked)
}

/// What one recording gave: its kept tracks, the same along the chain, and what was remarked of it.
type TrackedOne = Result<(Table, Observation, Vec<(String, String)>), Error>;

/// The tracks of some of the recordings, in their order, or why they have none.
fn track_each(job: &Job, trials: &[Trial], stages: &Stages) -> Result<Vec<TrackedOne>, Error> {
    let (kept, method) = (job.kept(), method(job)?);
    let bar = progress::bar("tracking", 0);
    let n_threads = threads_of_each(job.jobs, trials.len());
    let place = |trial: &Trial| Place { kept: &kept, stage_m: stages.placing_m(trial), method, n_threads };
    let results = map_in_parallel(job.jobs, trials, |trial| track_one(job, trial, &place(trial), &bar));
    bar.finish_and_clear();
    Ok(results)
}

/// The tracking method that the experiment names.
pub(crate) fn method(job: &Job) -> Result<Method, Error> {
    let tracking = &job.experiment.tracking;
    let configuration = |message: String| Error::Configuration {
        path: job.path.clone(),
        message: format!("tracking: {message}"),
    };
    let shape =
        tracking.shape.parse().map_err(|wrong: chainwave_correlation::CorrelationError| wrong.to_string());
    let interpolation = tracking
        .interpolation
        .parse()
        .map_err(|wrong: chainwave_correlation::CorrelationError| wrong.to_string());
    Ok(Method::IcGn {
        shape: shape.map_err(configuration)?,
        interpolation: interpolation.map_err(configuration)?,
    })
}

/// How a recording is tracked, and where its tracks are kept.
struct Place<'a> {
    kept: &'a Path,
    stage_m: f64,
    method: Method,
    n_threads: NonZero<usize>,
}

fn track_one(job: &Job, trial: &Trial, place: &Place, bar: &ProgressBar) -> TrackedOne {
    let path = job.recordings.join(&trial.recording);
    let recording = open(job, &path)?;
    let kept_path = place.kept.join(format!("{}.parquet", key(job, trial, place.stage_m, &path)?));
    let reference = frames_at_rest(job, recording.as_ref())?;
    let subsets = subsets_in_view(job, place.stage_m, recording.as_ref());
    if !kept_path.exists() {
        let tracked = follow(recording.as_ref(), &subsets, &reference, place.method, place.n_threads, bar)?;
        let mut rows = TrackRows::default();
        rows.add(&trial.recording, &tracked);
        rows.write(&kept_path)?;
    }
    let table = Table::read(&kept_path)?;
    let observation = observation(trial, &table, &job.calibration.of_chain.map)?;
    let edges = edges_beside(recording.as_ref(), &subsets, &reference)?;
    Ok((table, observation, remarks(&trial.recording, recording.info(), &edges)))
}

/// Opens a recording that the calibration holds for.
pub(crate) fn open(job: &Job, path: &Path) -> Result<Box<dyn Recording>, Error> {
    let rate_hz = job.experiment.camera.rate_hz.map(Positive::get);
    let recording = chainwave_camera::open_with(path, &OpenOptions { rate_hz, ..OpenOptions::default() })?;
    job.calibration.check_size(recording.as_ref())?;
    Ok(recording)
}

/// The frames of a recording before the wave.
pub(crate) fn frames_at_rest(job: &Job, recording: &dyn Recording) -> Result<ReferenceFrames, Error> {
    let rest = rest_frames(recording.info(), job.experiment.tracking.rest_until_s);
    Ok(ReferenceFrames::Mean(rest.ok_or_else(|| no_rest(job, recording.path(), recording.info()))?))
}

/// A recording with the subsets that are followed in it.
pub(crate) struct View {
    /// The recording.
    pub(crate) recording: Box<dyn Recording>,
    /// The subsets in its reference.
    pub(crate) subsets: Vec<Subset>,
    /// The reference.
    pub(crate) reference: ReferenceFrames,
}

/// The first recording that shows bodies, with their subsets and the frames at rest.
pub(crate) fn first_view(job: &Job) -> Result<View, Error> {
    for trial in &job.trials {
        let recording = open(job, &job.recordings.join(&trial.recording))?;
        let subsets = subsets_in_view(job, trial.stage_m, recording.as_ref());
        if !subsets.is_empty() {
            let reference = frames_at_rest(job, recording.as_ref())?;
            return Ok(View { recording, subsets, reference });
        }
    }
    Err(Error::NothingLeft { what: "recordings with a body in view", n: job.trials.len() })
}

/// The bodies whose subsets lie in the frame at rest.
pub(crate) fn subsets_in_view(job: &Job, stage_m: f64, recording: &dyn Recording) -> Vec<Subset> {
    let (info, tracking) = (recording.info(), &job.experiment.tracking);
    let inside = |centre: f64, half: usize, size: usize| {
        let reach = half as f64 + BORDER_PX;
        centre - reach >= 0.0 && centre + reach <= size as f64 - 1.0
    };
    (1..=job.experiment.chain.n_bodies)
        .filter_map(|body| Some((body, job.calibration.rest_px(body, stage_m)?)))
        .filter(|(_, [x_px, y_px])| {
            inside(*x_px, tracking.half_width_px, info.width_px)
                && inside(*y_px, tracking.half_height_px, info.height_px)
        })
        .map(|(body, [x_px, y_px])| Subset {
            name: body.to_string(),
            x_px,
            y_px,
            half_width_px: tracking.half_width_px,
            half_height_px: tracking.half_height_px,
        })
        .collect()
}

/// The frames before the wave: all from the first one that are stamped before `rest_until_s`.
fn rest_frames(info: &RecordingInfo, rest_until_s: f64) -> Option<Range<usize>> {
    let n = info.times_s.iter().take_while(|time_s| **time_s < rest_until_s).count();
    (n > 0).then_some(0..n)
}

fn no_rest(job: &Job, path: &Path, info: &RecordingInfo) -> Error {
    let first_s = info.times_s.first().copied().unwrap_or(f64::NAN);
    Error::Configuration {
        path: job.path.clone(),
        message: format!(
            "tracking.rest_until_s: expected frames of {} before {} s, found its first at {first_s} s \
             (hint: a later rest_until_s, or recordings with more pre-trigger frames)",
            path.display(),
            job.experiment.tracking.rest_until_s,
        ),
    }
}

/// Reads a recording's kept tracks as positions along the chain.
pub(crate) fn observation(trial: &Trial, table: &Table, map: &PlaneMap) -> Result<Observation, Error> {
    let (names, times_s) = (table.texts("name")?, table.full_numbers("t_s")?);
    let estimates = |value: &str, sigma: &str| -> Result<Vec<Option<Estimate>>, Error> {
        let pairs = table.numbers(value)?.into_iter().zip(table.numbers(sigma)?);
        Ok(pairs.map(|(value, sigma)| Some(Estimate::new(value?, sigma?))).collect())
    };
    let (x_px, y_px) = (estimates("x_px", "sigma_x_px")?, estimates("y_px", "sigma_y_px")?);
    let mut observation = Observation {
        recording: trial.recording.clone(),
        view: trial.view,
        trial: trial.trial,
        times_s: Vec::new(),
        bodies: Vec::new(),
    };
    for (row, name) in names.iter().enumerate() {
        let body =
            name.parse().map_err(|_not_a_number| table.cell(row, "name", "the number of a body", name))?;
        if observation.bodies.last().is_none_or(|track| track.body != body) {
            observation.bodies.push(BodyTrack { body, position_m: Vec::new() });
        }
        if observation.bodies.len() == 1 {
            observation.times_s.push(times_s[row]);
        }
        let position = x_px[row].zip(y_px[row]).map(|(x_px, y_px)| map.position_of(x_px, y_px));
        if let Some(track) = observation.bodies.last_mut() {
            track.position_m.push(position);
        }
    }
    Ok(observation)
}

/// What the tracks of a recording depend on, as a file name: settings, and the recording by size, time and first bytes.
fn key(job: &Job, trial: &Trial, stage_m: f64, path: &Path) -> Result<String, Error> {
    let experiment = &job.experiment;
    let mut hash = Sha256::new();
    let settings = (&experiment.chain, &experiment.camera, &experiment.tracking, stage_m, TRACKS_VERSION);
    let settings = serde_json::to_string(&settings).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    hash.update(settings.as_bytes());
    // Where bodies are looked for depends on the calibration, which may lie in another file.
    hash.update(format!("{:?}", job.calibration.of_chain.map).as_bytes());
    hash.update(fingerprint(path)?.as_bytes());
    let modified = std::fs::metadata(path).and_then(|metadata| metadata.modified());
    let modified = modified.map_err(Error::file(path, "read the time of"))?;
    let since_epoch = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
    hash.update(since_epoch.as_nanos().to_le_bytes());
    let stem: String = Path::new(&trial.recording).file_stem().unwrap_or_default().to_string_lossy().into();
    Ok(format!("{stem}-{}", hexadecimal(&hash.finalize()[..8])))
}

/// A recording's size and the digest of its first mebibyte, which holds the header and the time stamps. The whole file is not
/// read for this: a batch can hold hundreds of gigabytes of which tracking reads a few per cent.
pub(crate) fn fingerprint(path: &Path) -> Result<String, Error> {
    if path.is_dir() {
        return fingerprint_of_folder(path);
    }
    let file = File::open(path).map_err(Error::file(path, "open"))?;
    let size = file.metadata().map_err(Error::file(path, "read the size of"))?.len();
    let mut head = Vec::new();
    file.take(1 << 20).read_to_end(&mut head).map_err(Error::file(path, "read"))?;
    Ok(format!("{size} bytes, sha256 of the first MiB {}", hexadecimal(&Sha256::digest(&head))))
}

/// A folder's files by name and size.
fn fingerprint_of_folder(path: &Path) -> Result<String, Error> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::file(path, "list"))? {
        let entry = entry.map_err(Error::file(path, "list"))?;
        let size = entry.metadata().map_err(Error::file(&entry.path(), "read the size of"))?.len();
        files.push(format!("{} {size}\n", entry.file_name().to_string_lossy()));
    }
    files.sort();
    let digest = hexadecimal(&Sha256::digest(files.concat().as_bytes()));
    Ok(format!("{} files, sha256 of names and sizes {digest}", files.len()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
