//! Subsets followed through all frames of a recording.

pub(crate) mod alike;
mod bending;
mod cells;
mod continuity;
pub(crate) mod find;
mod follower;
pub(crate) mod matcher;
mod partly_hidden;
pub(crate) mod predict;
mod renewal;
mod still;
pub(crate) mod together;
pub(crate) mod tracker;

use std::ops::Range;

use chainwave_measurement::{Estimate, Lost, Position, Recording, Region, Subset, Track};

use crate::evidence::ShapeTest;
use crate::track::bending::{AllBends, BendEstimate, tell};
use crate::track::follower::{Follower, Renewal};
use crate::track::together::without_collisions;
use crate::track::tracker::{Found, Tracker, track_both_ways};
use crate::{CorrelationError, Reference, ReferenceFrames, Settings, Shape, ShapeEvidence};

/// Follows subsets through every frame of a recording: from the (first) reference frame to the end, and back to frame
/// 0.
///
/// A frame's start is predicted from the frames before it. Where the match from there fails, the subset is searched for around the
/// prediction: as it is, turned and stretched, farther away, and now and then in the whole frame; a lost subset is searched for in the
/// next frames, and from the fifth on in every fourth, in turn around where it would be by now and where it was seen last. A match is
/// believed where it resembles the reference more than chance and than anything else around it does, or, of a pattern that repeats itself,
/// where it has been followed from rest without a gap (`track/continuity.rs` states the condition); two subsets are not found in one
/// place. `progress` receives 1 after each frame of the recording. A frame that cannot be read is [`Lost::Unreadable`] in every track; the
/// others go on.
///
/// [`Lost::Unreadable`]: chainwave_measurement::Lost::Unreadable
///
/// Each subset is followed by itself and held against the others at the end, so nothing depends on the number of threads.
///
/// # Errors
/// [`CorrelationError`] when a setting has no meaning, the reference frames do not exist or cannot be read, or a
/// subset lies outside of them.
pub fn track(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Track>, CorrelationError> {
    let mut followers = followers(recording, subsets, reference, settings)?;
    let mut tracks = follow(&mut followers, reference, subsets, settings, progress);
    state_what_frames_tell(&mut tracks, &mut followers, subsets, settings, reference.range().start);
    Ok(without_collisions(tracks, subsets, reference.range().start, settings))
}

/// As [`track`], each subset with the simplest shape function that its matches cannot reject, and the evidence for it.
///
/// All are followed with the affine shape function first, and those that need another one a second time with it;
/// `progress` receives 1 for each frame of each time.
///
/// # Errors
/// As [`track`].
pub fn track_by_evidence(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<(Track, ShapeEvidence)>, CorrelationError> {
    let affine = Settings { shape: Shape::Affine, ..settings.clone() };
    let mut followers = followers(recording, subsets, reference, &affine)?;
    for (follower, subset) in followers.iter_mut().zip(subsets) {
        let reference = Reference::read(recording, subset, reference)?;
        follower.shape_test = Some(ShapeTest::new(&reference, subset, &affine));
    }
    let mut tracks = follow(&mut followers, reference, subsets, settings, progress);
    let told = state_what_frames_tell(&mut tracks, &mut followers, subsets, &affine, reference.range().start);
    let mut evidence: Vec<ShapeEvidence> = followers
        .iter()
        .filter_map(|follower| follower.shape_test.as_ref())
        .map(ShapeTest::evidence)
        .collect();
    if settings.surfaces_bend {
        deform_together(&mut evidence);
    }
    for shape in Shape::ALL.into_iter().filter(|&shape| shape != Shape::Affine) {
        let members: Vec<usize> = (0..subsets.len()).filter(|&i| evidence[i].shape == shape).collect();
        if members.is_empty() {
            continue;
        }
        let of_shape: Vec<Subset> = members.iter().map(|&i| subsets[i].clone()).collect();
        let settings = Settings { shape, ..settings.clone() };
        let mut again = track(recording, &of_shape, reference, &settings, progress)?;
        let lacks =
            if shape == Shape::Quadratic { BendEstimate::with_fourth } else { BendEstimate::with_bend };
        correct(&mut again, members.iter().filter_map(|&i| told.get(i)), lacks);
        members.into_iter().zip(again).for_each(|(i, track)| tracks[i] = track);
    }
    let tracks = without_collisions(tracks, subsets, reference.range().start, settings);
    Ok(tracks.into_iter().zip(evidence).collect())
}

/// Follows one subset through some frames in their order, from a place in the first of them (column and row, in pixels) that somebody else
/// tells: a reader of the pictures, where the tracker had lost its way.
///
/// The place takes the part of the rest in [`track`]: matches begin there, and a pattern that repeats itself is followed from there as long
/// as it is seen without a gap. Its match in the first frame is held against the reference as any other, so a place where the subset is
/// not makes it lost. Frames behind the recording's end are left out.
///
/// # Errors
/// As [`track`].
pub fn track_from(
    recording: &dyn Recording,
    subset: &Subset,
    reference: &ReferenceFrames,
    settings: &Settings,
    frames: Range<usize>,
    place_px: [f64; 2],
) -> Result<Vec<Result<Position, Lost>>, CorrelationError> {
    settings.check()?;
    let mut follower = Follower::new(recording, subset, reference, settings)?;
    follower.start_at(place_px);
    let first = frames.start;
    let end = frames.end.min(follower.n_frames()).max(first);
    let mut found: Vec<Found> = vec![Err(Lost::Unreadable); end];
    for (found, frame) in found[first..].iter_mut().zip(first..) {
        *found = follower.locate(frame);
    }
    for (frame, position) in follower.settled_late() {
        found[frame] = Ok(position);
    }
    let mut tracks = [Track { name: subset.name.clone(), positions: found, still_share: None }];
    state_what_frames_tell(
        &mut tracks,
        std::slice::from_mut(&mut follower),
        std::slice::from_ref(subset),
        settings,
        first,
    );
    let [Track { mut positions, .. }] = tracks;
    Ok(positions.split_off(first))
}

/// What the frames of tracks, which began in frame `first`, tell only together: sigmas of residuals that are alike, and bends, which are told
/// besides.
fn state_what_frames_tell(
    tracks: &mut [Track],
    followers: &mut [Follower<'_>],
    subsets: &[Subset],
    settings: &Settings,
    first: usize,
) -> AllBends {
    widen(tracks, followers);
    let told = tell_bends(followers, subsets, settings);
    correct(&mut *tracks, &told, BendEstimate::with_bend);
    carry_bends(tracks, &told, followers, first);
    for (track, follower) in tracks.iter_mut().zip(followers.iter()) {
        track.still_share = follower.without_still(&mut track.positions);
    }
    told
}

/// Enlarges sigmas where residuals of neighbouring pixels are alike.
fn widen(tracks: &mut [Track], followers: &mut [Follower<'_>]) {
    for (track, follower) in tracks.iter_mut().zip(followers) {
        std::mem::take(&mut follower.alike).widen(&mut track.positions);
        std::mem::take(&mut follower.bends_alike).widen_bends(&mut follower.bends);
    }
}

/// What is known of the subsets' bends; nothing where it was not asked.
fn tell_bends(followers: &mut [Follower<'_>], subsets: &[Subset], settings: &Settings) -> AllBends {
    if !settings.surfaces_bend {
        return Vec::new();
    }
    let bends: Vec<_> = followers.iter_mut().map(|one| std::mem::take(&mut one.bends)).collect();
    tell(&bends, subsets, settings.shape)
}

/// Corrects places by what is known of their bends, where it is.
fn correct<'a>(
    tracks: impl IntoIterator<Item = &'a mut Track>,
    told: impl IntoIterator<Item = &'a Vec<[Option<BendEstimate>; 2]>>,
    with: fn(&BendEstimate, Estimate) -> Estimate,
) {
    for (track, told) in tracks.into_iter().zip(told) {
        for (position, [x, y]) in track.positions.iter_mut().zip(told) {
            let Ok(Position { x_px, y_px, .. }) = position else { continue };
            for (place, told) in [(x_px, x), (y_px, y)] {
                *place = told.as_ref().map_or(*place, |told| with(told, *place));
            }
        }
    }
}

/// A subset that was prepared anew was taken from where the affine match had it: what that lacked, all places behind it lack too.
fn carry_bends(tracks: &mut [Track], told: &AllBends, followers: &[Follower<'_>], first: usize) {
    for ((track, told), follower) in tracks.iter_mut().zip(told).zip(followers) {
        for &Renewal { frame: renewed, until } in &follower.renewals {
            let Some(lacked) = told.get(renewed) else { continue };
            let is_behind = |frame: usize| match renewed > first {
                true => frame > renewed && until.is_none_or(|until| frame < until),
                false => frame < renewed && until.is_none_or(|until| frame > until),
            };
            for (_, position) in track.positions.iter_mut().enumerate().filter(|(frame, _)| is_behind(*frame))
            {
                let Ok(Position { x_px, y_px, .. }) = position else { continue };
                for (place, lacked) in [(x_px, &lacked[0]), (y_px, &lacked[1])] {
                    *place = lacked.as_ref().map_or(*place, |lacked| lacked.with_bend(*place));
                }
            }
        }
    }
}

/// Points of a surface of which some deform are not held still by what their own few readings cannot tell: a wave stretches nothing at its
/// crests, and bends most there.
fn deform_together(evidence: &mut [ShapeEvidence]) {
    let level = ShapeEvidence::SIGNIFICANCE_LEVEL / evidence.len().max(1) as f64;
    let deforms = |one: &ShapeEvidence| one.p_translation < level || one.p_affine < level;
    if evidence.iter().any(deforms) {
        for one in evidence.iter_mut().filter(|one| one.shape == Shape::Translation) {
            one.shape = Shape::Affine;
        }
    }
}

fn followers<'a>(
    recording: &'a dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Vec<Follower<'a>>, CorrelationError> {
    settings.check()?;
    subsets.iter().map(|subset| Follower::new(recording, subset, reference, settings)).collect()
}

/// Follows each subset on one of the threads; the first thread counts the frames.
fn follow(
    followers: &mut [Follower<'_>],
    reference: &ReferenceFrames,
    subsets: &[Subset],
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Vec<Track> {
    let Some(n_frames) = followers.first().map(Follower::n_frames) else {
        return Vec::new();
    };
    let first = reference.range().start;
    let share = subsets.len().div_ceil(settings.n_threads.get()).max(1);
    let ((own, others), (own_subsets, other_subsets)) =
        (followers.split_at_mut(share), subsets.split_at(share));
    std::thread::scope(|scope| {
        let threads: Vec<_> = others
            .chunks_mut(share)
            .zip(other_subsets.chunks(share))
            .map(|(part, subsets)| {
                scope.spawn(move || track_both_ways(part, first, n_frames, subsets, &|_| ()))
            })
            .collect();
        let mut tracks = track_both_ways(own, first, n_frames, own_subsets, progress);
        for thread in threads {
            tracks.extend(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        tracks
    })
}

impl Tracker for [Follower<'_>] {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        self.iter_mut().map(|follower| follower.locate(frame)).collect()
    }

    fn read_ahead(&self, frames: Range<usize>) {
        let regions: Vec<Region> =
            self.iter().filter_map(|follower| follower.expected_in(frames.len())).collect();
        if let (Some(any), false) = (self.first(), frames.is_empty()) {
            any.recording().will_read(frames, &regions);
        }
    }

    fn restart(&mut self, found: &[Found]) {
        self.iter_mut().zip(found).for_each(|(follower, found)| follower.restart(found));
    }

    fn settled_late(&mut self) -> Vec<Vec<(usize, Position)>> {
        self.iter_mut().map(Follower::settled_late).collect()
    }
}
