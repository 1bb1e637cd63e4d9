//! A motion measured by an experiment's settings.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{
    AnalysisError, EnergyLaw, FrontSettings, GapFront, MeasureSettings, Measurement, Missing, PeakEnergies,
    measure, measure_peak_energies,
};
use chainwave_measurement::{ChainMotion, median};

use crate::chain::released::Sense;
use crate::configuration::Experiment;
use crate::error::Error;

/// The gaps of the group velocity where the experiment names the last one. Where it names the first one alone, the pulse counts as formed there, and
/// goes as far as it is one.
pub(crate) fn chosen_gaps(experiment: &Experiment) -> Option<RangeInclusive<usize>> {
    let analysis = &experiment.analysis;
    let last = analysis.last_gap?;
    // Three gaps at least tell a velocity.
    let usual = MeasureSettings::FIRST_GAP.min(last.saturating_sub(2)).max(1);
    Some(analysis.first_gap.unwrap_or(usual)..=last)
}

/// Measures a motion by the experiment's settings; the group velocity over the given gaps, or those that the motion suggests.
///
/// Of a chain that is let go strain is its change from the state in which it is held, and its wave may be one of rarefaction; energies are
/// those that its contacts hold.
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
    let (sense, mut found) = measured_as_held(experiment, motion, |turned, energy_of| {
        measure(turned, &settings, Some(energy_of))
    })?;
    if experiment.is_shaken() {
        // What stands out behind the first crest is the drive, its multiples and what leaks from them.
        found.local_resonance = Err(Missing::StillDriven);
        if !follows_one_crest(&found.fronts) {
            found.group_velocity = Err(Missing::OtherCrests);
            found.half_widths.clear();
        }
    }
    Ok(sense.turned_back(found))
}

/// The peak energies that [`measure_motion`] finds, alone.
pub(crate) fn peak_energies_of(
    experiment: &Experiment,
    motion: &ChainMotion,
    n_threads: NonZero<usize>,
) -> Result<PeakEnergies, Error> {
    let settings = measure_settings(experiment, n_threads)?;
    let (_, found) = measured_as_held(experiment, motion, |turned, energy_of| {
        measure_peak_energies(turned, &settings, energy_of)
    })?;
    Ok(found)
}

/// What is measured of a motion by the energies that its contacts hold, and the sense in which it is: of a chain that is let go that of its
/// wave, with overlaps that count from those in which it is held.
fn measured_as_held<T>(
    experiment: &Experiment,
    motion: &ChainMotion,
    measured: impl FnOnce(&ChainMotion, EnergyLaw<'_>) -> Result<T, AnalysisError>,
) -> Result<(Sense, T), Error> {
    let of_gaps = energies_of_gaps(experiment)?;
    let Some(held_m) = experiment.held_overlaps_m()? else {
        let energy_of = |gap: usize, overlap_m: f64| energy_j(&of_gaps, gap, overlap_m);
        return Ok((Sense::Compression, measured(motion, &energy_of)?));
    };
    let sense = Sense::of(motion);
    let since_held = |gap: usize, overlap_m: f64| {
        let held_m = held_m.get(gap - 1).copied().unwrap_or(0.0);
        energy_j(&of_gaps, gap, held_m + sense.sign() * overlap_m)
    };
    Ok((sense, measured(&sense.turned(motion), &since_held)?))
}

fn measure_settings(experiment: &Experiment, n_threads: NonZero<usize>) -> Result<MeasureSettings, Error> {
    let (chain, analysis) = (&experiment.chain, &experiment.analysis);
    let usual = MeasureSettings::new(chain.spacing()?, analysis.seed);
    let formed = analysis.first_gap.filter(|_| analysis.last_gap.is_none());
    Ok(MeasureSettings {
        first_gap: formed.unwrap_or(usual.first_gap),
        front: front_settings(experiment),
        n_replicas: analysis.n_replicas,
        n_threads,
        ..usual
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

/// Whether the peaks of all gaps may be one crest of the train that a shaken chain carries. Its first crests grow, so that the one that
/// stands out first may be a later one where the train has weakened, or grown: then a step from one gap to the next takes a period more or
/// less, several times as long as the others.
fn follows_one_crest(fronts: &[Result<GapFront, Missing>]) -> bool {
    const MOST: f64 = 3.0;
    const LEAST: f64 = -1.0;
    let seen: Vec<&GapFront> = fronts.iter().flatten().collect();
    let step_s = |pair: &[&GapFront]| {
        let n_gaps = (pair[1].gap - pair[0].gap) as f64;
        (pair[1].peak_time_s.value - pair[0].peak_time_s.value) / n_gaps
    };
    let steps_s: Vec<f64> = seen.windows(2).map(step_s).collect();
    let usual_s = median(steps_s.clone()).unwrap_or(0.0);
    steps_s.iter().all(|step_s| (LEAST * usual_s..=MOST * usual_s).contains(step_s))
}

fn front_settings(experiment: &Experiment) -> FrontSettings {
    FrontSettings { edge_fraction: experiment.analysis.edge_fraction, ..FrontSettings::default() }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    #[test]
    fn a_crest_that_was_missed_is_told() {
        let fronts = |times_ms: &[f64]| -> Vec<Result<GapFront, Missing>> {
            let front = |(gap, time_ms): (usize, &f64)| GapFront {
                gap,
                peak_time_s: Estimate::new(1e-3 * time_ms, 1e-7),
                peak_strain: Estimate::new(-0.01, 1e-5),
                edge_time_s: None,
                particle_velocity_m_per_s: None,
            };
            (1..).zip(times_ms).map(|one| Ok(front(one))).collect()
        };
        assert!(follows_one_crest(&fronts(&[1.0, 1.6, 2.1, 2.8, 3.3])));
        // 4 ms later: a period of 250 Hz; and as much sooner.
        assert!(!follows_one_crest(&fronts(&[1.0, 1.6, 2.1, 6.8, 7.3])));
        assert!(!follows_one_crest(&fronts(&[5.0, 5.6, 2.1, 2.8, 3.3])));
        assert!(follows_one_crest(&fronts(&[])));
    }
}
