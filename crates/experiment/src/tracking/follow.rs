//! Subsets followed through one opened recording, and what stands beside them that biases their places.

use std::fmt;
use std::num::NonZero;

use chainwave_correlation::{
    CorrelationError, Cover, Method, Reference, ReferenceFrames, Settings, Shape, ShapeChoice, SharpEdge,
    detected_edge, track_by_evidence,
};
use chainwave_measurement::{Lost, Position, Recording, Subset, Track};

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
    /// The share of its pixels before which something stands still, where that was left out.
    pub covered_share: Option<f64>,
    /// The share of its pixels that are ground beside what moves, where that was left out.
    pub ground_share: Option<f64>,
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
    let inside: Vec<Subset> =
        subsets.iter().filter(|subset| Reference::lies_inside(recording, subset)).cloned().collect();
    let way = Way { reference, method, settings: &settings, monitor };
    let mut found = way.follow_what_moves(recording, &inside)?.into_iter();
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

fn of_method(method: Method, track: Track) -> FollowedSubset {
    FollowedSubset { track, method: method.to_string(), covered_share: None, ground_share: None }
}

/// Times that ground is looked for, each by tracks that go farther.
const GROUND_ROUNDS: usize = 3;
/// Share of a subset below which more ground changes nothing.
const LEAST_GROUND: f64 = 0.01;

/// How subsets that lie in the frames are followed.
struct Way<'a> {
    reference: &'a ReferenceFrames,
    method: Method,
    settings: &'a Settings,
    monitor: &'a Monitor<'a>,
}

impl Way<'_> {
    fn follow(
        &self,
        recording: &dyn Recording,
        subsets: &[Subset],
        advance: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<FollowedSubset>, CorrelationError> {
        let Self { reference, method, settings, .. } = *self;
        if let Method::IcGn { interpolation, shape: ShapeChoice::ByEvidence } = method {
            let settings = Settings { interpolation, ..settings.clone() };
            let named = |shape: Shape| Method::IcGn { interpolation, shape: ShapeChoice::Named(shape) };
            let chosen = track_by_evidence(recording, subsets, reference, &settings, advance)?;
            return Ok(chosen
                .into_iter()
                .map(|(track, evidence)| of_method(named(evidence.shape), track))
                .collect());
        }
        let tracks = method.track(recording, subsets, reference, settings, advance)?;
        Ok(tracks.into_iter().map(|track| of_method(method, track)).collect())
    }

    /// As [`Self::follow`]; what holds something that stands still, before it or beside it, is followed once more by the rest of its pixels.
    fn follow_what_moves(
        &self,
        recording: &dyn Recording,
        subsets: &[Subset],
    ) -> Result<Vec<FollowedSubset>, CorrelationError> {
        let mut found = self.follow(recording, subsets, &|n| self.monitor.done(Stage::Tracking, n))?;
        if !matches!(self.method, Method::IcGn { .. }) {
            return Ok(found);
        }
        // What ground holds back is lost early, and shows little of it before.
        for _ in 0..GROUND_ROUNDS {
            if !self.follow_without_ground(recording, subsets, &mut found)? {
                break;
            }
        }
        let tracks: Vec<&Track> = found.iter().map(|one| &one.track).collect();
        let Some(cover) = Cover::find(recording, subsets, self.reference, &tracks)? else { return Ok(found) };
        // Ground that is left out already keeps still over the whole way where that is short.
        let has_no_ground = |&&(index, _): &&(usize, f64)| found[index].ground_share.is_none();
        let covered: Vec<(usize, f64)> = cover.subsets().iter().filter(has_no_ground).copied().collect();
        if covered.is_empty() {
            return Ok(found);
        }
        let chosen: Vec<Subset> = covered.iter().map(|&(index, _)| subsets[index].clone()).collect();
        let again = self.follow(&cover.taken_from(recording), &chosen, &|_| ())?;
        for (&(index, share), again) in covered.iter().zip(again) {
            if Cover::explains(&found[index].track, &again.track) {
                found[index] = FollowedSubset { covered_share: Some(share), ..again };
            }
        }
        Ok(found)
    }

    /// Follows those once more whose reference shows more ground than was left out of it, and takes tracks that are seen in more frames, or that
    /// ground explains. Whether there are any.
    fn follow_without_ground(
        &self,
        recording: &dyn Recording,
        subsets: &[Subset],
        found: &mut [FollowedSubset],
    ) -> Result<bool, CorrelationError> {
        let positions: Vec<&[Result<Position, Lost>]> =
            found.iter().map(|one| one.track.positions.as_slice()).collect();
        let Some(ground) = Cover::ground(recording, subsets, self.reference, &positions)? else {
            return Ok(false);
        };
        let is_more = |&&(index, share): &&(usize, f64)| {
            share > found[index].ground_share.unwrap_or(0.0) + LEAST_GROUND
        };
        let more: Vec<(usize, f64)> = ground.subsets().iter().filter(is_more).copied().collect();
        if more.is_empty() {
            return Ok(false);
        }
        let chosen: Vec<Subset> = more.iter().map(|&(index, _)| subsets[index].clone()).collect();
        let again = self.follow(&ground.taken_from(recording), &chosen, &|_| ())?;
        let n_seen = |track: &Track| track.positions.iter().flatten().count();
        let mut is_taken = false;
        for (&(index, share), again) in more.iter().zip(again) {
            let before = &found[index].track;
            if n_seen(&again.track) > n_seen(before) || Cover::explains(before, &again.track) {
                found[index] = FollowedSubset { ground_share: Some(share), ..again };
                is_taken = true;
            }
        }
        Ok(is_taken)
    }
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

/// The bodies beside whose markers their subsets hold ground in the reference, by their numbers, each with the share of it. Subsets outside the
/// frames hold none.
///
/// # Errors
/// Pixels of the reference that cannot be read.
pub(crate) fn ground_beside(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    tracks: &RecordingTracks,
) -> Result<Vec<(usize, f64)>, Error> {
    let inside = || {
        let all = subsets.iter().zip(&tracks.bodies);
        all.filter(|(subset, _)| Reference::lies_inside(recording, subset))
    };
    let subsets: Vec<Subset> = inside().map(|(subset, _)| subset.clone()).collect();
    let positions: Vec<&[Result<Position, Lost>]> =
        inside().map(|(_, body)| body.positions.as_slice()).collect();
    let numbers: Vec<usize> = inside().map(|(_, body)| body.body).collect();
    let ground = Cover::ground(recording, &subsets, reference, &positions)?;
    let of_subsets = ground.iter().flat_map(Cover::subsets);
    Ok(of_subsets.map(|&(index, share)| (numbers[index], share)).collect())
}
