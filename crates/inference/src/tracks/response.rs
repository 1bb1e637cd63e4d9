//! The chain's motion and its derivatives at every position of the tracks.

use std::{num::NonZero, ops::Range};

use chainwave_measurement::{BodyTrack, SampleWeights, map_in_parallel};
use chainwave_mechanics::{Chain, Kept, MechanicsError, ReferenceMotion, Resistance, Schedule};

use super::family::{Family, N_DERIVATIVE_NODES, Weights};
use super::samples::Samples;
use super::windows::Window;

/// The motion at the nodes of a family, and what resists the bodies adds to it.
pub(super) struct Response {
    family: Family,
    times_s: Vec<f64>,
    nodes: Vec<Samples>,
    /// For each resistance and node.
    resistances: Vec<Vec<Samples>>,
}

/// The motion that one striker drives, at the times of one recording.
pub(super) struct Driven<'a> {
    response: &'a Response,
    value: Weights,
    slope: Weights,
    of_derivatives: [f64; N_DERIVATIVE_NODES],
    /// None where a body is at rest still, or the simulation has ended.
    instants: Vec<Option<SampleWeights>>,
    /// The output before each frame; the first one for those before the impact.
    before: Vec<usize>,
}

/// The motion and its derivatives at every position of a track in a window.
pub(super) struct MotionOfTrack {
    /// The window's frames.
    pub(super) frames: Range<usize>,
    pub(super) displacement_m: Vec<f64>,
    pub(super) velocity_m_per_s: Vec<f64>,
    /// By the striker's velocity, in metres per (metre per second).
    pub(super) by_striker_s: Vec<f64>,
    /// What each resistance adds.
    pub(super) resistances_m: Vec<Vec<f64>>,
    /// By each unknown, in metres per unit.
    pub(super) derivatives_m: Vec<Vec<f64>>,
}

/// Solves the chains at all nodes of a family, of each of which some is kept, on `n_threads` threads.
pub(super) fn solve<'a>(
    chains: &'a [Chain],
    schedule: &Schedule,
    kept: impl Fn(usize) -> Kept + Sync,
    n_threads: NonZero<usize>,
) -> Result<Vec<ReferenceMotion<'a>>, MechanicsError> {
    let solved = |node: usize| ReferenceMotion::solve(&chains[node], schedule, kept(node));
    map_in_parallel(chains.len(), n_threads, solved).into_iter().collect()
}

impl Response {
    /// Of the motions at the nodes of a family, and what resists the bodies.
    pub(super) fn new(
        family: Family,
        motions: &[ReferenceMotion<'_>],
        asked: &[Resistance],
        n_threads: NonZero<usize>,
    ) -> Result<Self, MechanicsError> {
        let resisted = |node: usize| match asked {
            [] => Ok(Vec::new()),
            _ => motions[node].derivatives(&[], asked),
        };
        let mut resistances: Vec<Vec<Samples>> = asked.iter().map(|_| Vec::new()).collect();
        for resisted in map_in_parallel(motions.len(), n_threads, resisted) {
            resistances.iter_mut().zip(resisted?).for_each(|(all, one)| all.push(Samples::of(&one)));
        }
        let trajectories = || motions.iter().map(|motion| &motion.simulation().trajectory);
        let times_s = trajectories().next().map_or(Vec::new(), |motion| motion.times_s.clone());
        let nodes = trajectories().map(|motion| Samples::of(motion).since_the_first()).collect();
        Ok(Self { family, times_s, nodes, resistances })
    }

    /// Number of outputs.
    pub(super) fn n_outputs(&self) -> usize {
        self.times_s.len()
    }

    /// What a striker drives that meets body 1 at an instant, at times of a recording.
    pub(super) fn driven(&self, [striker_m_per_s, impact_s]: [f64; 2], times_s: &[f64]) -> Driven<'_> {
        let (value, slope) = self.family.weights(striker_m_per_s);
        let of_derivatives = self.family.weights_of_derivatives(striker_m_per_s);
        // At rest until the impact; a motion that ended before says nothing of what follows.
        let moves = |time_s: f64| time_s >= impact_s;
        let instant = |time_s: &f64| {
            moves(*time_s).then(|| SampleWeights::among(&self.times_s, time_s - impact_s)).flatten()
        };
        let instants: Vec<Option<SampleWeights>> = times_s.iter().map(instant).collect();
        let before = |(time_s, instant): (&f64, &Option<SampleWeights>)| match instant {
            Some(instant) => instant.samples()[0],
            None if moves(*time_s) => usize::MAX,
            None => 0,
        };
        let before = times_s.iter().zip(&instants).map(before).collect();
        Driven { response: self, value, slope, of_derivatives, instants, before }
    }
}

impl Driven<'_> {
    /// The motion at every position of a track of the recording in a window.
    pub(super) fn of_track(&self, track: &BodyTrack, window: &Window) -> MotionOfTrack {
        let Self { response, value, slope, .. } = self;
        let frames = window.frames(&self.before);
        let instants = &self.instants[frames.clone()];
        let samples = || instants.iter().flatten().flat_map(SampleWeights::samples);
        let start = samples().min().unwrap_or(window.outputs.start);
        let range = start..samples().max().map_or(start, |last| last + 1);
        let seen = instants.iter().zip(&track.position_m[frames.clone()]);
        let seen: Vec<Option<SampleWeights>> = seen
            .filter(|(_, position)| position.is_some())
            .map(|(instant, _)| instant.map(|instant| instant.counted_from(start)))
            .collect();
        let mut mixed = vec![[0.0; 2]; range.len()];
        mix(value, &of_nodes(&response.nodes, track.body, &range), &mut mixed);
        let displacement_m = read(&seen, |instant| instant.displacement_m(&mixed));
        let velocity_m_per_s = read(&seen, |instant| instant.velocity_m_per_s(&mixed));
        let mut mixture = |weights: &Weights, nodes: &[Samples]| {
            mix(weights, &of_nodes(nodes, track.body, &range), &mut mixed);
            read(&seen, |instant| instant.displacement_m(&mixed))
        };
        let by_striker_s = mixture(slope, &response.nodes);
        let resistances_m = response.resistances.iter().map(|nodes| mixture(value, nodes)).collect();
        let first = window.outputs.start;
        let derivative_m = |nodes: &[Samples; N_DERIVATIVE_NODES]| {
            let range = range.start - first..range.end - first;
            mix(&self.of_derivatives, &of_nodes(nodes, track.body, &range), &mut mixed);
            read(&seen, |instant| instant.displacement_m(&mixed))
        };
        let derivatives_m = window.derivatives.iter().map(derivative_m).collect();
        MotionOfTrack { frames, displacement_m, velocity_m_per_s, by_striker_s, resistances_m, derivatives_m }
    }
}

/// What is read at each of some instants; nothing where a body is at rest still.
fn read(instants: &[Option<SampleWeights>], of_instant: impl Fn(&SampleWeights) -> f64) -> Vec<f64> {
    instants.iter().map(|instant| instant.as_ref().map_or(0.0, &of_instant)).collect()
}

/// The samples of a body at each node.
fn of_nodes<'a, const N: usize>(nodes: &'a [Samples], body: usize, range: &Range<usize>) -> [&'a [f64]; N] {
    std::array::from_fn(|node| nodes[node].of_body(body, range).as_flattened())
}

/// Sum of the nodes' samples.
fn mix<const N: usize>(weights: &[f64; N], nodes: &[&[f64]; N], sum: &mut [[f64; 2]]) {
    let sum = sum.as_flattened_mut();
    let n = sum.len();
    let nodes = nodes.map(|samples| &samples[..n]);
    for (i, sum) in sum.iter_mut().enumerate() {
        *sum = (0..N).map(|node| weights[node] * nodes[node][i]).sum();
    }
}
