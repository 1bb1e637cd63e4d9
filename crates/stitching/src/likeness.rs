//! How like each other the motions of a view's recordings are, without any model of how trials differ.

use chainwave_measurement::{Estimate, Observation, median};

use crate::rest::displacement_from_rest;

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

/// A recording is odd when it is this share of the way from the one most like it: a strike that is a third harder is no repetition, and what the square of a third
/// leaves of a motion, a tenth, no response that is linear in the strike explains...
const LEAST_APART: f64 = 1.0 / 3.0;
/// ...and this many times as far as is usual.
const OUT_OF_PROPORTION: f64 = 10.0;
/// Bodies move where their way is this many times its noise, frame for frame: below, likeness is that of noise.
const MOVES_SIGMAS: f64 = 10.0;

/// The recording farthest from all others, where that is out of proportion; of two, the one in which nothing moves while the other one's bodies do.
pub(crate) fn oddest(recordings: &[&Observation], rest_until_s: f64) -> Option<Odd> {
    let ways: Vec<Way<'_>> = recordings.iter().map(|one| Way::of(one, rest_until_s)).collect();
    let moves: Vec<bool> = ways.iter().map(Way::moves).collect();
    match *moves {
        [true, false] | [false, true] => {
            let index = usize::from(moves[0]);
            let apart = ways[0].apart(&ways[1])?;
            return Some(Odd { index, apart, usual: 0.0 });
        }
        [_, _, ..] if moves.contains(&true) => {}
        _ => return None,
    }
    let apart: Vec<f64> = ways
        .iter()
        .enumerate()
        .filter_map(|(i, own)| {
            let others = ways.iter().enumerate().filter(|(j, _)| *j != i);
            others.filter_map(|(_, other)| own.apart(other)).min_by(f64::total_cmp)
        })
        .collect();
    if apart.len() < ways.len().max(3) {
        return None;
    }
    let usual = median(apart.clone())?;
    let index = (0..apart.len()).max_by(|a, b| apart[*a].total_cmp(&apart[*b]))?;
    let is_odd = apart[index] > LEAST_APART.max(OUT_OF_PROPORTION * usual);
    is_odd.then_some(Odd { index, apart: apart[index], usual })
}

/// The displacements of a recording's bodies.
struct Way<'a> {
    observation: &'a Observation,
    /// Number of each body, and where it is in each frame.
    bodies: Vec<(usize, Vec<Option<Estimate>>)>,
}

impl<'a> Way<'a> {
    /// Of the bodies that were seen at rest.
    fn of(observation: &'a Observation, rest_until_s: f64) -> Self {
        let displaced = |track| displacement_from_rest(observation, track, rest_until_s).ok();
        let bodies = observation.bodies.iter().filter_map(displaced);
        Self { observation, bodies: bodies.map(|body| (body.row, body.samples)).collect() }
    }

    fn moves(&self) -> bool {
        let readings = || self.bodies.iter().flat_map(|(_, samples)| samples).flatten();
        let squares: f64 = readings().map(|at| at.value * at.value).sum();
        let noise: f64 = readings().map(|at| at.sigma * at.sigma).sum();
        squares > MOVES_SIGMAS.powi(2) * noise
    }

    /// Root of the mean square by which the two differ where both have a body, over that of the one that goes farther; none where they have none
    /// in common.
    fn apart(&self, other: &Self) -> Option<f64> {
        let frame_s = self.observation.frame_interval_s().max(other.observation.frame_interval_s());
        let nearest = self.observation.times_s.iter().map(|time_s| other.nearest(*time_s, frame_s));
        let nearest: Vec<Option<usize>> = nearest.collect();
        let (mut between, mut own, mut others) = (0.0, 0.0, 0.0);
        for (row, samples) in &self.bodies {
            let Some((_, theirs)) = other.bodies.iter().find(|(other, _)| other == row) else { continue };
            for (sample, nearest) in samples.iter().zip(&nearest) {
                let their = nearest.and_then(|frame| theirs.get(frame)?.as_ref());
                let (Some(sample), Some(their)) = (sample, their) else { continue };
                between += (sample.value - their.value).powi(2);
                own += sample.value.powi(2);
                others += their.value.powi(2);
            }
        }
        let farther = own.max(others);
        (farther > 0.0).then(|| (between / farther).sqrt())
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
