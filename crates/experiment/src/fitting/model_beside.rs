//! The fitted chain model beside the measurement.

use std::ops::RangeInclusive;

use chainwave_analysis::{DampingShare, Measurement, damping_share, exact_motion};
use chainwave_inference::{TrackFit, fitted_motion};
use chainwave_measurement::{ChainMotion, Trajectory};
use chainwave_mechanics::{Chain, Drive, Schedule, simulate};

use crate::chain::measuring::measure_motion;
use crate::configuration::Experiment;
use crate::error::Error;

/// The chain model with the fitted damping.
pub struct ModelBeside {
    /// Its motion on the measured time base.
    pub motion: Trajectory,
    /// What the analysis makes of that motion.
    pub measurement: Measurement,
    /// Peak potential energies with the fitted damping, gap by gap, in joules.
    pub damped_j: Vec<f64>,
    /// The same without damping.
    pub undamped_j: Vec<f64>,
}

impl ModelBeside {
    /// What damping took of the peak energy, and what dispersion and rarefaction did, two thirds down the chain: the last gaps
    /// before a free end never fill.
    pub fn damping_share(&self) -> Option<DampingShare> {
        let shares = damping_share(&self.damped_j, &self.undamped_j);
        shares.get(2 * shares.len() / 3).copied()
    }
}

pub(crate) fn model_beside(
    experiment: &Experiment,
    motion: &ChainMotion,
    fit: &TrackFit,
    velocity_gaps: Option<RangeInclusive<usize>>,
) -> Result<ModelBeside, Error> {
    let model = &fit.model;
    let fitted = fitted_motion(fit, &motion.times_s)?;
    let measurement = measure_motion(experiment, &exact_motion(&fitted), velocity_gaps, model.n_threads)?;
    let energies = |damping: f64| -> Result<Vec<f64>, Error> {
        let chain = Chain {
            damping_kg_per_s: experiment
                .chain
                .dampings_kg_per_s(damping * fit.damping.chain_damping_kg_per_s.value)?,
            drive: driven(fit, damping),
            ..model.chain.clone()
        };
        // Long enough for the wave to cross the chain at half the sound speed.
        let duration_s = 2.0 * experiment.linear_chain()?.crossing_time_s(model.chain.n_bodies());
        let schedule = Schedule::automatic(duration_s, duration_s / 100.0);
        Ok(simulate(&chain, &schedule)?.psi_max_j)
    };
    Ok(ModelBeside { motion: fitted, measurement, damped_j: energies(1.0)?, undamped_j: energies(0.0)? })
}

/// The mean drive that a fit found, with a part of the damping of its striker's contact.
fn driven(fit: &TrackFit, damping: f64) -> Drive {
    let mut drive = fit.model.chain.drive.with_strength(fit.striker_velocity_m_per_s.value);
    if let Drive::Striker(striker) = &mut drive {
        striker.damping_kg_per_s = damping * fit.damping.striker_damping_kg_per_s.value;
        striker.ground_damping_kg_per_s = 0.0;
    }
    drive
}
