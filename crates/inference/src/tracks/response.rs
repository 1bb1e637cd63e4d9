//! The chain's motion and its derivatives at every position of the tracks.

use std::num::NonZero;

use chainwave_measurement::{Moment, Observation, Trajectory, map_in_parallel};
use chainwave_mechanics::{Change, MechanicsError, Schedule, Sensitivities, simulate_with_friction};

use super::family::{Family, Struck, Weights};
use crate::least_squares::Own;
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

/// The motion and its derivatives at every position of the tracks: recording after recording, body after body, frame after frame.
pub(super) struct MotionAtTracks {
    family: Family,
    nodes: Vec<Columns>,
    /// For each node and unknown.
    derivatives_m: Vec<Vec<Vec<f64>>>,
}

/// One simulation at every position of the tracks.
struct Columns {
    displacement_m: Vec<f64>,
    velocity_m_per_s: Vec<f64>,
}

/// Solves a chain and its derivatives at the nodes of a family, on `n_threads` threads; each recording's impact has the stamp that
/// stands second among its own unknowns.
pub(super) fn respond(
    question: &Question,
    family: Family,
    schedule: &Schedule,
    places: (&[Observation], &[Own]),
    n_threads: NonZero<usize>,
) -> Result<MotionAtTracks, MechanicsError> {
    let n_groups = question.sides.len().div_ceil(DERIVATIVES_TOGETHER).max(1);
    let solved = map_in_parallel(family.n_nodes() * n_groups, n_threads, |job| {
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
        let columns = (group == 0).then(|| Columns {
            displacement_m: read(&simulation.trajectory, places, |moment, row| moment.displacement_m(row)),
            velocity_m_per_s: read(&simulation.trajectory, places, |moment, row| {
                moment.velocity_m_per_s(row)
            }),
        });
        let of_changes = derivatives
            .iter()
            .map(|derivative| read(derivative, places, |moment, row| moment.displacement_m(row)));
        Ok((columns, of_changes.collect::<Vec<_>>()))
    });
    let (mut nodes, mut derivatives_m) = (Vec::new(), Vec::new());
    for solved in solved {
        let (columns, of_changes): (Option<Columns>, Vec<Vec<f64>>) = solved?;
        if let Some(columns) = columns {
            nodes.push(columns);
            derivatives_m.push(Vec::with_capacity(question.sides.len()));
        }
        if let Some(of_node) = derivatives_m.last_mut() {
            of_node.extend(of_changes);
        }
    }
    Ok(MotionAtTracks { family, nodes, derivatives_m })
}

/// What `of_row` reads of a motion at every position of the tracks.
fn read(
    motion: &Trajectory,
    (observations, own): (&[Observation], &[Own]),
    of_row: impl Fn(&Moment<'_>, usize) -> f64,
) -> Vec<f64> {
    let mut values = Vec::new();
    for (observation, own) in observations.iter().zip(own) {
        // At rest until the impact; a motion that ended before says nothing of what follows.
        let moment = |time_s: &f64| motion.at(time_s - own[1]).filter(|_| *time_s >= own[1]);
        let moments: Vec<Option<Moment<'_>>> = observation.times_s.iter().map(moment).collect();
        for track in &observation.bodies {
            let seen = moments.iter().zip(&track.position_m).filter(|(_, position)| position.is_some());
            values.extend(
                seen.map(|(moment, _)| moment.as_ref().map_or(0.0, |moment| of_row(moment, track.body - 1))),
            );
        }
    }
    values
}

impl MotionAtTracks {
    /// Weights of the nodes at a striker's velocity, and those of the derivative by it.
    pub(super) fn weights(&self, striker_m_per_s: f64) -> (Weights, Weights) {
        self.family.weights(striker_m_per_s)
    }

    /// Sum of the nodes' displacements at a position, in metres.
    pub(super) fn displacement_m(&self, weights: &Weights, place: usize) -> f64 {
        weights.iter().zip(&self.nodes).map(|(weight, node)| weight * node.displacement_m[place]).sum()
    }

    /// Sum of the nodes' velocities at a position, in metres per second.
    pub(super) fn velocity_m_per_s(&self, weights: &Weights, place: usize) -> f64 {
        weights.iter().zip(&self.nodes).map(|(weight, node)| weight * node.velocity_m_per_s[place]).sum()
    }

    /// Sum of the nodes' derivatives of the displacement at a position by the unknown of sides number `which`, in metres per unit.
    pub(super) fn derivative_m(&self, weights: &Weights, which: usize, place: usize) -> f64 {
        let nodes = weights.iter().zip(&self.derivatives_m);
        nodes.map(|(weight, of_node)| weight * of_node[which][place]).sum()
    }

    /// Number of simulations behind it.
    pub(super) fn n_simulations(&self) -> u64 {
        let n_sides = self.derivatives_m.first().map_or(0, Vec::len);
        (self.nodes.len() * n_sides.div_ceil(DERIVATIVES_TOGETHER).max(1)) as u64
    }
}
