//! The wave against the strike: group velocities of several strikers, measured and by the chain model (paper, Fig. 3 c).

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{GapFront, Missing, exact_motion, power_exponent};
use chainwave_measurement::Estimate;
use chainwave_mechanics::{Schedule, Striker, simulate};

use crate::chain::measuring::measure_motion;
use crate::error::Error;
use crate::evaluation::Evaluation;
use crate::fitting::damping::TRACKS;
use crate::setup::Setup;

/// Striker velocities at which the model is asked, up to a little above the fastest.
const N_MODEL_POINTS: usize = 24;
/// The slowest of them, relative to the fastest strike: nearly the linear chain.
const SLOWEST: f64 = 0.02;
/// A pulse keeps at least this share of its peak from one gap to the next, and that one from the first gap of the group velocity to the last: what
/// keeps less dies out, as in a chain of which some strikes drive no wave at all, and a speed that is read off what is left is none.
const LEAST_KEPT: f64 = 0.5;
const LEAST_LEFT: f64 = 0.1;

/// The wave after one strike. What the model gives has no uncertainty: its sigmas are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrikerWave {
    /// Velocity of the striker, in metres per second.
    pub striker_m_per_s: Estimate,
    /// Group velocity, in metres per second.
    pub group_m_per_s: Estimate,
    /// Velocity of the bodies as the pulse's peak passes, on average over the gaps of the group velocity, in metres per second.
    pub particle_m_per_s: Option<Estimate>,
    /// First and last gap of the group velocity.
    pub gaps: (usize, usize),
    /// Whence it is known.
    pub source: WaveSource,
}

/// Whence a wave is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveSource {
    /// It was measured.
    Experiment,
    /// The chain model with the fitted damping makes it, at velocities close to each other, all over the same gaps.
    ChainModel,
    /// The same at a velocity that was measured, over the gaps that were measured there: what is to be compared with the measured wave.
    ChainModelBeside,
}

impl WaveSource {
    /// The name in tables and figures.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Experiment => "experiment",
            Self::ChainModel => "chain model",
            Self::ChainModelBeside => "chain model, same gaps",
        }
    }
}

/// The waves of several strikers, fastest first: measured, by the chain model at the same velocities, and by it from nearly linear ones to a little
/// above the fastest.
///
/// # Errors
/// A chain that cannot be simulated.
pub fn compare_strikers(
    evaluated: &[(&Setup, &Evaluation)],
    n_threads: NonZero<usize>,
) -> Result<Vec<StrikerWave>, Error> {
    let mut waves: Vec<StrikerWave> =
        evaluated.iter().filter_map(|(setup, found)| measured(setup, found)).collect();
    let Some(model) = evaluated.iter().find_map(|(setup, found)| Model::of(setup, found, n_threads)) else {
        return Ok(waves);
    };
    for measured in waves.clone() {
        let gaps = Some(measured.gaps.0..=measured.gaps.1);
        let wave = model.wave(measured.striker_m_per_s.value, gaps)?;
        let source = WaveSource::ChainModelBeside;
        waves.extend(wave.map(|wave| StrikerWave {
            striker_m_per_s: measured.striker_m_per_s,
            source,
            ..wave
        }));
    }
    let strikers = evaluated.iter().filter_map(|(setup, _)| setup.experiment.striker.as_ref());
    let fastest_m_per_s = strikers.map(|striker| striker.velocity_m_per_s.get()).fold(0.0, f64::max);
    for k in 0..N_MODEL_POINTS {
        let share = SLOWEST + (1.0 - SLOWEST) * k as f64 / (N_MODEL_POINTS - 1) as f64;
        waves.extend(model.wave(1.1 * share * fastest_m_per_s, model.gaps.clone())?);
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
        gaps: found.gaps,
        source: WaveSource::Experiment,
    })
}

/// The chain model, with the damping found at the fastest strike that tells it.
struct Model<'a> {
    setup: &'a Setup,
    dampings_kg_per_s: [f64; 2],
    /// Gaps of the group velocity that was measured there.
    gaps: Option<RangeInclusive<usize>>,
    n_threads: NonZero<usize>,
}

impl<'a> Model<'a> {
    fn of(setup: &'a Setup, evaluation: &Evaluation, n_threads: NonZero<usize>) -> Option<Self> {
        let stated = &evaluation.damping;
        let c_d = stated.chain_damping_kg_per_s.as_ref().ok()?.value;
        let c_s = stated.striker_damping_kg_per_s.as_ref().ok()?.value;
        let found = evaluation.measurement.group_velocity.as_ref().ok();
        let gaps = found.map(|found| found.gaps.0..=found.gaps.1);
        Some(Self { setup, dampings_kg_per_s: [c_d, c_s], gaps, n_threads })
    }

    /// The wave after a strike, its group velocity over the given gaps; none where it dies out among them.
    fn wave(
        &self,
        velocity_m_per_s: f64,
        gaps: Option<RangeInclusive<usize>>,
    ) -> Result<Option<StrikerWave>, Error> {
        let experiment = &self.setup.experiment;
        let Some(striker) = &experiment.striker else { return Ok(None) };
        let [c_d, damping_kg_per_s] = self.dampings_kg_per_s;
        let struck_by = Striker {
            mass_kg: striker.mass_kg.get(),
            velocity_m_per_s,
            damping_kg_per_s,
            ground_damping_kg_per_s: 0.0,
        };
        let crossing_s = experiment.linear_chain()?.crossing_time_s(experiment.chain.n_bodies);
        let schedule = Schedule::automatic(1.5 * crossing_s, crossing_s / 400.0);
        let simulation = simulate(&experiment.chain_struck_by(struck_by, c_d)?, &schedule)?;
        let motion = exact_motion(&simulation.trajectory);
        let measurement = measure_motion(experiment, &motion, gaps, self.n_threads)?;
        let Ok(found) = measurement.group_velocity else { return Ok(None) };
        Ok(goes_on(&measurement.fronts, found.gaps).then_some(StrikerWave {
            striker_m_per_s: Estimate::new(velocity_m_per_s, 0.0),
            group_m_per_s: found.velocity_m_per_s,
            particle_m_per_s: found.particle_velocity_m_per_s,
            gaps: found.gaps,
            source: WaveSource::ChainModel,
        }))
    }
}

/// Whether a pulse goes on from one gap to another; row i of `fronts` is gap i + 1.
fn goes_on(fronts: &[Result<GapFront, Missing>], (first, last): (usize, usize)) -> bool {
    let peak = |gap: usize| Some(fronts.get(gap.checked_sub(1)?)?.as_ref().ok()?.peak_strain.value.abs());
    let (Some(at_first), Some(at_last)) = (peak(first), peak(last)) else { return false };
    let peaks: Vec<f64> = (first..=last).filter_map(peak).collect();
    at_last >= LEAST_LEFT * at_first && peaks.windows(2).all(|pair| pair[1] >= LEAST_KEPT * pair[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(speed: fn(f64) -> f64) -> Vec<StrikerWave> {
        let wave = |particle: f64| StrikerWave {
            striker_m_per_s: Estimate::new(particle, 0.0),
            group_m_per_s: Estimate::new(speed(particle), 0.01),
            particle_m_per_s: Some(Estimate::new(particle, 0.01 * particle)),
            gaps: (3, 9),
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
    #[test]
    fn a_pulse_that_dies_out_is_no_wave() {
        let fronts = |peaks: &[Option<f64>]| -> Vec<Result<GapFront, Missing>> {
            let front = |(gap, peak): (usize, &Option<f64>)| {
                peak.map(|peak| GapFront {
                    gap,
                    peak_time_s: Estimate::new(1e-3 * gap as f64, 0.0),
                    peak_strain: Estimate::new(-peak, 0.0),
                    edge_time_s: None,
                    particle_velocity_m_per_s: None,
                })
                .ok_or(Missing::NoPulse)
            };
            (1..).zip(peaks).map(front).collect()
        };
        // A linear chain's first pulse falls as the cube root of the way.
        let linear: Vec<Option<f64>> =
            (1..20).map(|gap| Some(0.05 * f64::from(gap).powf(-1.0 / 3.0))).collect();
        assert!(goes_on(&fronts(&linear), (3, 19)));
        // In a chain that lets no such wave pass it falls by a constant share.
        let evanescent: Vec<Option<f64>> = (1..20).map(|gap| Some(0.05 * 0.7_f64.powi(gap))).collect();
        assert!(!goes_on(&fronts(&evanescent), (3, 19)) && goes_on(&fronts(&evanescent), (3, 6)));
        let stopped = [0.05, 0.05, 0.05, 0.05, 0.02].map(Some);
        assert!(goes_on(&fronts(&stopped), (1, 4)) && !goes_on(&fronts(&stopped), (1, 5)));
        assert!(!goes_on(&fronts(&[Some(0.05), Some(0.05), None]), (1, 3)));
    }
}
