//! How the chain moves as it is stated, solved once for all that ask: when its wave comes, how fast it runs, and how bodies answer to the drive.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;
use chainwave_mechanics::{Change, Schedule, Sensitivities, Simulation, simulate_with_sensitivities};
use chainwave_stitching::{ModelResponse, StatedResponse};
use ndarray::{ArrayView1, s};

use crate::chain_model::STARTING_SHARES;
use crate::configuration::Experiment;
use crate::error::Error;

/// Samples of a motion while a weak wave crosses the chain...
const SAMPLES: f64 = 2000.0;
/// ...once, and half as long again.
const CROSSINGS: f64 = 1.5;
/// What is kept of a body's motion: until it has moved this share of its way, which holds every onset...
const KEPT: f64 = 0.3;
/// ...from where it has moved this share of that.
const AT_REST: f64 = 1e-5;
/// Relative change of the drive, to both sides, of which its slope is made. A striker's velocity changes what follows in proportion from its first
/// instant on; of a load that a chain is let go from what follows bends, by the square of this.
const CHANGE: f64 = 1e-3;
/// Factors on the dampings that are taken for the chain's.
const OTHER_DAMPINGS: [[f64; 2]; 2] = [[4.0, 1.0], [1.0, 3.0]];
/// The drives' mean may be off by one standard deviation of them, and by no more than this share.
const LARGEST_ERROR: f64 = 0.5;

/// The motion of the stated chain with usual damping, for as long as a weak wave takes to cross it and half as long again.
pub(crate) struct StatedMotion {
    simulation: Simulation,
    /// How its bodies answer to the drive, body by body.
    pub(crate) responses: Vec<StatedResponse>,
}

impl StatedMotion {
    /// Solves it, and what else it may be.
    ///
    /// # Errors
    /// A chain that cannot be solved.
    pub(crate) fn of(experiment: &Experiment, n_threads: NonZero<usize>) -> Result<Self, Error> {
        let stronger = 1.0 + experiment.drive_scatter().min(LARGEST_ERROR);
        let otherwise = OTHER_DAMPINGS.map(|factors| (1.0, [0, 1].map(|k| factors[k] * STARTING_SHARES[k])));
        let cases = [&[(1.0, STARTING_SHARES)], &otherwise[..], &[(stronger, STARTING_SHARES)]].concat();
        let solved = map_in_parallel(cases.len(), n_threads, |case| driven(experiment, cases[case]));
        let mut solved = solved.into_iter().collect::<Result<Vec<Sensitivities>, Error>>()?;
        let otherwise = solved.split_off(1);
        let stated = solved.swap_remove(0);
        let response = |body: usize| StatedResponse {
            stated: onset(&stated, body),
            otherwise: otherwise.iter().map(|other| onset(other, body)).collect(),
        };
        let responses = (0..experiment.chain.n_bodies).map(response).collect();
        Ok(Self { simulation: stated.simulation, responses })
    }

    /// How long after the first body's each body's motion begins, in seconds: it has begun where the body has moved so far.
    pub(crate) fn arrivals_s(&self, moved_m: f64) -> Vec<f64> {
        let motion = &self.simulation.trajectory;
        let arrival_s = |row: ArrayView1<'_, f64>| {
            let arrived = row.iter().position(|x_m| (x_m - row[0]).abs() > moved_m);
            motion.times_s[arrived.map_or(motion.times_s.len() - 1, |frame| frame.saturating_sub(1))]
        };
        motion.displacement_m.rows().into_iter().map(arrival_s).collect()
    }

    /// The leading pulse's speed in metres per second, for a pitch in metres; none where the chain has no such pulse.
    pub(crate) fn group_velocity_m_per_s(&self, pitch_m: f64) -> Option<f64> {
        self.simulation.group_velocity_m_per_s(pitch_m)
    }
}

/// A motion and its slope against the drive's relative deviation, with a drive so many times as strong as stated, and dampings of that share of
/// the critical one.
fn driven(experiment: &Experiment, (strength, shares): (f64, [f64; 2])) -> Result<Sensitivities, Error> {
    let linear = experiment.linear_chain()?;
    let dampings = shares.map(|share| share * linear.critical_damping_kg_per_s());
    let duration_s = experiment.crossings_s(CROSSINGS)?;
    let interval_s = linear.crossing_time_s(experiment.chain.n_bodies) / SAMPLES;
    let stated = experiment.nominal_drive().value;
    let chain = |factor: f64| experiment.chain_driven(factor * strength * stated, dampings, duration_s);
    let by_drive = Change { below: chain(1.0 - CHANGE)?, above: chain(1.0 + CHANGE)?, width: 2.0 * CHANGE };
    let schedule = Schedule::automatic(duration_s, interval_s);
    let Sensitivities { mut simulation, derivatives } =
        simulate_with_sensitivities(&chain(1.0)?, &schedule, &[by_drive])?;
    simulation.trajectory = experiment.seen_from_rest(simulation.trajectory);
    let derivatives = derivatives.into_iter().map(|slope| experiment.seen_from_rest(slope)).collect();
    Ok(Sensitivities { simulation, derivatives })
}

/// Of a body's motion and its slope the part that holds the onset.
fn onset(driven: &Sensitivities, body: usize) -> ModelResponse {
    let (motion, slope) = (&driven.simulation.trajectory, &driven.derivatives[0]);
    let motion_m = motion.displacement_m.row(body);
    let furthest_m = motion_m.fold(0.0_f64, |furthest, x_m| furthest.max(x_m.abs()));
    let moved =
        |share: f64| motion_m.iter().position(|x_m| x_m.abs() > share * furthest_m).unwrap_or(motion_m.len());
    let kept = s![moved(AT_REST).saturating_sub(1)..moved(KEPT)];
    ModelResponse {
        interval_s: motion.times_s[1] - motion.times_s[0],
        furthest_m,
        motion_m: motion_m.slice(kept).to_vec(),
        slope_m: slope.displacement_m.row(body).slice(kept).to_vec(),
    }
}
