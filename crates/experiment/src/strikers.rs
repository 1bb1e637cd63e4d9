//! The wave against the strike: group velocities of several strikers, measured and by the chain model (paper, Fig. 3 c).

use std::num::NonZero;

use chainwave_analysis::{exact_motion, power_exponent};
use chainwave_measurement::Estimate;
use chainwave_mechanics::{Schedule, Striker, simulate};

use crate::damping::TRACKS;
use crate::error::Error;
use crate::evaluation::Evaluation;
use crate::measuring::measure_motion;
use crate::setup::Setup;

/// Striker velocities at which the model is asked, up to a little above the fastest.
const N_MODEL_POINTS: usize = 24;
/// The slowest of them, relative to the fastest strike: nearly the linear chain.
const SLOWEST: f64 = 0.02;

/// The wave after one strike. What the model gives has no uncertainty: its sigmas are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrikerWave {
    /// Velocity of the striker, in metres per second.
    pub striker_m_per_s: Estimate,
    /// Group velocity, in metres per second.
    pub group_m_per_s: Estimate,
    /// Velocity of the bodies as the pulse's peak passes, on average over the gaps of the group velocity, in metres per second.
    pub particle_m_per_s: Option<Estimate>,
    /// Whence it is known.
    pub source: WaveSource,
}

/// Whence a wave is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveSource {
    /// It was measured.
    Experiment,
    /// The chain model with the fitted damping makes it.
    ChainModel,
}

impl WaveSource {
    /// The name in tables and figures.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Experiment => "experiment",
            Self::ChainModel => "chain model",
        }
    }
}

/// The waves of several strikers, measured, and by the chain model from nearly linear ones to a little above the fastest.
///
/// # Errors
/// A chain that cannot be simulated.
pub fn compare_strikers(
    setups: &[Setup],
    evaluations: &[Evaluation],
    n_threads: NonZero<usize>,
) -> Result<Vec<StrikerWave>, Error> {
    let pairs = setups.iter().zip(evaluations);
    let mut waves: Vec<StrikerWave> = pairs.filter_map(|(setup, found)| measured(setup, found)).collect();
    if let Some((setup, found)) = setups.iter().zip(evaluations).next() {
        waves.extend(modelled(setup, found, n_threads)?);
    }
    Ok(waves)
}

/// The exponent m of c_g ~ v_p^m, the group velocity of one source over the velocity of the bodies: 0 for springs, 1/5 for spheres of Hertz's law
/// that nothing presses together (V. F. Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733). None for fewer than three waves.
pub fn speed_exponent(waves: &[StrikerWave], source: WaveSource) -> Option<Estimate> {
    let of_source = || waves.iter().filter(|wave| wave.source == source);
    let points = |exponent: f64| -> Vec<(f64, Estimate)> {
        let point = |wave: &StrikerWave| {
            let (particle, group) = (wave.particle_m_per_s?, wave.group_m_per_s);
            // What the velocity of the bodies is uncertain by moves a point along the line.
            let along = exponent * group.value * particle.sigma / particle.value;
            Some((particle.value, Estimate::new(group.value, group.sigma.hypot(along))))
        };
        of_source().filter_map(point).collect()
    };
    let first = power_exponent(&points(0.0))?;
    power_exponent(&points(first.value))
}

/// The measured group velocity; the striker's is the fitted mean where the fit holds, else the stated one.
fn measured(setup: &Setup, evaluation: &Evaluation) -> Option<StrikerWave> {
    let striker = setup.experiment.striker.as_ref()?;
    let nominal = striker.mean_velocity_m_per_s(evaluation.stitched.alignments.len());
    let fit = evaluation.track_fit.as_ref().ok().filter(|_| evaluation.damping.reason(TRACKS).is_none());
    let striker = fit.map_or(nominal, |fit| fit.striker_velocity_m_per_s);
    let found = evaluation.measurement.group_velocity.as_ref().ok()?;
    Some(StrikerWave {
        striker_m_per_s: striker,
        group_m_per_s: found.velocity_m_per_s,
        particle_m_per_s: found.particle_velocity_m_per_s,
        source: WaveSource::Experiment,
    })
}

/// The chain model's group velocity over the same gaps, with the damping found at the fastest strike.
fn modelled(
    setup: &Setup,
    evaluation: &Evaluation,
    n_threads: NonZero<usize>,
) -> Result<Vec<StrikerWave>, Error> {
    let stated = &evaluation.damping;
    let (Ok(c_d), Ok(c_s)) = (&stated.chain_damping_kg_per_s, &stated.striker_damping_kg_per_s) else {
        return Ok(Vec::new());
    };
    let gaps = evaluation.measurement.group_velocity.as_ref().ok().map(|found| found.gaps.0..=found.gaps.1);
    let experiment = &setup.experiment;
    let Some(striker) = &experiment.striker else { return Ok(Vec::new()) };
    let fastest_m_per_s = 1.1 * striker.velocity_m_per_s.get();
    let crossing_s = experiment.linear_chain()?.crossing_time_s(experiment.chain.n_bodies);
    let schedule = Schedule::automatic(1.5 * crossing_s, crossing_s / 400.0);
    let mut waves = Vec::with_capacity(N_MODEL_POINTS);
    for k in 0..N_MODEL_POINTS {
        let share = SLOWEST + (1.0 - SLOWEST) * k as f64 / (N_MODEL_POINTS - 1) as f64;
        let velocity_m_per_s = share * fastest_m_per_s;
        let struck_by =
            Striker { mass_kg: striker.mass_kg.get(), velocity_m_per_s, damping_kg_per_s: c_s.value };
        let model = experiment.chain_struck_by(struck_by, c_d.value)?;
        let motion = exact_motion(&simulate(&model, &schedule)?.trajectory);
        if let Ok(found) = measure_motion(experiment, &motion, gaps.clone(), n_threads)?.group_velocity {
            waves.push(StrikerWave {
                striker_m_per_s: Estimate::new(velocity_m_per_s, 0.0),
                group_m_per_s: found.velocity_m_per_s,
                particle_m_per_s: found.particle_velocity_m_per_s,
                source: WaveSource::ChainModel,
            });
        }
    }
    Ok(waves)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(speed: fn(f64) -> f64) -> Vec<StrikerWave> {
        let wave = |particle: f64| StrikerWave {
            striker_m_per_s: Estimate::new(particle, 0.0),
            group_m_per_s: Estimate::new(speed(particle), 0.01),
            particle_m_per_s: Some(Estimate::new(particle, 0.01 * particle)),
            source: WaveSource::Experiment,
        };
        [0.5, 1.0, 2.0, 4.0].map(wave).to_vec()
    }

    #[test]
    fn an_exponent_knows_what_the_bodies_velocity_is_uncertain_by() {
        let found =
            speed_exponent(&waves(|particle| 30.0 * particle.powf(0.2)), WaveSource::Experiment).unwrap();
        // Four logarithms, ln 2 apart, have a sum of squares of 5 ln^2 2 about their mean; each is known to 0.2 % by its velocity of the bodies
        // and to 0.03 % or less by its own.
        let sigma = 0.2 * 0.01 / (5.0_f64.sqrt() * 2.0_f64.ln());
        assert!(
            (found.value - 0.2).abs() < 1e-9 && (found.sigma / sigma - 1.0).abs() < 0.05,
            "{found:?} {sigma}"
        );
        assert!(speed_exponent(&waves(|_| 30.0)[..2], WaveSource::Experiment).is_none());
        assert!(speed_exponent(&waves(|_| 30.0), WaveSource::ChainModel).is_none());
    }

    #[test]
    fn speeds_that_follow_no_power_law_have_an_exponent_that_is_hardly_known() {
        let found =
            speed_exponent(&waves(|particle| 30.0 + (particle - 2.0).powi(2)), WaveSource::Experiment);
        // The slope between neighbours goes from -0.05 to 0.18.
        assert!(found.unwrap().sigma > 0.02, "{found:?}");
    }
}
