//! What the chain model is fitted to, and every fit that the chain's drive allows.

use std::num::NonZero;

use chainwave_analysis::{Departure, Measurement, Pulses, Spacing};
use chainwave_inference::{
    EnergyFit, EnergyModel, FitError, ImposedFit, ImposedModel, Prior, Quantity, Reached, ReleasedFit,
    ReleasedModel, TrackFit, TrackModel, fit_imposed, fit_peak_energies, fit_release, fit_tracks, reached,
    scatter_of_bodies, softening,
};
use chainwave_measurement::{Estimate, Observation, SharedReadingError, both_in_parallel};
use chainwave_mechanics::Chain;
use chainwave_stitching::Stitched;

use crate::camera::calibration::ChainMap;
use crate::chain::measuring::chosen_gaps;
use crate::configuration::{Experiment, Striker};
use crate::error::Error;
use crate::fitting::assumptions::DRIVE_SCALE_SIGMA;
use crate::fitting::drive_off::DriveOff;
use crate::fitting::first_impact::first_impact_s;
use crate::geometry::scale::ScaleCheck;
use crate::input::numbers::NotNegative;
use crate::merging::Merged;
use crate::merging::shared_errors::SharedErrors;
use crate::merging::usual_geometry::UsualGeometry;

/// What the tracks say of simpler models.
pub struct Departures {
    /// Of a contact law that does not soften; refused where the law is another than a power of the overlap.
    pub softening: Result<Departure, FitError>,
    /// Of bodies that are alike; refused where the recordings do not tell all their masses.
    pub scatter: Result<Departure, FitError>,
}

impl Departures {
    /// Tests the fit of a chain to recordings.
    fn of(observations: &[Observation], fit: &TrackFit) -> Self {
        let (scatter, softening) = both_in_parallel(
            fit.model.n_threads,
            || scatter_of_bodies(observations, fit),
            || softening(observations, fit),
        );
        Self { softening, scatter }
    }
}

/// What the motion says as it was stitched, and the damping that its peak energies have.
pub(crate) struct ReadOff {
    pub(crate) measurement: Measurement,
    pub(crate) pulses: Pulses,
    pub(crate) energy_fit: Result<EnergyFit, FitError>,
}

/// What the tracks, the motion behind body 1, and that of a chain that is let go say of the chain.
pub(crate) struct Fits {
    /// The recordings that the wave reaches while they are filmed, which the fit to the tracks takes.
    pub(crate) reached: Vec<Observation>,
    pub(crate) track_fit: Result<TrackFit, FitError>,
    pub(crate) departures: Option<Departures>,
    pub(crate) imposed_fit: Result<ImposedFit, FitError>,
    pub(crate) release_fit: Option<Result<ReleasedFit, FitError>>,
}

/// What the chain model is fitted to, and how.
pub(crate) struct Material<'a> {
    pub(crate) experiment: &'a Experiment,
    pub(crate) stitched: &'a Stitched,
    pub(crate) chain: &'a Chain,
    pub(crate) priors: &'a [Prior],
    /// Errors that the readings share.
    pub(crate) reading_errors: &'a [SharedReadingError],
    /// What a camera that nothing calibrated leaves open.
    pub(crate) usual_geometry: &'a UsualGeometry,
    pub(crate) n_threads: NonZero<usize>,
}

impl<'a> Material<'a> {
    /// Of recordings that were merged.
    pub(crate) fn of(
        experiment: &'a Experiment,
        merged: &'a Merged<'_>,
        chain: &'a Chain,
        priors: &'a [Prior],
        n_threads: NonZero<usize>,
    ) -> Self {
        let Merged { joint, reading_errors, usual_geometry, .. } = merged;
        Self {
            experiment,
            stitched: &joint.stitched,
            chain,
            priors,
            reading_errors,
            usual_geometry,
            n_threads,
        }
    }

    pub(crate) fn read_off(&self, shared: &SharedErrors, step: &impl Fn()) -> Result<ReadOff, Error> {
        let Self { experiment, stitched, n_threads, .. } = *self;
        let motion = &stitched.motion;
        let measurement = shared.measure(experiment, motion, chosen_gaps(experiment), n_threads)?;
        let pulses = match experiment.analysis.pulses {
            true => shared.pulses(experiment, motion, n_threads)?,
            false => Pulses::default(),
        };
        step();
        let spacing = experiment.chain.spacing()?;
        let energy_fit = match energy_model(self, spacing) {
            Ok(model) => {
                let measured = (motion, measurement.energies.as_ref());
                let fitted = |energies: &_| fit_peak_energies(energies, motion, &model);
                shared.fit_energies(experiment, measured, n_threads, fitted)?
            }
            Err(why) => Err(why),
        };
        step();
        Ok(ReadOff { measurement, pulses, energy_fit })
    }

    /// Makes every fit that the chain's drive allows; `step` is called behind each.
    pub(crate) fn fits(&self, observations: &[Observation], step: &impl Fn()) -> Fits {
        let imposed_fit = self.moves().and_then(|()| self.behind_body_1());
        let (reached, track_fit) = match self.moves().and_then(|()| self.reached(observations)) {
            Ok((model, Reached { observations: reached, impact_times_s: impacts_s })) => {
                let elsewhere = imposed_fit.as_ref().ok().map(|fit| fit.chain_damping_kg_per_s.value);
                let fit = fit_of_any_drive(&reached, &impacts_s, &model, elsewhere);
                (reached, fit)
            }
            Err(why) => (observations.to_vec(), Err(why)),
        };
        let departures = track_fit.as_ref().ok().map(|fit| Departures::of(&reached, fit));
        step();
        let release_fit = self.since_release();
        step();
        Fits { reached, track_fit, departures, imposed_fit, release_fit }
    }

    /// Refuses a chain in which nothing moves: a fit would go through ever stiffer and slower chains.
    fn moves(&self) -> Result<(), FitError> {
        let places = self.stitched.motion.displacement_m.iter().flatten();
        let moves = places.into_iter().any(|x| x.value.abs() > LEAST_MOTION_SIGMAS * x.sigma);
        if moves { Ok(()) } else { Err(FitError::NothingMoves { expected: LEAST_MOTION_SIGMAS }) }
    }

    /// The chain model as a fit to the tracks starts from it, and the recordings, with their impacts as the alignment has them, that tell when
    /// its wave came.
    fn reached(&self, observations: &[Observation]) -> Result<(TrackModel, Reached), FitError> {
        let model = track_model(self.experiment, self.chain.clone(), self.priors, self.n_threads)?;
        let (reading_errors, usual_errors) =
            (self.reading_errors.to_vec(), self.usual_geometry.errors.clone());
        let model = TrackModel { reading_errors, usual_errors, ..model };
        let alignments = &self.stitched.alignments;
        let impact_s = first_impact_s(&self.stitched.motion, self.chain)?;
        let impacts_s: Vec<f64> =
            alignments.iter().map(|one| impact_s + one.trigger_offset_s.value).collect();
        let reached = reached(observations, &impacts_s, &model)?;
        Ok((model, reached))
    }

    /// Drive of each recording, relative to the mean drive, less one.
    fn drive_deviations(&self) -> Vec<f64> {
        self.stitched.alignments.iter().map(|one| one.drive_deviation.value).collect()
    }

    fn behind_body_1(&self) -> Result<ImposedFit, FitError> {
        moved_by_body_1(self.experiment)?;
        let model = ImposedModel {
            chain: self.chain.clone(),
            priors: priors_of_chain(self.priors),
            drive_deviations: self.drive_deviations(),
            n_threads: self.n_threads,
        };
        fit_imposed(&self.usual_geometry.added_to(&self.stitched.motion), &model)
    }

    fn since_release(&self) -> Option<Result<ReleasedFit, FitError>> {
        self.experiment.is_released().then(|| {
            asked(self.experiment)?;
            self.moves()?;
            let n_recordings = self.stitched.alignments.len().max(1) as f64;
            let model = ReleasedModel {
                chain: self.chain.clone(),
                state_sigma: self.experiment.drive_scatter() / n_recordings.sqrt(),
                priors: priors_of_chain(self.priors),
                drive_deviations: self.drive_deviations(),
            };
            fit_release(&self.usual_geometry.added_to(&self.stitched.motion), &model)
        })
    }
}

/// Relative scatter of the drive from trial to trial that one without any counts with: less than any motion tells.
const LEAST_SCATTER: f64 = 1e-6;

/// The fit to the tracks; where all recordings together contradict the stated strength of the drive, that is left open, as what it is off by would
/// else be taken for something else.
fn fit_of_any_drive(
    observations: &[Observation],
    impact_times_s: &[f64],
    model: &TrackModel,
    elsewhere_kg_per_s: Option<f64>,
) -> Result<TrackFit, FitError> {
    let fit = fit_tracks(observations, impact_times_s, model, elsewhere_kg_per_s)?;
    let Some(off) = DriveOff::of(&fit, model.striker_velocity_m_per_s) else { return Ok(fit) };
    let sigma = OPEN * model.striker_velocity_m_per_s.sigma;
    let velocity = Estimate::new(off.found.value, sigma);
    let open = TrackModel { striker_velocity_m_per_s: velocity, ..model.clone() };
    let open = fit_tracks(observations, impact_times_s, &open, elsewhere_kg_per_s);
    let is_simpler = |open: &TrackFit| open.leaves_noise_alone() && open.beyond.len() <= fit.beyond.len();
    Ok(open.ok().filter(is_simpler).unwrap_or(fit))
}

/// How far recordings may differ from a drive that was found elsewhere than stated, over the stated scatter: where all else was taken for its cause,
/// that is not quite where it is.
const OPEN: f64 = 3.0;

/// How far a body must leave its place, in its uncertainties: none of a million samples does by chance.
const LEAST_MOTION_SIGMAS: f64 = 5.0;

/// Refuses to fit a model that nobody asks for.
fn asked(experiment: &Experiment) -> Result<(), FitError> {
    if experiment.analysis.fits { Ok(()) } else { Err(FitError::NotAsked) }
}

/// The striker that fits seek: they are refused for a chain that is driven otherwise. A second one at the far end counts as it is stated in every
/// trial; where it was not, what the model leaves over has structure.
pub(crate) fn one_striker(experiment: &Experiment) -> Result<&Striker, FitError> {
    if let Some(found) = experiment.driven_otherwise() {
        return Err(FitError::DrivenOtherwise { found });
    }
    experiment.striker.as_ref().ok_or(FitError::NoStriker)
}

/// Refuses the fit behind body 1 where what moves the chain passes not through it alone.
fn moved_by_body_1(experiment: &Experiment) -> Result<(), FitError> {
    asked(experiment)?;
    match experiment.far_striker {
        _ if experiment.is_released() => Err(FitError::LetGo),
        Some(_) => Err(FitError::DrivenElsewhere { found: "a [far_striker] beside it" }),
        None => Ok(()),
    }
}

/// The chain model as a fit to the tracks starts from it.
///
/// # Errors
/// A fit that nobody asks for, and a chain that neither one striker alone drives nor is let go.
pub(crate) fn track_model(
    experiment: &Experiment,
    chain: Chain,
    priors: &[Prior],
    n_threads: NonZero<usize>,
) -> Result<TrackModel, FitError> {
    asked(experiment)?;
    if !experiment.is_released() {
        one_striker(experiment)?;
    }
    let Estimate { value, sigma } = experiment.nominal_drive();
    Ok(TrackModel {
        chain,
        striker_velocity_m_per_s: Estimate::new(value, sigma.max(LEAST_SCATTER * value)),
        priors: priors.to_vec(),
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads,
    })
}

/// What the experiment knows only within an uncertainty, and the fit may move. Of a lens, what remains of its distortion counts as
/// an error of the scale, by its size in the picture's middle. A scale that the stage contradicts is known only within that, and one of
/// pictures that may be rolled within what they are shorter by then.
pub(crate) fn priors(
    experiment: &Experiment,
    map: &ChainMap,
    contradiction: &ScaleCheck,
    shortening: f64,
) -> Vec<Prior> {
    let scale = map.m_per_px();
    let chain = &experiment.chain;
    let of_striker =
        experiment.striker.as_ref().map(|striker| (striker.mass_sigma_kg, striker.mass_kg.get()));
    let relative = |sigma: Option<NotNegative>, value: f64| sigma.map_or(0.0, NotNegative::get) / value;
    let of_ground = match chain.mean_ground_n_per_m() {
        mean if mean > 0.0 => relative(chain.ground_stiffness_sigma_n_per_m, mean),
        _ => 0.0,
    };
    let [of_prefactor, of_offset, of_exponent] = experiment.contact.relative_sigmas();
    let scatter = |scatter: Option<NotNegative>| scatter.map_or(0.0, NotNegative::get);
    let of_masses =
        (1..=chain.n_bodies).map(|body| (Quantity::MassOfBody(body), scatter(chain.mass_scatter)));
    let of_contacts = scatter(experiment.contact.stiffness_scatter);
    let of_gaps = (1..chain.n_bodies).map(|gap| (Quantity::StiffnessOfGap(gap), of_contacts));
    [
        (
            Quantity::Scale,
            (scale.sigma / scale.value).hypot(contradiction.relative_sigma()).hypot(shortening),
        ),
        (Quantity::BodyMass, relative(chain.mass_sigma_kg, chain.mean_mass_kg())),
        (Quantity::StrikerMass, of_striker.map_or(0.0, |(sigma_kg, mass_kg)| relative(sigma_kg, mass_kg))),
        (Quantity::Ground, of_ground),
        (Quantity::Prefactor, of_prefactor),
        (Quantity::Offset, of_offset),
        (Quantity::Exponent, of_exponent),
        (Quantity::StrikerContact, if experiment.striker.is_some() { of_contacts } else { 0.0 }),
    ]
    .into_iter()
    .chain(contradiction.of_views().map(|(view, sigma)| (Quantity::ScaleOfView(view), sigma)))
    .chain(of_masses)
    .chain(of_gaps)
    .filter(|(_, relative_sigma)| *relative_sigma > 0.0)
    .map(|(quantity, relative_sigma)| Prior { quantity, relative_sigma })
    .collect()
}

/// The same without what the pictures' scale leaves open: it stands among the errors that the motion states.
fn priors_of_chain(priors: &[Prior]) -> Vec<Prior> {
    priors.iter().filter(|prior| !prior.quantity.is_of_pictures()).cloned().collect()
}

fn energy_model(material: &Material<'_>, spacing: Spacing) -> Result<EnergyModel, FitError> {
    let Material { experiment, stitched, chain, priors, n_threads, .. } = *material;
    asked(experiment)?;
    let striker = one_striker(experiment)?;
    Ok(EnergyModel {
        chain: chain.clone(),
        striker_velocity_m_per_s: striker.mean_velocity_m_per_s(stitched.alignments.len()),
        drive_deviations: material.drive_deviations(),
        drive_scale_sigma: stitched.drive_scale_sigma.unwrap_or(DRIVE_SCALE_SIGMA),
        priors: priors_of_chain(priors),
        spacing,
        n_threads,
    })
}
