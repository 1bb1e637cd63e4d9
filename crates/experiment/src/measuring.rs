//! A motion measured by an experiment's settings.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{FrontSettings, MeasureSettings, Measurement, measure};
use chainwave_measurement::ChainMotion;

use crate::configuration::Experiment;
use crate::error::Error;

/// Measures a motion by the experiment's settings; the group velocity over the given gaps, or those that the motion suggests.
///
/// # Errors
/// A motion too short to measure.
pub fn measure_motion(
    experiment: &Experiment,
    motion: &ChainMotion,
    velocity_gaps: Option<RangeInclusive<usize>>,
    n_threads: NonZero<usize>,
) -> Result<Measurement, Error> {
    let (chain, analysis) = (&experiment.chain, &experiment.analysis);
    let settings = MeasureSettings {
        front: front_settings(experiment),
        velocity_gaps,
        n_replicas: analysis.n_replicas,
        n_threads,
        ..MeasureSettings::new(chain.spacing()?, analysis.seed)
    };
    let contacts = experiment.contact.contacts(chain.n_bodies)?;
    let of_gaps: Vec<_> = (0..chain.n_bodies - 1).map(|gap| contacts.of_gap(gap).energy()).collect();
    let energy_of = |gap: usize, overlap_m: f64| of_gaps.get(gap - 1).map_or(0.0, |energy| energy(overlap_m));
    Ok(measure(motion, &settings, Some(&energy_of))?)
}

pub(crate) fn front_settings(experiment: &Experiment) -> FrontSettings {
    FrontSettings { edge_fraction: experiment.analysis.edge_fraction, ..FrontSettings::default() }
}
