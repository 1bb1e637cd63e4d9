use std::num::NonZero;

use chainwave_measurement::{Moment, Observation, Trajectory};
use chainwave_mechanics::{Chain, MechanicsError, Schedule, Striker, ensemble};

use super::arrow::Own;
use super::family::{Family, Weights};

/// The chain with some values of the shared unknowns, solved at the nodes of a family.
pub(super) struct Variant {
    pub(super) chain: Chain,
    pub(super) striker: Striker,
    pub(super) family: Family,
}

/// A variant's motion at every position of the tracks: recording after recording, body after body, frame after frame.
pub(super) struct Response {
    family: Family,
    nodes: Vec<Columns>,
}

/// One simulation at every position of the tracks.
struct Columns {
    displacement_m: Vec<f64>,
    /// Empty where nothing asks for it.
    velocity_m_per_s: Vec<f64>,
}

/// Solves the variants on `n_threads` threads; each recording's impact has the stamp that stands second among its own unknowns. The
/// first variant's velocities are kept as well.
pub(super) fn respond(
    variants: Vec<Variant>,
    schedule: &Schedule,
    places: (&[Observation], &[Own]),
    n_threads: NonZero<usize>,
) -> Result<Vec<Response>, MechanicsError> {
    let struck = |variant: &Variant| variant.family.struck(&variant.chain, &variant.striker).collect();
    let chains: Vec<Vec<Chain>> = variants.iter().map(struck).collect();
    let n_of_first = chains.first().map_or(0, Vec::len);
    let columns = ensemble(&chains.concat(), schedule, n_threads, |i, simulation| {
        Columns::read(&simulation.trajectory, places, i < n_of_first)
    });
    let mut columns = columns.into_iter();
    let response = |(variant, chains): (Variant, &Vec<Chain>)| {
        let nodes = columns.by_ref().take(chains.len()).collect::<Result<_, _>>()?;
        Ok(Response { family: variant.family, nodes })
    };
    variants.into_iter().zip(&chains).map(response).collect()
}

impl Columns {
    fn read(motion: &Trajectory, (observations, own): (&[Observation], &[Own]), with_velocity: bool) -> Self {
        let (mut displacement_m, mut velocity_m_per_s) = (Vec::new(), Vec::new());
        for (observation, own) in observations.iter().zip(own) {
            // At rest until the impact; a motion that ended before says nothing of what follows.
            let moment = |time_s: &f64| motion.at(time_s - own[1]).filter(|_| *time_s >= own[1]);
            let moments: Vec<Option<Moment<'_>>> = observation.times_s.iter().map(moment).collect();
            for track in &observation.bodies {
                let seen = moments.iter().zip(&track.position_m).filter(|(_, position)| position.is_some());
                for (moment, _) in seen {
                    displacement_m.push(moment.map_or(0.0, |moment| moment.displacement_m(track.body - 1)));
                    if with_velocity {
                        velocity_m_per_s
                            .push(moment.map_or(0.0, |moment| moment.velocity_m_per_s(track.body - 1)));
                    }
                }
            }
        }
        Self { displacement_m, velocity_m_per_s }
    }
}

impl Response {
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

    /// Number of simulations behind it.
    pub(super) fn n_simulations(&self) -> u64 {
        self.nodes.len() as u64
    }
}
