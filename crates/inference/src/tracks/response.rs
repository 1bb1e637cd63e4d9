//! The chain's motion and its derivatives at every position of the tracks.

use std::{num::NonZero, ops::Range};

use chainwave_measurement::{BodyTrack, Instant, Trajectory, map_in_parallel};
use chainwave_mechanics::{Change, MechanicsError, Schedule, Sensitivities, simulate_with_friction};

use super::family::{Family, N_NODES, Struck, Weights};
use crate::steps::DERIVATIVES_TOGETHER;

/// What is asked of a chain: it at some values of the shared unknowns, and on both sides of them in each of several.
pub(super) struct Question {
    pub(super) centre: Struck,
    pub(super) sides: Vec<Sides>,
    /// Forces of dry friction, in newtons, of which what each adds to the motion follows the derivatives by the sides.
    pub(super) frictions_n: Vec<f64>,
}

/// The chain a step below and a step above in one unknown.
pub(super) struct Sides {
    pub(super) below: Struck,
    pub(super) above: Struck,
    pub(super) width: f64,
}

/// The motion and its derivatives at the nodes of a family.
pub(super) struct Response {
    family: Family,
    times_s: Vec<f64>,
    nodes: Vec<Samples>,
    /// For each unknown and node.
    derivatives: Vec<Vec<Samples>>,
    n_simulations: u64,
}

/// One simulation, body after body: pairs of displacement and velocity, or of their derivatives.
struct Samples {
    n_times: usize,
    pairs: Vec<[f64; 2]>,
}

/// The motion that one striker drives, at the times of one recording.
pub(super) struct Driven<'a> {
    response: &'a Response,
    value: Weights,
    slope: Weights,
    /// None where a body is at rest still, or the simulation has ended.
    instants: Vec<Option<Instant>>,
    /// The samples that these need.
    range: Range<usize>,
}

/// The motion and its derivatives at every position of a track.
pub(super) struct MotionOfTrack {
    pub(super) displacement_m: Vec<f64>,
    pub(super) velocity_m_per_s: Vec<f64>,
    /// By the striker's velocity, in metres per (metre per second).
    pub(super) by_striker_s: Vec<f64>,
    /// By each unknown, in metres per unit.
    pub(super) derivatives_m: Vec<Vec<f64>>,
}

/// Solves a chain and its derivatives at the nodes of a family, on `n_threads` threads.
pub(super) fn respond(
    question: &Question,
    family: Family,
    schedule: &Schedule,
    n_threads: NonZero<usize>,
) -> Result<Response, MechanicsError> {
    let n_groups = question.sides.len().div_ceil(DERIVATIVES_TOGETHER).max(1);
    let n_jobs = family.n_nodes() * n_groups;
    let solved = map_in_parallel(n_jobs, n_threads, |job| {
        let (node, group) = (job / n_groups, job % n_groups);
        let change = |sides: &Sides| Change {
            below: family.struck(node, &sides.below),
            above: family.struck(node, &sides.above),
            width: sides.width,
        };
        let changes: Vec<Change> = question
            .sides
            .iter()
            .skip(group * DERIVATIVES_TOGETHER)
            .take(DERIVATIVES_TOGETHER)
            .map(change)
            .collect();
        let centre = family.struck(node, &question.centre);
        let frictions_n = if group + 1 == n_groups { question.frictions_n.as_slice() } else { &[] };
        let Sensitivities { simulation, derivatives } =
            simulate_with_friction(&centre, schedule, &changes, frictions_n)?;
        let of_node = (group == 0)
            .then(|| (simulation.trajectory.times_s.clone(), Samples::of(&simulation.trajectory)));
        Ok((of_node, derivatives.iter().map(Samples::of).collect::<Vec<_>>()))
    });
    let n_derivatives = question.sides.len() + question.frictions_n.len();
    let mut derivatives: Vec<Vec<Samples>> = (0..n_derivatives).map(|_| Vec::new()).collect();
    let (mut times_s, mut nodes) = (Vec::new(), Vec::new());
    for (job, solved) in solved.into_iter().enumerate() {
        let (of_node, of_changes) = solved?;
        if let Some((times, motion)) = of_node {
            times_s = times;
            nodes.push(motion);
        }
        let first = (job % n_groups) * DERIVATIVES_TOGETHER;
        derivatives.iter_mut().skip(first).zip(of_changes).for_each(|(all, one)| all.push(one));
    }
    Ok(Response { family, times_s, nodes, derivatives, n_simulations: n_jobs as u64 })
}

impl Samples {
    fn of(motion: &Trajectory) -> Self {
        let n_times = motion.times_s.len();
        let (x_m, v_m_per_s) = (&motion.displacement_m, &motion.velocity_m_per_s);
        let mut pairs = vec![[0.0; 2]; x_m.len()];
        // The samples of a time lie side by side in derivatives.
        for (time, (x_m, v_m_per_s)) in x_m.columns().into_iter().zip(v_m_per_s.columns()).enumerate() {
            let places = pairs.iter_mut().skip(time).step_by(n_times);
            places.zip(x_m.iter().zip(v_m_per_s)).for_each(|(place, (x_m, v))| *place = [*x_m, *v]);
        }
        Self { n_times, pairs }
    }

    fn of_body(&self, body: usize, range: &Range<usize>) -> &[[f64; 2]] {
        let first = (body - 1) * self.n_times;
        &self.pairs[first + range.start..first + range.end]
    }
}

impl Response {
    /// Number of simulations behind it.
    pub(super) fn n_simulations(&self) -> u64 {
        self.n_simulations
    }

    /// What a striker drives that meets body 1 at an instant, at times of a recording.
    pub(super) fn driven(&self, [striker_m_per_s, impact_s]: [f64; 2], times_s: &[f64]) -> Driven<'_> {
        let (value, slope) = self.family.weights(striker_m_per_s);
        // At rest until the impact; a motion that ended before says nothing of what follows.
        let instant = |time_s: &f64| {
            let moves = *time_s >= impact_s;
            moves.then(|| Instant::among(&self.times_s, time_s - impact_s)).flatten()
        };
        let instants: Vec<Option<Instant>> = times_s.iter().map(instant).collect();
        let samples = || instants.iter().flatten().flat_map(Instant::samples);
        let start = samples().min().unwrap_or(0);
        let range = start..samples().max().map_or(start, |last| last + 1);
        let instants = instants.iter().map(|one| one.map(|instant| instant.counted_from(start))).collect();
        Driven { response: self, value, slope, instants, range }
    }
}

impl Driven<'_> {
    /// The motion at every position of a track of the recording.
    pub(super) fn of_track(&self, track: &BodyTrack) -> MotionOfTrack {
        let Self { response, value, slope, .. } = self;
        let mut mixed = vec![[0.0; 2]; self.range.len()];
        self.mix(value, &response.nodes, track.body, &mut mixed);
        let displacement_m = self.read(track, |instant| instant.displacement_m(&mixed));
        let velocity_m_per_s = self.read(track, |instant| instant.velocity_m_per_s(&mixed));
        self.mix(slope, &response.nodes, track.body, &mut mixed);
        let by_striker_s = self.read(track, |instant| instant.displacement_m(&mixed));
        let mut derivative_m = |nodes: &Vec<Samples>| {
            self.mix(value, nodes, track.body, &mut mixed);
            self.read(track, |instant| instant.displacement_m(&mixed))
        };
        let derivatives_m = response.derivatives.iter().map(&mut derivative_m).collect();
        MotionOfTrack { displacement_m, velocity_m_per_s, by_striker_s, derivatives_m }
    }

    /// Sum of the nodes' samples of a body.
    fn mix(&self, weights: &Weights, nodes: &[Samples], body: usize, sum: &mut [[f64; 2]]) {
        let sum = sum.as_flattened_mut();
        let n = sum.len();
        let samples: [&[f64]; N_NODES] =
            std::array::from_fn(|node| &nodes[node].of_body(body, &self.range).as_flattened()[..n]);
        for (i, sum) in sum.iter_mut().enumerate() {
            *sum = (0..N_NODES).map(|node| weights[node] * samples[node][i]).sum();
        }
    }

    /// What `of_instant` reads at every position of a track.
    fn read(&self, track: &BodyTrack, of_instant: impl Fn(&Instant) -> f64) -> Vec<f64> {
        let seen = self.instants.iter().zip(&track.position_m).filter(|(_, position)| position.is_some());
        seen.map(|(instant, _)| instant.as_ref().map_or(0.0, &of_instant)).collect()
    }
}
