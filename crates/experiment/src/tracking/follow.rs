//! Subsets followed through one opened recording, and what stands beside them that biases their places.

use std::fmt;
use std::num::NonZero;

use chainwave_correlation::{
    Method, Reference, ReferenceFrames, Settings, Shape, ShapeChoice, SharpEdge, detected_edge,
    track_by_evidence,
};
use chainwave_measurement::{Lost, Recording, Subset, Track};

use crate::error::Error;
use crate::monitor::{Monitor, Stage};
use crate::tracks::{FollowedBody, RecordingTracks};

/// The tracks of subsets in one recording, with its time stamps.
#[derive(Debug, Clone)]
pub struct Followed {
    /// Time of each frame after the trigger, in seconds; where `has_rate` is false, it counts frames.
    pub times_s: Vec<f64>,
    /// Whether the recording has a frame rate, stated by itself or by the caller.
    pub has_rate: bool,
    /// One track for each subset.
    pub tracks: Vec<FollowedSubset>,
}

impl Followed {
    /// The same as the tracks of bodies, whose numbers stand in the order of the subsets.
    pub(crate) fn of_bodies(self, numbers: Vec<usize>) -> RecordingTracks {
        let of_body = |(body, one): (usize, FollowedSubset)| FollowedBody {
            body,
            method: one.method,
            positions: one.track.positions,
        };
        let bodies = numbers.into_iter().zip(self.tracks).map(of_body).collect();
        RecordingTracks { times_s: self.times_s, bodies }
    }
}

/// One subset's track, and how it was made.
#[derive(Debug, Clone)]
pub struct FollowedSubset {
    /// The track.
    pub track: Track,
    /// The rung of the ladder, with the shape function that evidence chose where it was asked to.
    pub method: String,
}

/// Follows subsets through an opened recording. One that does not lie in its frames is lost as out of view in each of them.
///
/// # Errors
/// What the correlation refuses, and pixels that cannot be read.
pub fn follow(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    method: Method,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Followed, Error> {
    let settings = Settings { n_threads, ..Settings::default() };
    follow_with(recording, subsets, reference, method, &settings, monitor)
}

/// As [`follow`], with settings of one's own.
///
/// # Errors
/// As [`follow`].
pub(crate) fn follow_with(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    method: Method,
    settings: &Settings,
    monitor: &Monitor<'_>,
) -> Result<Followed, Error> {
    let n_threads = settings.n_threads;
    let n_threads = if recording.is_sequential() { NonZero::<usize>::MIN } else { n_threads };
    let settings = Settings { n_threads, ..settings.clone() };
    let advance = |n| monitor.done(Stage::Tracking, n);
    let of_method = |method: Method, track: Track| FollowedSubset { track, method: method.to_string() };
    let inside: Vec<Subset> =
        subsets.iter().filter(|subset| Reference::lies_inside(recording, subset)).cloned().collect();
    let found = match method {
        Method::IcGn { interpolation, shape: ShapeChoice::ByEvidence } => {
            let settings = Settings { interpolation, ..settings };
            let named = |shape: Shape| Method::IcGn { interpolation, shape: ShapeChoice::Named(shape) };
            let chosen = track_by_evidence(recording, &inside, reference, &settings, &advance)?;
            chosen.into_iter().map(|(track, evidence)| of_method(named(evidence.shape), track)).collect()
        }
        other => {
            let tracks = other.track(recording, &inside, reference, &settings, &advance)?;
            tracks.into_iter().map(|track| of_method(other, track)).collect::<Vec<_>>()
        }
    };
    let mut found = found.into_iter();
    let out_of_view = |subset: &Subset| {
        let positions = vec![Err(Lost::OutOfView); recording.info().n_frames];
        of_method(method, Track { name: subset.name.clone(), positions, still_share: None })
    };
    let of_subset = |subset: &Subset| match Reference::lies_inside(recording, subset) {
        true => found.next().unwrap_or_else(|| out_of_view(subset)),
        false => out_of_view(subset),
    };
    let tracks = subsets.iter().map(of_subset).collect();
    let info = recording.info();
    Ok(Followed { times_s: info.times_s.clone(), has_rate: info.rate_hz.is_some(), tracks })
}

/// Threads for each recording when all are worked on side by side: more than one where there are fewer recordings than
/// threads.
pub fn threads_of_each(n_threads: NonZero<usize>, n_recordings: usize) -> NonZero<usize> {
    NonZero::new(n_threads.get() / n_recordings.max(1)).unwrap_or(NonZero::<usize>::MIN)
}

/// A point beside whose subset a sharp edge runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EdgeNote {
    /// Name of the point.
    pub(crate) point: String,
    /// The edge.
    pub(crate) edge: SharpEdge,
}

impl fmt::Display for EdgeNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { point, edge: SharpEdge { side, distance_px } } = self;
        write!(
            f,
            "point {point}: a sharp edge runs {distance_px} px beyond its subset ({side}) and rings into it, which biases \
             positions by thousandths of a pixel; lines that are nearer to it than 2 px are left out: leave 5 px of texture around it"
        )
    }
}

/// The points beside whose subsets a sharp edge runs in the reference; of subsets outside the frames nothing is said.
///
/// # Errors
/// Pixels of the reference that cannot be read.
pub(crate) fn edges_beside(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
) -> Result<Vec<EdgeNote>, Error> {
    let mut notes = Vec::new();
    for subset in subsets.iter().filter(|subset| Reference::lies_inside(recording, subset)) {
        let edge = detected_edge(recording, subset, reference)?;
        notes.extend(edge.map(|edge| EdgeNote { point: subset.name.clone(), edge }));
    }
    Ok(notes)
}
