//! Everything that one motion yields, with uncertainties from its replicas.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_measurement::{ChainMotion, ErrorModes, Estimate};
use ndarray::Array2;

use crate::check::check_motion;
use crate::columns::{Column, Columns, Scatter};
use crate::dispersion::{DispersionMap, dispersion_map};
use crate::energy::{EnergyLaw, GapEnergy, PeakEnergies, drop_what_rest_may_hold, pulses_and_bent_energies};
use crate::front::{FrontSettings, GapFront, LeadingPulse, NARROWEST, leading_pulses};
use crate::half_width::{HalfWidth, MovingProfile, half_width_times, half_widths, without_jumps};
use crate::line_test::line_test;
use crate::particle::{ParticleVelocity, SlopeReach, particle_velocities};
use crate::replicas::{Replicas, over_replicas};
use crate::spacing::Spacing;
use crate::spectrum::{LocalResonance, Maximum, TailSpectrum, TailTransform, tail_spectrum};
use crate::strain::{strain_sigma, strain_with_sigma};
use crate::velocity::{GroupVelocity, Reflection, SpeedFit, fit_speed, is_no_line, undisturbed_gaps};
use crate::{AnalysisError, Missing, StrainMap};

/// Replicas from which a standard uncertainty can be told.
const MIN_REPLICAS: usize = 20;

/// What is measured, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureSettings {
    /// How far apart neighbours rest.
    pub spacing: Spacing,
    /// How the leading pulse is found.
    pub front: FrontSettings,
    /// First gap in which the pulse counts as formed: the group velocity begins there, the half width when the peak passes it.
    pub first_gap: usize,
    /// Whether the last body's far side reflects (a free or fixed end): what the reflection has reached is left out of the
    /// group velocity and the half width.
    pub end_reflects: bool,
    /// Gaps of the group velocity, in place of those that the two settings above give.
    pub velocity_gaps: Option<RangeInclusive<usize>>,
    /// Replicas behind each standard uncertainty; its own relative error is `1/sqrt(2 n)`.
    pub n_replicas: usize,
    /// Seed of the replicas.
    pub seed: u64,
    /// Threads that the replicas are shared among; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}

impl MeasureSettings {
    /// Where the pulse usually counts as formed.
    pub const FIRST_GAP: usize = 3;

    /// The default settings for a chain whose neighbours rest so far apart (a number of metres, or one for each gap), 200 replicas.
    pub fn new(spacing: impl Into<Spacing>, seed: u64) -> Self {
        Self {
            spacing: spacing.into(),
            front: FrontSettings::default(),
            first_gap: Self::FIRST_GAP,
            end_reflects: true,
            velocity_gaps: None,
            n_replicas: 200,
            seed,
            n_threads: NonZero::<usize>::MIN,
        }
    }

    fn check(&self) -> Result<(), AnalysisError> {
        self.spacing.check()?;
        self.front.check()?;
        if self.n_replicas < MIN_REPLICAS {
            let found = self.n_replicas as f64;
            return Err(AnalysisError::Setting { name: "n_replicas", expected: "at least 20", found });
        }
        Ok(())
    }
}

/// Everything that one motion yields, each number with its standard uncertainty or the reason why it is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Strain of every gap over time.
    pub strain: StrainMap,
    /// How the leading pulse was found.
    pub front: FrontSettings,
    /// The leading pulse in each gap; row i is gap i + 1.
    pub fronts: Vec<Result<GapFront, Missing>>,
    /// Slope of peak position against peak time.
    pub group_velocity: Result<GroupVelocity, Missing>,
    /// Half width of the front at the sample times at which it is defined.
    pub half_widths: Vec<HalfWidth>,
    /// Peak potential energies, when a contact law was given.
    pub energies: Option<PeakEnergies>,
    /// Spectra behind the leading pulse.
    pub spectrum: TailSpectrum,
    /// The dominant frequency of those spectra.
    pub local_resonance: Result<LocalResonance, Missing>,
    /// The tails over wavenumber and frequency.
    pub dispersion: Result<DispersionMap, Missing>,
    /// Replicas behind the uncertainties; zero for a motion without error.
    pub n_replicas: usize,
}

/// Measures a motion. Values come from the motion itself; standard uncertainties are what the same functions scatter over
/// replicas of the motion with its stated errors ([`crate::replicate`]), so every correlation between bodies and times counts. The
/// choices of gaps and times are made once, from the motion, and kept for the replicas.
///
/// # Errors
/// [`AnalysisError`] when a setting is out of range or the motion is inconsistent. A single value that cannot be measured
/// is [`Missing`] in the result.
pub fn measure(
    motion: &ChainMotion,
    settings: &MeasureSettings,
    energy_of: Option<EnergyLaw<'_>>,
) -> Result<Measurement, AnalysisError> {
    settings.check()?;
    check_motion(motion)?;
    let sigma = strain_sigma(motion, &settings.spacing);
    let map = strain_with_sigma(motion, &sigma, &settings.spacing);
    Ok(with_followed_peaks(motion, settings, |settings| {
        let plan = Plan::new(motion, &map, settings, energy_of);
        let mut values = plan.apply(motion, &map);
        if let Some(energy_of) = energy_of {
            let seen = (&map, values.pulses.as_slice());
            drop_what_rest_may_hold(&mut values.energies, seen, energy_of, settings.front.significance);
        }
        let replicas = of_replicas(motion, &sigma, settings, |noisy, map| plan.columns(noisy, map));
        let scatter = Scatter::new(values.columns(plan.velocity_gaps.as_ref().ok()), replicas);
        (assemble(map.clone(), &plan, &values, &scatter), scatter)
    }))
}

/// What is measured with peaks that their polynomials follow, and how its values scatter. A top that is no polynomial of order six, as the flat one of a
/// strongly damped pulse, is missed from over much of it by more than noise: where all gaps together tell so, each peak is found from half as far
/// down.
fn with_followed_peaks<T>(
    motion: &ChainMotion,
    settings: &MeasureSettings,
    measured: impl Fn(&MeasureSettings) -> (T, Scatter),
) -> T {
    let mut settings = settings.clone();
    if is_exact(motion) {
        settings.front.peak_fraction = settings.front.peak_fraction.max(NARROWEST);
    }
    loop {
        let (found, scatter) = measured(&settings);
        let bends = [Column::PeakTimeBend, Column::PeakStrainBend];
        let narrower = settings.front.narrower();
        if narrower.peak_fraction > NARROWEST || !bends.into_iter().any(|bend| scatter.is_told_by_all(bend)) {
            return found;
        }
        settings.front = narrower;
    }
}

/// The peak energies that [`measure`] finds, alone.
///
/// # Errors
/// As [`measure`].
pub fn measure_peak_energies(
    motion: &ChainMotion,
    settings: &MeasureSettings,
    energy_of: EnergyLaw<'_>,
) -> Result<PeakEnergies, AnalysisError> {
    settings.check()?;
    check_motion(motion)?;
    let sigma = strain_sigma(motion, &settings.spacing);
    let map = strain_with_sigma(motion, &sigma, &settings.spacing);
    Ok(with_followed_peaks(motion, settings, |settings| {
        let front = &settings.front;
        let of_map = |map: &StrainMap| pulses_and_bent_energies(map, front, energy_of);
        let columns = |pulses: &[Result<LeadingPulse, Missing>], energies: &[_]| {
            let mut columns = Columns::default();
            set_bends(&mut columns, pulses);
            set_energies(&mut columns, energies);
            columns
        };
        let (pulses, mut found) = of_map(&map);
        drop_what_rest_may_hold(&mut found, (&map, &pulses), energy_of, front.significance);
        let replicas = of_replicas(motion, &sigma, settings, |_, map| {
            let (pulses, found) = of_map(map);
            columns(&pulses, &found)
        });
        let scatter = Scatter::new(columns(&pulses, &found), replicas);
        (energies(front, &found, &scatter), scatter)
    }))
}

/// What a function makes of each replica of a motion and of its strains; nothing of a motion without error.
fn of_replicas(
    motion: &ChainMotion,
    sigma: &Array2<f64>,
    settings: &MeasureSettings,
    columns_of: impl Fn(&ChainMotion, &StrainMap) -> Columns + Sync,
) -> Vec<Columns> {
    let n = if is_exact(motion) { 0 } else { settings.n_replicas };
    let bare = ChainMotion { modes: ErrorModes::default(), ..motion.clone() };
    let replicas = Replicas { n, seed: settings.seed };
    over_replicas(motion, replicas, settings.n_threads, |displacement_m| {
        let noisy = ChainMotion { displacement_m, ..bare.clone() };
        columns_of(&noisy, &strain_with_sigma(&noisy, sigma, &settings.spacing))
    })
}

fn is_exact(motion: &ChainMotion) -> bool {
    motion.modes.is_empty() && motion.independent_sigma_m.iter().all(|sigma| *sigma <= 0.0)
}

/// What is evaluated, fixed before the replicas are.
struct Plan<'a> {
    settings: &'a MeasureSettings,
    energy_of: Option<EnergyLaw<'a>>,
    velocity_gaps: Result<RangeInclusive<usize>, Missing>,
    half_width_times_s: Vec<f64>,
    slope_reach: SlopeReach,
    spectrum: TailSpectrum,
    transform: TailTransform,
    /// The dominant maximum of the tails' spectra.
    resonance: Result<Maximum, Missing>,
}

impl<'a> Plan<'a> {
    fn new(
        motion: &ChainMotion,
        map: &StrainMap,
        settings: &'a MeasureSettings,
        energy_of: Option<EnergyLaw<'a>>,
    ) -> Self {
        let pulses = leading_pulses(map, &settings.front);
        // `Ok(None)` of an end that does not reflect; where one does, a reflection of which nothing is known may be anywhere.
        let reflection = match settings.end_reflects {
            true => Reflection::of_feet(&pulses, settings.first_gap).map(Some),
            false => Ok(None),
        };
        let velocity_gaps = match (&settings.velocity_gaps, &reflection) {
            (Some(stated), _) => Ok(stated.clone()),
            (None, Ok(reflection)) => Ok(undisturbed_gaps(&pulses, reflection.as_ref(), settings.first_gap)),
            (None, Err(untold)) => {
                // What has no speed anyway says why not.
                let any = settings.first_gap..=pulses.len();
                fit_speed(&pulses, &settings.spacing, &any).and(Err(*untold))
            }
        };
        let speed = velocity_gaps.clone().and_then(|gaps| fit_speed(&pulses, &settings.spacing, &gaps));
        let times_s = |(speed, reflection): (SpeedFit, &Option<Reflection>)| {
            let profile = MovingProfile::new(map, &pulses, speed.velocity_m_per_s);
            half_width_times(map, &profile, reflection.as_ref(), settings.first_gap)
        };
        let half_width_times_s = speed.ok().zip(reflection.as_ref().ok()).map_or_else(Vec::new, times_s);
        let spectrum = tail_spectrum(map, &pulses);
        let (transform, resonance) = (TailTransform::of(map), Maximum::of(&spectrum));
        let slope_reach = SlopeReach::following(motion, map, &pulses);
        Self {
            settings,
            energy_of,
            velocity_gaps,
            half_width_times_s,
            slope_reach,
            spectrum,
            transform,
            resonance,
        }
    }

    /// The values of a replica.
    fn columns(&self, motion: &ChainMotion, map: &StrainMap) -> Columns {
        self.apply(motion, map).columns(self.velocity_gaps.as_ref().ok())
    }

    fn apply(&self, motion: &ChainMotion, map: &StrainMap) -> PointValues {
        let front = &self.settings.front;
        let (pulses, energies) = match self.energy_of {
            Some(energy_of) => pulses_and_bent_energies(map, front, energy_of),
            None => (leading_pulses(map, front), Vec::new()),
        };
        let speed = self.velocity_gaps.clone().and_then(|gaps| fit_speed(&pulses, &map.spacing, &gaps));
        let half_widths_m = speed.map_or_else(
            |_| vec![None; self.half_width_times_s.len()],
            |speed| {
                let profile = MovingProfile::new(map, &pulses, speed.velocity_m_per_s);
                half_widths(&profile, &map.spacing, &self.half_width_times_s)
            },
        );
        let moved_hz = |found: &Maximum| {
            found.moved_hz(|gap, bins| self.transform.of_gap(map, pulses.get(gap - 1)?, bins))
        };
        let resonance_hz = self.resonance.as_ref().ok().and_then(moved_hz);
        let particles = particle_velocities(motion, map, &pulses, self.slope_reach);
        PointValues { pulses, particles, speed, half_widths_m, energies, resonance_hz }
    }
}

/// Point values of everything that is measured.
struct PointValues {
    pulses: Vec<Result<LeadingPulse, Missing>>,
    particles: Vec<Option<ParticleVelocity>>,
    speed: Result<SpeedFit, Missing>,
    half_widths_m: Vec<Option<f64>>,
    energies: Vec<Result<GapEnergy, Missing>>,
    resonance_hz: Option<f64>,
}

impl PointValues {
    fn columns(&self, velocity_gaps: Option<&RangeInclusive<usize>>) -> Columns {
        let of_particles = |value: fn(&ParticleVelocity) -> Option<f64>| -> Vec<Option<f64>> {
            self.particles.iter().map(|particle| particle.as_ref().and_then(value)).collect()
        };
        let of_pulses = |value: fn(&LeadingPulse) -> Option<f64>| -> Vec<Option<f64>> {
            self.pulses.iter().map(|pulse| pulse.as_ref().ok().and_then(value)).collect()
        };
        let of_speed = |value: fn(&SpeedFit) -> Option<f64>| vec![self.speed.as_ref().ok().and_then(value)];
        let mut columns = Columns::default();
        columns.set(Column::PeakTime, of_pulses(|pulse| Some(pulse.peak_time_s)));
        columns.set(Column::PeakStrain, of_pulses(|pulse| Some(pulse.peak_strain)));
        set_bends(&mut columns, &self.pulses);
        columns.set(Column::EdgeTime, of_pulses(|pulse| pulse.edge_time_s));
        columns.set(Column::EdgeTimeBend, of_pulses(|pulse| pulse.edge_bends_s));
        columns.set(Column::Velocity, of_speed(|speed| Some(speed.velocity_m_per_s)));
        columns.set(Column::FirstThird, of_speed(|speed| speed.thirds_m_per_s.map(|thirds| thirds[0])));
        columns.set(Column::LastThird, of_speed(|speed| speed.thirds_m_per_s.map(|thirds| thirds[1])));
        columns.set(Column::Variation, of_speed(SpeedFit::relative_variation));
        columns.set(Column::OffLine, of_speed(|speed| Some(speed.off_line())));
        let particles_m_per_s = of_particles(|particle| Some(particle.m_per_s));
        let particle_bends_m_per_s = of_particles(|particle| particle.bend_m_per_s);
        let mean_m_per_s = |of_gaps| velocity_gaps.and_then(|gaps| mean_within(of_gaps, gaps));
        columns.set(Column::MeanParticleVelocity, vec![mean_m_per_s(&particles_m_per_s)]);
        columns.set(Column::MeanParticleVelocityBend, vec![mean_m_per_s(&particle_bends_m_per_s)]);
        columns.set(Column::ParticleVelocity, particles_m_per_s);
        columns.set(Column::ParticleVelocityBend, particle_bends_m_per_s);
        columns.set(Column::HalfWidth, self.half_widths_m.clone());
        set_energies(&mut columns, &self.energies);
        columns.set(Column::Resonance, vec![self.resonance_hz]);
        columns
    }
}

fn set_bends(columns: &mut Columns, pulses: &[Result<LeadingPulse, Missing>]) {
    let bends = || pulses.iter().map(|pulse| pulse.as_ref().ok()?.bends);
    columns.set(Column::PeakTimeBend, bends().map(|bends| Some(bends?.later_s)).collect());
    columns.set(Column::PeakStrainBend, bends().map(|bends| Some(bends?.strain)).collect());
}

fn set_energies(columns: &mut Columns, energies: &[Result<GapEnergy, Missing>]) {
    let of_gaps = |value: fn(&GapEnergy) -> Option<f64>| -> Vec<Option<f64>> {
        energies.iter().map(|energy| energy.as_ref().ok().and_then(value)).collect()
    };
    let [energies_j, bends_j] = [of_gaps(|energy| Some(energy.energy_j)), of_gaps(|energy| energy.bend_j)];
    let first_j = energies_j.first().copied().flatten();
    let relative = |values_j: &[Option<f64>]| -> Vec<Option<f64>> {
        values_j.iter().map(|value_j| Some((*value_j)? / first_j?)).collect()
    };
    columns.set(Column::RelativeEnergy, relative(&energies_j));
    columns.set(Column::RelativeEnergyBend, relative(&bends_j));
    columns.set(Column::Energy, energies_j);
    columns.set(Column::EnergyBend, bends_j);
}

/// Mean of the values of gaps in a range; `None` where none has one.
fn mean_within(of_gaps: &[Option<f64>], gaps: &RangeInclusive<usize>) -> Option<f64> {
    let within = of_gaps.iter().enumerate().filter(|(row, _)| gaps.contains(&(row + 1)));
    let values: Vec<f64> = within.filter_map(|(_, value)| *value).collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn assemble(map: StrainMap, plan: &Plan<'_>, values: &PointValues, scatter: &Scatter) -> Measurement {
    let half_width = |(row, t_s): (usize, &f64)| {
        Some(HalfWidth { t_s: *t_s, hwhm_m: scatter.estimate(Column::HalfWidth, row).ok()? })
    };
    let half_widths: Vec<HalfWidth> =
        plan.half_width_times_s.iter().enumerate().filter_map(half_width).collect();
    let speed = plan.velocity_gaps.as_ref().map_err(|reason| *reason).and_then(|_| {
        let is_no_line = scatter.estimate(Column::OffLine, 0).is_ok_and(is_no_line);
        if is_no_line { Err(Missing::NotOneLine) } else { values.speed }
    });
    let half_widths =
        speed.as_ref().map(|speed| without_jumps(&half_widths, speed.velocity_m_per_s, map.spacing.mean_m()));
    let fronts = values.pulses.iter().enumerate();
    Measurement {
        fronts: fronts.map(|(row, pulse)| gap_front(row, (*pulse)?, scatter)).collect(),
        half_widths: half_widths.unwrap_or_default(),
        group_velocity: speed.and_then(|speed| group_velocity(&speed, scatter)),
        energies: plan.energy_of.map(|_| energies(&plan.settings.front, &values.energies, scatter)),
        front: plan.settings.front,
        spectrum: plan.spectrum.clone(),
        local_resonance: plan.resonance.as_ref().map_err(|reason| *reason).and_then(|found| {
            Ok(LocalResonance {
                frequency_hz: scatter.reaching_estimate(Column::Resonance, 0)?,
                resolution_hz: found.line.resolution_hz,
                line: line_test(&map, &values.pulses, found.line.frequency_hz)?,
            })
        }),
        dispersion: dispersion_map(&map, &values.pulses),
        n_replicas: scatter.n_replicas(),
        strain: map,
    }
}

fn gap_front(row: usize, pulse: LeadingPulse, scatter: &Scatter) -> Result<GapFront, Missing> {
    Ok(GapFront {
        gap: pulse.gap,
        peak_time_s: scatter.estimate_with(Column::PeakTime, Column::PeakTimeBend, row)?,
        peak_strain: scatter.estimate_with(Column::PeakStrain, Column::PeakStrainBend, row)?,
        edge_time_s: scatter.estimate_with(Column::EdgeTime, Column::EdgeTimeBend, row).ok(),
        particle_velocity_m_per_s: scatter
            .estimate_with(Column::ParticleVelocity, Column::ParticleVelocityBend, row)
            .ok(),
    })
}

fn group_velocity(speed: &SpeedFit, scatter: &Scatter) -> Result<GroupVelocity, Missing> {
    let estimate = |column| scatter.estimate(column, 0);
    let thirds = estimate(Column::FirstThird).ok().zip(estimate(Column::LastThird).ok());
    Ok(GroupVelocity {
        velocity_m_per_s: estimate(Column::Velocity)?,
        thirds_m_per_s: thirds.map(<[Estimate; 2]>::from),
        relative_variation: estimate(Column::Variation).ok(),
        particle_velocity_m_per_s: scatter
            .estimate_with(Column::MeanParticleVelocity, Column::MeanParticleVelocityBend, 0)
            .ok(),
        residual_m: speed.residual_m,
        gaps: speed.gaps,
        n_gaps: speed.n_gaps,
    })
}

fn energies(front: &FrontSettings, found: &[Result<GapEnergy, Missing>], scatter: &Scatter) -> PeakEnergies {
    let measured = |row: &usize| scatter.estimate(Column::Energy, *row).is_ok();
    let rows: Vec<usize> = (0..found.len()).filter(measured).collect();
    let all_of = |column, bend| {
        let estimate = |row: &usize| {
            let Estimate { value, sigma } = scatter.unbiased_estimate(column, *row).ok()?;
            Some(Estimate::new(value, sigma.hypot(scatter.beyond_noise(bend, *row))))
        };
        rows.iter().map(estimate).collect::<Option<Vec<_>>>()
    };
    let (mut covariance_j2, n_replicas) = scatter.covariance(Column::Energy, &rows);
    for (variance_j2, row) in covariance_j2.diag_mut().iter_mut().zip(&rows) {
        *variance_j2 += scatter.beyond_noise(Column::EnergyBend, *row).powi(2);
    }
    let reason = |(row, energy): (usize, &Result<GapEnergy, Missing>)| {
        let outcome = energy.and_then(|_| scatter.estimate(Column::Energy, row));
        outcome.err().map(|reason| (row + 1, reason))
    };
    PeakEnergies {
        gaps: rows.iter().map(|row| row + 1).collect(),
        energy_j: all_of(Column::Energy, Column::EnergyBend).unwrap_or_default(),
        relative: all_of(Column::RelativeEnergy, Column::RelativeEnergyBend),
        covariance_j2,
        n_replicas,
        front: *front,
        missing: found.iter().enumerate().filter_map(reason).collect(),
    }
}
