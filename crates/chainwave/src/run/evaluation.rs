use std::ops::RangeInclusive;

use chainwave_analysis::fit::{
    Damping, Departure, EnergyFit, EnergyMeasurement, EnergyModel, FitError, ImposedFit, ImposedModel, Known,
    Quantity, TrackFit, TrackModel, fit_imposed, fit_peak_energies, fit_tracks, fitted_motion,
    scatter_of_bodies, softening,
};
use chainwave_analysis::{
    DampingShare, FrontSettings, MeasureSettings, Measurement, damping_share, exact_motion, measure,
};
use chainwave_measurement::{ChainMotion, Estimate, Trajectory};
use chainwave_mechanics::{Chain, Drive, FarEnd, PowerLaw, Schedule, Striker, simulate};
use chainwave_stitching::{Outlier, Settings, Stitched, merge, outliers};

use super::Job;
use super::notices::notices;
use super::shared_errors::SharedErrors;
use super::standing::Standings;
use super::tracking::Tracked;
use crate::error::Error;
use crate::experiment::{NotNegative, Positive};
use crate::parallel::threads;

/// Everything that follows from the tracks.
pub(crate) struct Evaluation {
    /// Recordings that contradict the others of their view, and were left out.
    pub(crate) left_out: Vec<Outlier>,
    /// What recordings had amiss that was put right.
    notices: Vec<String>,
    /// The motion, and how views and trials were aligned.
    pub(crate) stitched: Stitched,
    /// Trigger and drive of each recording, by the model where the tracks accept it.
    pub(crate) standings: Standings,
    /// Front, group velocity, half width, energies, spectra.
    pub(crate) measurement: Measurement,
    /// Damping from the tracks of all recordings.
    pub(crate) track_fit: Result<TrackFit, FitError>,
    /// Whether the tracks ask for more than the simplest model, where they could be fitted.
    pub(crate) departures: Option<Departures>,
    /// c_d from the motion behind body 1, which drives the chain as it was measured.
    pub(crate) imposed_fit: Result<ImposedFit, FitError>,
    /// Damping from the peak potential energies, as in the paper.
    pub(crate) energy_fit: Result<EnergyFit, FitError>,
    /// The fitted chain model beside the measurement, where the fit succeeded.
    pub(crate) model: Option<ModelBeside>,
}

/// What the tracks say of simpler models.
pub(crate) struct Departures {
    /// Of a contact law that does not soften.
    pub(crate) softening: Departure,
    /// Of bodies that are alike; absent where the recordings do not tell all their masses.
    pub(crate) scatter: Option<Departure>,
}

/// The chain model with the fitted damping.
pub(crate) struct ModelBeside {
    /// Its motion on the measured time base.
    pub(crate) motion: Trajectory,
    /// What the analysis makes of that motion.
    pub(crate) measurement: Measurement,
    /// Peak potential energies with the fitted damping, gap by gap, in joules.
    pub(crate) damped_j: Vec<f64>,
    /// The same without damping.
    pub(crate) undamped_j: Vec<f64>,
}

impl ModelBeside {
    /// What damping took of the peak energy, and what dispersion and rarefaction did, two thirds down the chain: the last gaps
    /// before a free end never fill.
    pub(crate) fn damping_share(&self) -> Option<DampingShare> {
        let shares = damping_share(&self.damped_j, &self.undamped_j);
        shares.get(2 * shares.len() / 3).copied()
    }
}

/// Stitches, measures and fits.
pub(crate) fn evaluate(job: &Job, tracked: &Tracked) -> Result<Evaluation, Error> {
    let experiment = &job.experiment;
    let settings = Settings {
        rest_until_s: experiment.tracking.rest_until_s,
        drive_scatter: Some(experiment.striker.scatter()),
        ..Settings::new(experiment.chain.n_bodies, 0.0)
    };
    let left_out = outliers(&tracked.observations, &settings)?;
    let kept = tracked.without(&left_out);
    let mut stitched = merge(&kept.observations, &settings)?;
    let shared = SharedErrors::of(job, &kept, &settings, &stitched)?;
    shared.add_to(&mut stitched.motion);
    let law = experiment.contact.power_law()?;
    let chosen = chosen_gaps(job);
    let measurement = shared.measure(job, &stitched.motion, &law, chosen)?;
    let used = measurement.group_velocity.as_ref().ok().map(|velocity| velocity.gaps.0..=velocity.gaps.1);
    let chain = starting_chain(job, law);
    let track_model = track_model(job, chain.clone());
    let offsets_s: Vec<f64> = stitched.alignments.iter().map(|one| one.trigger_offset_s.value).collect();
    let track_fit = fit_tracks(&kept.observations, &offsets_s, &track_model);
    let imposed_model = ImposedModel {
        chain: chain.clone(),
        known: known_of_chain(job),
        drive_deviations: stitched.alignments.iter().map(|one| one.drive_deviation.value).collect(),
        n_threads: threads(job.jobs),
    };
    let imposed_fit = fit_imposed(&stitched.motion, &imposed_model);
    let energy_model = energy_model(job, &stitched, chain);
    let energy_fit =
        shared.fit_energies(job, &stitched.motion, &law, |energies, times_s| match energies {
            Some(energies) => {
                let front = &front_settings(job);
                let n_replicas = job.experiment.analysis.n_replicas;
                fit_peak_energies(energies, &EnergyMeasurement { times_s, front, n_replicas }, &energy_model)
            }
            None => Err(FitError::TooFew { what: "peak energies", expected: 1, found: 0 }),
        })?;
    let beside = match &track_fit {
        Ok(fit) => Some(model_beside(job, &stitched.motion, &track_model, fit, used)?),
        Err(_) => None,
    };
    let departures = track_fit.as_ref().ok().and_then(|fit| {
        Some(Departures {
            softening: softening(&kept.observations, &track_model, fit).ok()?,
            scatter: scatter_of_bodies(&kept.observations, &track_model, fit).ok(),
        })
    });
    let standings = Standings::of(&stitched.alignments, accepted(&track_fit));
    Ok(Evaluation {
        left_out,
        notices: notices(job, &kept, &standings),
        stitched,
        standings,
        measurement,
        track_fit,
        imposed_fit,
        departures,
        energy_fit,
        model: beside,
    })
}

/// Residuals of the tracks' fit, relative to stated noise, up to which it gives the damping. It uses all that was measured and
/// is ten times sharper than that of the peak energies; where the model leaves something out, it is the first to go astray.
const ACCEPTED_CHI_SQUARED: f64 = 1.2;

impl Evaluation {
    /// What the reader should know.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let left_out = self
            .left_out
            .iter()
            .map(|outlier| format!("{} was left out: {}", outlier.recording, outlier.evidence));
        left_out.chain(self.stitched.warnings.iter().cloned()).chain(self.notices.iter().cloned()).collect()
    }

    /// The damping that stands for the experiment, and where it comes from.
    pub(crate) fn damping(&self) -> Option<(Damping, &'static str)> {
        let tracks = self.track_fit.as_ref().ok().map(|fit| (fit.damping, "tracks"));
        let energies = self.energy_fit.as_ref().ok().map(|fit| (fit.damping, "peak energies"));
        match accepted(&self.track_fit) {
            Some(_) => tracks,
            None => energies.or(tracks),
        }
    }
}

/// A fit to the tracks that explains them.
fn accepted(track_fit: &Result<TrackFit, FitError>) -> Option<&TrackFit> {
    track_fit.as_ref().ok().filter(|fit| fit.reduced_chi_squared <= ACCEPTED_CHI_SQUARED)
}

/// The gaps of the group velocity that the experiment names.
fn chosen_gaps(job: &Job) -> Option<RangeInclusive<usize>> {
    let analysis = &job.experiment.analysis;
    analysis.first_gap.zip(analysis.last_gap).map(|(first, last)| first..=last)
}

fn front_settings(job: &Job) -> FrontSettings {
    FrontSettings { edge_fraction: job.experiment.analysis.edge_fraction, ..FrontSettings::default() }
}

/// Measures a motion by the experiment's settings; the group velocity over the given gaps, or those that the motion suggests.
pub(crate) fn measure_motion(
    job: &Job,
    motion: &ChainMotion,
    law: &PowerLaw,
    velocity_gaps: Option<RangeInclusive<usize>>,
) -> Result<Measurement, Error> {
    let (chain, analysis) = (&job.experiment.chain, &job.experiment.analysis);
    let settings = MeasureSettings {
        front: front_settings(job),
        velocity_gaps,
        n_replicas: analysis.n_replicas,
        n_threads: threads(job.jobs),
        ..MeasureSettings::new(chain.pitch_m.get(), analysis.seed)
    };
    Ok(measure(motion, &settings, Some(&|overlap_m| law.energy_j(overlap_m)))?)
}

/// The chain as the experiment states it, with usual damping to start a fit from.
pub(crate) fn starting_chain(job: &Job, contact: PowerLaw) -> Chain {
    let experiment = &job.experiment;
    Chain {
        mass_kg: vec![experiment.chain.mass_kg.get(); experiment.chain.n_bodies],
        damping_kg_per_s: vec![STARTING_DAMPING_KG_PER_S; experiment.chain.n_bodies],
        contact: contact.into(),
        drive: Drive::Striker(Striker {
            mass_kg: experiment.striker.mass_kg.get(),
            velocity_m_per_s: experiment.striker.velocity_m_per_s.get(),
            damping_kg_per_s: STARTING_STRIKER_DAMPING_KG_PER_S,
        }),
        far_end: FarEnd::Free,
    }
}

fn track_model(job: &Job, chain: Chain) -> TrackModel {
    let striker = &job.experiment.striker;
    let (velocity, scatter) = (striker.velocity_m_per_s.get(), striker.velocity_sigma_m_per_s.get());
    TrackModel {
        chain,
        striker_velocity_m_per_s: Estimate::new(velocity, scatter),
        known: known(job),
        n_threads: threads(job.jobs),
    }
}

/// What the experiment knows only within an uncertainty, and the fit may move. Of a lens, what remains of its distortion counts as
/// an error of the scale, by its size in the picture's middle.
fn known(job: &Job) -> Vec<Known> {
    let (experiment, scale) = (&job.experiment, job.calibration.m_per_px());
    let (chain, striker, contact) = (&experiment.chain, &experiment.striker, &experiment.contact);
    let relative =
        |sigma: Option<NotNegative>, value: Positive| sigma.map_or(0.0, NotNegative::get) / value.get();
    [
        (Quantity::Scale, scale.sigma / scale.value),
        (Quantity::BodyMass, relative(chain.mass_sigma_kg, chain.mass_kg)),
        (Quantity::StrikerMass, relative(striker.mass_sigma_kg, striker.mass_kg)),
        (Quantity::Prefactor, relative(contact.a_sigma, contact.a)),
        (Quantity::Offset, relative(contact.delta_0_sigma_m, contact.delta_0_m)),
        (Quantity::Exponent, relative(contact.p_sigma, contact.p)),
    ]
    .into_iter()
    .filter(|(_, relative_sigma)| *relative_sigma > 0.0)
    .map(|(quantity, relative_sigma)| Known { quantity, relative_sigma })
    .collect()
}

/// The same without what the pictures' scale leaves open: it stands among the errors that the motion states.
fn known_of_chain(job: &Job) -> Vec<Known> {
    known(job).into_iter().filter(|known| known.quantity != Quantity::Scale).collect()
}

fn energy_model(job: &Job, stitched: &Stitched, chain: Chain) -> EnergyModel {
    let striker = &job.experiment.striker;
    let mean_sigma = striker.velocity_sigma_m_per_s.get() / (stitched.alignments.len() as f64).sqrt();
    EnergyModel {
        chain,
        striker_velocity_m_per_s: Estimate::new(striker.velocity_m_per_s.get(), mean_sigma),
        drive_deviations: stitched.alignments.iter().map(|one| one.drive_deviation.value).collect(),
        drive_scale_sigma: DRIVE_SCALE_SIGMA,
        known: known_of_chain(job),
        pitch_m: job.experiment.chain.pitch_m.get(),
        n_threads: threads(job.jobs),
    }
}

/// The onset of the first body and the stated scatter tell the scale of the drives to 11 to 18 %.
const DRIVE_SCALE_SIGMA: f64 = 0.15;
/// Where the fit of c_d begins: light damping, 0.04 % of critical for one HEC. The end does not depend on it.
const STARTING_DAMPING_KG_PER_S: f64 = 1e-3;
/// Where the fit of c_s begins.
const STARTING_STRIKER_DAMPING_KG_PER_S: f64 = 0.1;

fn model_beside(
    job: &Job,
    motion: &ChainMotion,
    model: &TrackModel,
    fit: &TrackFit,
    velocity_gaps: Option<RangeInclusive<usize>>,
) -> Result<ModelBeside, Error> {
    let law = job.experiment.contact.power_law()?;
    let fitted = fitted_motion(model, fit, &motion.times_s)?;
    let measurement = measure_motion(job, &exact_motion(&fitted), &law, velocity_gaps)?;
    let energies = |damping: f64| -> Result<Vec<f64>, Error> {
        let chain = Chain {
            damping_kg_per_s: vec![
                damping * fit.damping.chain_damping_kg_per_s.value;
                model.chain.n_bodies()
            ],
            drive: Drive::Striker(Striker {
                mass_kg: job.experiment.striker.mass_kg.get(),
                velocity_m_per_s: fit.striker_velocity_m_per_s.value,
                damping_kg_per_s: damping * fit.damping.striker_damping_kg_per_s.value,
            }),
            ..model.chain.clone()
        };
        // Long enough for the wave to cross the chain at half the sound speed.
        let pitches_per_s = (law.k_0_n_per_m() / model.chain.mass_kg[0]).sqrt();
        let duration_s = 2.0 * model.chain.n_bodies() as f64 / pitches_per_s;
        let schedule = Schedule::automatic(duration_s, duration_s / 100.0);
        Ok(simulate(&chain, &schedule)?.psi_max_j)
    };
    Ok(ModelBeside { motion: fitted, measurement, damped_j: energies(1.0)?, undamped_j: energies(0.0)? })
}
