//! A motion measured by an experiment's settings.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{FrontSettings, MeasureSettings, Measurement, measure};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::PowerLaw;

use crate::configuration::Experiment;
use crate::error::Error;

/// Measures a motion by the experiment's settings; the group velocity over the given gaps, or those that the motion suggests.
///
/// # Errors
/// A motion too short to measure.
pub fn measure_motion(
    experiment: &Experiment,
    motion: &ChainMotion,
    law: &PowerLaw,
    velocity_gaps: Option<RangeInclusive<usize>>,
    n_threads: NonZero<usize>,
) -> Result<Measurement, Error> {
    let (chain, analysis) = (&experiment.chain, &experiment.analysis);
    let settings = MeasureSettings {
        front: front_settings(experiment),
        velocity_gaps,
        n_replicas: analysis.n_replicas,
        n_threads,
        ..MeasureSettings::new(chain.pitch_m.get(), analysis.seed)
    };
    Ok(measure(motion, &settings, Some(&|overlap_m| law.energy_j(overlap_m)))?)
}

pub(crate) fn front_settings(experiment: &Experiment) -> FrontSettings {
    FrontSettings { edge_fraction: experiment.analysis.edge_fraction, ..FrontSettings::default() }
}
