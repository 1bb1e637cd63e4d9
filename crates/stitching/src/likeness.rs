//! How like each other the motions of a view's recordings are, without any model of how trials differ.

use chainwave_measurement::{Estimate, Observation, median};

use crate::rest::{Displacement, displacement_from_rest};

/// A recording whose bodies move otherwise than in all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Odd {
    /// Its place among the recordings.
    pub(crate) index: usize,
    /// How far it is from the one most like it, as a share of the way of the one that goes farther (rms over bodies and frames).
    pub(crate) apart: f64,
    /// Median of that over all recordings.
    pub(crate) usual: f64,
}

/// A recording is odd when it is this share of the way from the one most like it: a strike that is a third harder is no repetition, and what
/// the square of a third leaves of a motion, a tenth, no response that is linear in the strike explains...
const LEAST_APART: f64 = 1.0 / 3.0;
/// ...and this many times as far as is usual.
const OUT_OF_PROPORTION: f64 = 10.0;
/// Recordings that can be compared from which on one of them is told to be odd.
const LEAST_COMPARED: usize = 3;
/// A body moves elsewhere and rests here where its way there is this many times that here: one that the wave has just come to when a
/// recording ends may have moved in one and not yet in another.
const RESTS: f64 = 100.0;
/// Bodies move where their way is this many times its noise, frame for frame: below, likeness is that of noise.
const MOVES_SIGMAS: f64 = 10.0;

/// A recording in which nothing moves, though one of its bodies does in another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Resting {
    /// Its place among the recordings.
    pub(crate) index: usize,
    /// Number of the body, from 1.
    pub(crate) body: usize,
    /// The place of the recording in which it moves the most, in standard uncertainties.
    pub(crate) moves_in: usize,
    /// How far it moves there while it rests here, in metres (rms).
    pub(crate) way_m: f64,
}

/// Recordings in which nothing moves, though one of their bodies does at the same times in another, of any view.
pub(crate) fn resting(recordings: &[&Observation], rest_until_s: f64) -> Vec<Resting> {
    let ways: Vec<Way<'_>> = recordings.iter().map(|one| Way::of(one, rest_until_s)).collect();
    let moving = |index: usize| {
        let own = &ways[index];
        let beside = ways.iter().enumerate().filter(|(other, _)| *other != index).flat_map(|(other, way)| {
            let of_body = |row: usize| {
                let span_s = own.observation.span_s()?;
                let ([own_m, _], found) = (own.within(row, span_s)?, way.within(row, span_s)?);
                (found[0] > RESTS * own_m).then_some((row, found))
            };
            own.bodies.iter().filter_map(move |body| of_body(body.row)).map(move |found| (other, found))
        });
        let moves = beside.filter(|(_, (_, [way_m, noise_m]))| *way_m > MOVES_SIGMAS * noise_m);
        let farthest = moves.max_by(|(_, (_, a)), (_, (_, b))| (a[0] * b[1]).total_cmp(&(b[0] * a[1])));
        farthest.map(|(moves_in, (row, [way_m, _]))| Resting { index, body: row + 1, moves_in, way_m })
    };
    let rests = |index: &usize| !ways[*index].bodies.is_empty() && !ways[*index].moves();
    (0..ways.len()).filter(rests).filter_map(moving).collect()
}

/// The recording farthest from all others, where that is out of proportion.
pub(crate) fn oddest(recordings: &[&Observation], rest_until_s: f64) -> Option<Odd> {
    let ways: Vec<Way<'_>> = recordings.iter().map(|one| Way::of(one, rest_until_s)).collect();
    if !ways.iter().any(Way::moves) {
        return None;
    }
    let nearest = |index: usize| {
        let others = ways.iter().enumerate().filter(|(other, _)| *other != index);
        others.filter_map(|(_, other)| ways[index].apart(other)).min_by(f64::total_cmp)
    };
    let apart: Vec<(usize, f64)> =
        (0..ways.len()).filter_map(|index| Some((index, nearest(index)?))).collect();
    if apart.len() < LEAST_COMPARED {
        return None;
    }
    let usual = median(apart.iter().map(|(_, apart)| *apart).collect())?;
    let (index, apart) = apart.into_iter().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let is_odd = apart > LEAST_APART.max(OUT_OF_PROPORTION * usual);
    is_odd.then_some(Odd { index, apart, usual })
}

/// The displacements of a recording's bodies.
struct Way<'a> {
    observation: &'a Observation,
    bodies: Vec<Displacement>,
}

impl<'a> Way<'a> {
    /// Of the bodies that were seen at rest.
    fn of(observation: &'a Observation, rest_until_s: f64) -> Self {
        let displaced = |track| displacement_from_rest(observation, track, rest_until_s).ok();
        Self { observation, bodies: observation.bodies.iter().filter_map(displaced).collect() }
    }

    fn body(&self, row: usize) -> Option<&Displacement> {
        self.bodies.iter().find(|body| body.row == row)
    }

    fn moves(&self) -> bool {
        let readings = || self.bodies.iter().flat_map(|body| &body.samples).flatten();
        let squares: f64 = readings().map(|at| at.value * at.value).sum();
        let noise: f64 = readings().map(|at| at.sigma * at.sigma).sum();
        squares > MOVES_SIGMAS.powi(2) * noise
    }

    /// Way and noise of a body within a span of time, in metres (rms over frames); none where it was not seen then.
    fn within(&self, row: usize, (first_s, last_s): (f64, f64)) -> Option<[f64; 2]> {
        let Displacement { samples, .. } = self.body(row)?;
        let during = |time_s: f64| (first_s..=last_s).contains(&time_s);
        let timed = samples.iter().zip(&self.observation.times_s);
        let seen: Vec<&Estimate> =
            timed.filter(|(_, time_s)| during(**time_s)).filter_map(|(at, _)| at.as_ref()).collect();
        let rms = |of: fn(&Estimate) -> f64| {
            (seen.iter().map(|at| of(at).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
        };
        (!seen.is_empty()).then(|| [rms(|at| at.value), rms(|at| at.sigma)])
    }

    /// Root of the mean square by which the two differ where both have a body, over that of the one that goes farther; none where neither moves at
    /// the times that they have in common.
    fn apart(&self, other: &Self) -> Option<f64> {
        let frame_s = self.observation.frame_interval_s().max(other.observation.frame_interval_s());
        let nearest = self.observation.times_s.iter().map(|time_s| other.nearest(*time_s, frame_s));
        let nearest: Vec<Option<usize>> = nearest.collect();
        let (mut between, mut own, mut others, mut noise) = (0.0, 0.0, 0.0, 0.0);
        for body in &self.bodies {
            let Some(theirs) = other.body(body.row) else { continue };
            for (sample, nearest) in body.samples.iter().zip(&nearest) {
                let their = nearest.and_then(|frame| theirs.samples.get(frame)?.as_ref());
                let (Some(sample), Some(their)) = (sample, their) else { continue };
                between += (sample.value - their.value).powi(2);
                own += sample.value.powi(2);
                others += their.value.powi(2);
                noise += sample.sigma.powi(2).max(their.sigma.powi(2));
            }
        }
        let farther = own.max(others);
        (farther > MOVES_SIGMAS.powi(2) * noise).then(|| (between / farther).sqrt())
    }

    /// The frame nearest to a time, if that is within a frame.
    fn nearest(&self, time_s: f64, frame_s: f64) -> Option<usize> {
        let times_s = &self.observation.times_s;
        let after = times_s.partition_point(|own_s| *own_s < time_s);
        let off_s = |frame: &usize| (times_s[*frame] - time_s).abs();
        let beside = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let beside = beside.filter(|frame| *frame < times_s.len() && off_s(frame) <= frame_s);
        beside.min_by(|a, b| off_s(a).total_cmp(&off_s(b)))
    }
}
