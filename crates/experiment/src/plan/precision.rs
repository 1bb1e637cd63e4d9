//! How well each result of an evaluation is known.

use chainwave_analysis::{HalfWidth, Measurement};
use chainwave_inference::{Damping, FitError, ReleasedFit};
use chainwave_measurement::{ChainMotion, Estimate};

use crate::configuration::Experiment;
use crate::evaluation::Evaluation;

/// A result whose uncertainty a plan predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannedResult {
    /// The largest displacement after the trigger, with the median uncertainty of all displacements after it.
    Displacement,
    /// Group velocity, in metres per second.
    GroupVelocity,
    /// Half width of the front, in metres: the one of median uncertainty.
    HalfWidth,
    /// Damping of the bodies, in kilograms per second.
    ChainDamping,
    /// Damping of the striker's contact, likewise.
    StrikerDamping,
    /// Strain at the peak of the leading pulse: that of the gap of median uncertainty.
    PeakStrain,
    /// Peak potential energy of a gap, in joules, likewise.
    PeakEnergy,
}

impl PlannedResult {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Displacement,
        Self::GroupVelocity,
        Self::HalfWidth,
        Self::ChainDamping,
        Self::StrikerDamping,
        Self::PeakStrain,
        Self::PeakEnergy,
    ];

    /// The keys of its value and of its uncertainty, as in `results.json` where they stand there.
    pub fn keys(self) -> [&'static str; 2] {
        match self {
            Self::Displacement => ["x_m", "x_sigma_m"],
            Self::GroupVelocity => ["group_velocity_m_per_s", "group_velocity_sigma"],
            Self::HalfWidth => ["hwhm_m", "hwhm_sigma_m"],
            Self::ChainDamping => ["c_d_kg_per_s", "c_d_sigma"],
            Self::StrikerDamping => ["c_s_kg_per_s", "c_s_sigma"],
            Self::PeakStrain => ["peak_strain", "peak_strain_sigma"],
            Self::PeakEnergy => ["psi_max_j", "psi_max_sigma_j"],
        }
    }

    /// Its name where it is asked for, as in `c_g=0.1%`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Displacement => "x_n",
            Self::GroupVelocity => "c_g",
            Self::HalfWidth => "HWHM",
            Self::ChainDamping => "c_d",
            Self::StrikerDamping => "c_s",
            Self::PeakStrain => "peak_strain",
            Self::PeakEnergy => "peak_energy",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement | Self::HalfWidth => "m",
            Self::GroupVelocity => "m/s",
            Self::ChainDamping | Self::StrikerDamping => "kg/s",
            Self::PeakEnergy => "J",
            Self::PeakStrain => "1",
        }
    }

    /// Its name in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Displacement => "x_n(t)",
            Self::GroupVelocity => "c_g",
            Self::HalfWidth => "HWHM",
            Self::ChainDamping => "c_d",
            Self::StrikerDamping => "c_s",
            Self::PeakStrain => "peak strain",
            Self::PeakEnergy => "peak energy",
        }
    }
}

/// Each result with its uncertainty, or why it has none.
#[derive(Debug, Clone, PartialEq)]
pub struct Precision([Result<Estimate, String>; PlannedResult::ALL.len()]);

impl Precision {
    /// Of each result what a function says.
    pub(super) fn of_each(of: impl FnMut(PlannedResult) -> Result<Estimate, String>) -> Self {
        Self(PlannedResult::ALL.map(of))
    }

    /// Of one result.
    pub fn of(&self, result: PlannedResult) -> &Result<Estimate, String> {
        // They stand in the order of all results, of which every one is.
        let place = PlannedResult::ALL.iter().position(|one| *one == result);
        &self.0[place.unwrap_or(0)]
    }

    /// Of each result the estimate of larger uncertainty, or the reason why there is none.
    pub(super) fn worse_of_each(&self, other: &Self) -> Self {
        Self::of_each(|result| match (self.of(result), other.of(result)) {
            (Ok(one), Ok(other)) => Ok(if one.sigma > other.sigma { *one } else { *other }),
            (Err(why), _) | (_, Err(why)) => Err(why.clone()),
        })
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = (PlannedResult, &Result<Estimate, String>)> {
        PlannedResult::ALL.into_iter().zip(&self.0)
    }
}

/// What a run found: the outcome beside what a plan predicts.
pub fn outcome(evaluation: &Evaluation) -> Precision {
    let damping = &evaluation.damping;
    let dampings = [&damping.chain_damping_kg_per_s, &damping.striker_damping_kg_per_s];
    precision(&evaluation.stitched.motion, &evaluation.measurement, dampings.map(Clone::clone))
}

/// The dampings of a fit to the tracks of a chain that is driven so; c_s only of one that is struck.
pub(super) fn both(
    experiment: &Experiment,
    damping: Result<Damping, FitError>,
) -> [Result<Estimate, String>; 2] {
    match damping {
        Ok(found) if experiment.is_released() => {
            [Ok(found.chain_damping_kg_per_s), Err(ReleasedFit::NO_STRIKER_DAMPING.into())]
        }
        Ok(found) => [Ok(found.chain_damping_kg_per_s), Ok(found.striker_damping_kg_per_s)],
        Err(why) => [Err(why.to_string()), Err(why.to_string())],
    }
}

/// What a motion says, and the dampings of the bodies and of the striker's contact.
pub(super) fn precision(
    motion: &ChainMotion,
    measurement: &Measurement,
    [chain_damping, striker_damping]: [Result<Estimate, String>; 2],
) -> Precision {
    let after_impact = motion
        .displacement_m
        .indexed_iter()
        .filter(|((_, i), _)| motion.times_s[*i] > 0.0)
        .filter_map(|(_, x)| *x);
    let velocity = measurement.group_velocity.as_ref();
    let fronts = measurement.fronts.iter().flatten().map(|front| front.peak_strain);
    let energies = measurement.energies.iter().flat_map(|energies| energies.energy_j.iter().copied());
    let width = typical_half_width(&measurement.half_widths).map(|width| width.hwhm_m);
    Precision::of_each(|result| match result {
        PlannedResult::Displacement => {
            let largest_m = after_impact.clone().map(|x| x.value.abs()).fold(0.0, f64::max);
            let typical = typical(after_impact.clone(), "no body was read after the trigger");
            typical.map(|x| Estimate::new(largest_m, x.sigma))
        }
        PlannedResult::GroupVelocity => {
            velocity.map(|found| found.velocity_m_per_s).map_err(|why| why.as_str().to_owned())
        }
        PlannedResult::HalfWidth => width.ok_or_else(|| "no front is seen in whole".to_owned()),
        PlannedResult::ChainDamping => chain_damping.clone(),
        PlannedResult::StrikerDamping => striker_damping.clone(),
        PlannedResult::PeakStrain => typical(fronts.clone(), "no pulse is seen in any gap"),
        PlannedResult::PeakEnergy => typical(energies.clone(), "no pulse is seen in any gap"),
    })
}

/// The half width of median uncertainty.
pub fn typical_half_width(widths: &[HalfWidth]) -> Option<HalfWidth> {
    of_median_sigma(widths.to_vec(), |width| width.hwhm_m.sigma)
}

/// The estimate of median uncertainty.
fn typical(of: impl Iterator<Item = Estimate>, why_none: &str) -> Result<Estimate, String> {
    of_median_sigma(of.collect(), |estimate| estimate.sigma).ok_or_else(|| why_none.to_owned())
}

fn of_median_sigma<T: Copy>(mut all: Vec<T>, sigma: impl Fn(&T) -> f64) -> Option<T> {
    let middle = all.len() / 2;
    all.sort_by(|one, other| sigma(one).total_cmp(&sigma(other)));
    all.get(middle).copied()
}
