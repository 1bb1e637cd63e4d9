//! A motion measured by an experiment's settings.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{
    FrontSettings, MeasureSettings, Measurement, PeakEnergies, measure, measure_peak_energies,
};
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
    let settings = MeasureSettings { velocity_gaps, ..measure_settings(experiment, n_threads)? };
    let of_gaps = energies_of_gaps(experiment)?;
    Ok(measure(motion, &settings, Some(&|gap, overlap_m| energy_j(&of_gaps, gap, overlap_m)))?)
}

/// The peak energies that [`measure_motion`] finds, alone.
pub(crate) fn peak_energies_of(
    experiment: &Experiment,
    motion: &ChainMotion,
    n_threads: NonZero<usize>,
) -> Result<PeakEnergies, Error> {
    let settings = measure_settings(experiment, n_threads)?;
    let of_gaps = energies_of_gaps(experiment)?;
    Ok(measure_peak_energies(motion, &settings, &|gap, overlap_m| energy_j(&of_gaps, gap, overlap_m))?)
}

fn measure_settings(experiment: &Experiment, n_threads: NonZero<usize>) -> Result<MeasureSettings, Error> {
    let (chain, analysis) = (&experiment.chain, &experiment.analysis);
    Ok(MeasureSettings {
        front: front_settings(experiment),
        n_replicas: analysis.n_replicas,
        n_threads,
        ..MeasureSettings::new(chain.spacing()?, analysis.seed)
    })
}

/// The potential energy, in joules, of a gap at an overlap in metres.
type EnergyOfGap = Box<dyn Fn(f64) -> f64 + Send + Sync>;

fn energies_of_gaps(experiment: &Experiment) -> Result<Vec<EnergyOfGap>, Error> {
    let n_bodies = experiment.chain.n_bodies;
    let contacts = experiment.contact.contacts(n_bodies)?;
    Ok((0..n_bodies - 1).map(|gap| Box::new(contacts.of_gap(gap).energy()) as EnergyOfGap).collect())
}

/// Of gap number `gap`, from 1.
fn energy_j(of_gaps: &[EnergyOfGap], gap: usize, overlap_m: f64) -> f64 {
    of_gaps.get(gap - 1).map_or(0.0, |energy| energy(overlap_m))
}

pub(crate) fn front_settings(experiment: &Experiment) -> FrontSettings {
    FrontSettings { edge_fraction: experiment.analysis.edge_fraction, ..FrontSettings::default() }
}
