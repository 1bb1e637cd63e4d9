//! How the bodies of the chain, as it is stated, answer to the drive: what an alignment without a fitted model takes their onsets from.

use chainwave_mechanics::{Schedule, simulate};
use chainwave_stitching::{ModelResponse, StatedResponse};
use ndarray::{Array2, ArrayView1, s};

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
/// Relative change of the drive, to both sides, that a slope is taken over: what is stated of strikers may be that hardly anything is known.
const CHANGE: f64 = 0.01;
/// Factors on the dampings that are taken for the chain's.
const OTHER_DAMPINGS: [[f64; 2]; 2] = [[4.0, 1.0], [1.0, 3.0]];
/// The drives' mean may be off by one standard deviation of them, and by no more than this share.
const LARGEST_ERROR: f64 = 0.5;

impl Experiment {
    /// Body by body.
    ///
    /// # Errors
    /// A chain that cannot be solved.
    pub(crate) fn stated_responses(&self) -> Result<Vec<StatedResponse>, Error> {
        let stated = self.responses(1.0, STARTING_SHARES)?;
        let dampings = OTHER_DAMPINGS.map(|factors| [0, 1].map(|k| factors[k] * STARTING_SHARES[k]));
        let stronger = 1.0 + self.drive_scatter().min(LARGEST_ERROR);
        let otherwise = dampings.map(|shares| self.responses(1.0, shares)).into_iter();
        let otherwise = otherwise.chain([self.responses(stronger, STARTING_SHARES)]);
        let mut all: Vec<StatedResponse> =
            stated.into_iter().map(|stated| StatedResponse { stated, otherwise: Vec::new() }).collect();
        for otherwise in otherwise {
            for (body, other) in all.iter_mut().zip(otherwise?) {
                body.otherwise.push(other);
            }
        }
        Ok(all)
    }

    /// With drives so many times as strong as stated, and dampings of that share of the critical one.
    fn responses(&self, strength: f64, shares: [f64; 2]) -> Result<Vec<ModelResponse>, Error> {
        let linear = self.linear_chain()?;
        let dampings = shares.map(|share| share * linear.critical_damping_kg_per_s());
        let crossing_s = linear.crossing_time_s(self.chain.n_bodies);
        let duration_s = self.crossings_s(CROSSINGS)?;
        let schedule = Schedule::automatic(duration_s, crossing_s / SAMPLES);
        let strength = strength * self.nominal_drive().value;
        let moved = |factor: f64| -> Result<Array2<f64>, Error> {
            let chain = self.chain_driven(factor * strength, dampings, duration_s)?;
            Ok(self.seen_from_rest(simulate(&chain, &schedule)?.trajectory).displacement_m)
        };
        let [motion_m, faster_m, slower_m] = [1.0, 1.0 + CHANGE, 1.0 - CHANGE].map(moved);
        let (motion_m, slope_m) = (motion_m?, (faster_m? - slower_m?) / (2.0 * CHANGE));
        let of_bodies = motion_m.rows().into_iter().zip(slope_m.rows());
        Ok(of_bodies.map(|(motion_m, slope_m)| onset(&motion_m, &slope_m, crossing_s / SAMPLES)).collect())
    }
}

/// Of a motion and its slope, the part that holds the onset.
fn onset(motion_m: &ArrayView1<'_, f64>, slope_m: &ArrayView1<'_, f64>, interval_s: f64) -> ModelResponse {
    let furthest_m = motion_m.fold(0.0_f64, |furthest, x_m| furthest.max(x_m.abs()));
    let moved =
        |share: f64| motion_m.iter().position(|x_m| x_m.abs() > share * furthest_m).unwrap_or(motion_m.len());
    let kept =
        |all: &ArrayView1<'_, f64>| all.slice(s![moved(AT_REST).saturating_sub(1)..moved(KEPT)]).to_vec();
    ModelResponse { interval_s, furthest_m, motion_m: kept(motion_m), slope_m: kept(slope_m) }
}
