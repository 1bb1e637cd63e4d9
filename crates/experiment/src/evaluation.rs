//! What follows from the tracks: stitched motion, wave quantities, fits, and the model beside the measurement.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{
    CameraMotion, DampingShare, Departure, Measurement, Pulses, Spacing, damping_share, exact_motion,
};
use chainwave_inference::{
    AlignedMotion, EnergyFit, EnergyMeasurement, EnergyModel, FitError, ImposedFit, ImposedModel, Known,
    Quantity, ReleasedFit, ReleasedModel, TrackFit, TrackModel, aligned_motion, critical_kg_per_s,
    fit_imposed, fit_peak_energies, fit_release, fit_tracks, fitted_motion, reached, scatter_of_bodies,
    softening,
};
use chainwave_measurement::{ChainMotion, Estimate, Observation, ReadingError, Trajectory, both_in_parallel};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker as ModelStriker, simulate};
use chainwave_stitching::{Assumption, Outlier, Stitched};

use crate::assumptions::DRIVE_SCALE_SIGMA;
use crate::calibration::ChainMap;
use crate::configuration::{Experiment, Striker};
use crate::damping::StatedDamping;
use crate::error::Error;
use crate::finding::Finding;
use crate::joining::Unjoined;
use crate::joint::Joint;
use crate::measuring::measure_motion;
use crate::merging::{Merged, merged};
use crate::monitor::{Monitor, Stage};
use crate::notices::notices;
use crate::numbers::NotNegative;
use crate::picture_geometry::PictureGeometry;
use crate::sanity::speed;
use crate::scale::ScaleCheck;
use crate::setup::Setup;
use crate::shared_errors::SharedErrors;
use crate::side_motion::SideMotion;
use crate::standing::Standings;
use crate::stated_motion::StatedMotion;
use crate::steadying::Steadying;
use crate::tracked::Tracked;
use crate::wording::named;

/// To be raised whenever the same tracks would give other results; `golden_results` among the tests of the whole guards it.
pub const EVALUATION_VERSION: u32 = 19;

/// Everything that follows from the tracks.
pub struct Evaluation {
    /// Recordings that contradict the others of their view, and were left out.
    pub left_out: Vec<Outlier>,
    /// Recordings whose view could not be joined with the others.
    pub unjoined: Vec<Unjoined>,
    /// What contradicts the experiment.
    pub findings: Vec<Finding>,
    /// Whether the camera moves.
    pub(crate) steadying: Steadying,
    /// What of the camera is shared by frames and trials: its motion, its scale, and what lies on its sensor.
    pub(crate) of_camera: Vec<Finding>,
    /// What bodies tell of the camera's view and its lens.
    pub(crate) geometry: Option<PictureGeometry>,
    /// What recordings had amiss that was put right.
    notices: Vec<Finding>,
    /// What the bodies do besides moving along the chain.
    pub side_motion: SideMotion,
    /// The motion, and how views and trials were aligned.
    pub stitched: Stitched,
    /// What merging took to be so.
    pub(crate) assumptions: Vec<Assumption>,
    /// Trigger and drive of each recording, by the model where the tracks accept it.
    pub standings: Standings,
    /// Front, group velocity, half width, energies, spectra.
    pub measurement: Measurement,
    /// The pulses one by one, and where they meet.
    pub pulses: Pulses,
    /// Damping from the tracks of all recordings.
    pub track_fit: Result<TrackFit, FitError>,
    /// Whether the tracks ask for more than the simplest model, where they could be fitted.
    pub departures: Option<Departures>,
    /// c_d from the motion behind body 1, which drives the chain as it was measured.
    pub imposed_fit: Result<ImposedFit, FitError>,
    /// c_d from the motion of a chain that is let go; none for a chain that something drives.
    pub release_fit: Option<Result<ReleasedFit, FitError>>,
    /// Damping from the peak potential energies, as in the paper.
    pub energy_fit: Result<EnergyFit, FitError>,
    /// The damping that stands for the experiment, or why there is none.
    pub damping: StatedDamping,
    /// The fitted chain model beside the measurement, where the fit is believed.
    pub model: Option<ModelBeside>,
    /// The motion aligned by that model's triggers and drives, where it leaves noise alone.
    pub by_model: Option<AlignedMotion>,
}

/// What the tracks say of simpler models.
pub struct Departures {
    /// Of a contact law that does not soften.
    pub softening: Departure,
    /// Of bodies that are alike; absent where the recordings do not tell all their masses.
    pub scatter: Option<Departure>,
}

impl Departures {
    /// Tests the fit of a chain to recordings; `None` where the softening cannot be tested.
    fn of(observations: &[Observation], fit: &TrackFit) -> Option<Self> {
        let softening = softening(observations, fit).ok()?;
        Some(Self { softening, scatter: scatter_of_bodies(observations, fit).ok() })
    }
}

/// The chain model with the fitted damping.
pub struct ModelBeside {
    /// Its motion on the measured time base.
    pub motion: Trajectory,
    /// What the analysis makes of that motion.
    pub measurement: Measurement,
    /// Peak potential energies with the fitted damping, gap by gap, in joules.
    pub damped_j: Vec<f64>,
    /// The same without damping.
    pub undamped_j: Vec<f64>,
}

impl ModelBeside {
    /// What damping took of the peak energy, and what dispersion and rarefaction did, two thirds down the chain: the last gaps
    /// before a free end never fill.
    pub fn damping_share(&self) -> Option<DampingShare> {
        let shares = damping_share(&self.damped_j, &self.undamped_j);
        shares.get(2 * shares.len() / 3).copied()
    }
}

/// Steps of an evaluation: stitching, measuring, the fits to tracks, behind body 1 and to energies, and what follows from them.
const N_STEPS: u64 = 6;

/// Stitches, measures and fits.
///
/// # Errors
/// Tracks that cannot be stitched or measured; a fit that fails is no error but stands in its field.
pub fn evaluate(
    setup: &Setup,
    tracked: &Tracked,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Evaluation, Error> {
    let experiment = &setup.experiment;
    monitor.planned(Stage::Evaluating, N_STEPS);
    let step = || monitor.done(Stage::Evaluating, 1);
    let stated = StatedMotion::of(experiment, tracked.last_s(), n_threads)?;
    let merged = merged(setup, tracked, &stated, n_threads)?;
    let Merged { joint, of_camera, shared, side_motion, shortening, reading_errors, assumptions } = merged;
    let Joint { geometry, observations, steadying, stitched, left_out, unjoined, .. } = joint;
    step();
    let known = known(experiment, &setup.map, &tracked.stages.scale, shortening);
    let chain = &experiment.chain_model()?;
    let material = Material {
        experiment,
        stitched: &stitched,
        chain,
        known: &known,
        reading_errors: &reading_errors,
        n_threads,
    };
    // Neither asks what the other finds.
    let (read, fits) = both_in_parallel(
        n_threads,
        || material.read_off(&shared, &step),
        || material.fits(&observations, &step),
    );
    let ReadOff { measurement, pulses, energy_fit } = read?;
    let Fits { reached, track_fit, departures, imposed_fit, release_fit } = fits;
    let used = measurement.group_velocity.as_ref().ok().map(|velocity| velocity.gaps.0..=velocity.gaps.1);
    let critical = critical_kg_per_s(chain);
    let damping = match &release_fit {
        Some(fit) => StatedDamping::of_release(fit, critical),
        None => StatedDamping::of(&track_fit, &imposed_fit, &energy_fit, critical),
    };
    let standings =
        Standings::of(&stitched.alignments, accepted(&track_fit), experiment.far_striker.is_some());
    let mut notices = notices(experiment, &tracked.recordings, &observations, &standings);
    notices.extend(before_the_wave(&observations, &reached));
    notices.extend(experiment.far_striker.as_ref().map(|_| aligned_by_one_striker()));
    notices.extend(experiment.is_shaken().then(|| aligned_without_body_1(&observations)).flatten());
    notices.extend(Finding::all_of(
        "chain_model",
        "the chain model",
        track_fit.iter().flat_map(TrackFit::warnings),
    ));
    let believed = track_fit.as_ref().ok().filter(|fit| fit.is_believed());
    let beside = believed.map(|fit| model_beside(experiment, &stitched.motion, fit, used));
    let beside = beside.and_then(|beside| beside.map_err(|why| notices.push(not_shown(&why))).ok());
    let by_model = accepted(&track_fit).map(|fit| aligned_motion(&reached, fit, &stitched.motion.times_s));
    let by_model = by_model.and_then(|aligned| aligned.map_err(|why| notices.push(not_aligned(&why))).ok());
    let velocity = measurement.group_velocity.as_ref().ok();
    let speed = velocity.map(|found| speed(experiment, &stated, found.velocity_m_per_s));
    let speed = speed.transpose()?.flatten();
    step();
    monitor.ended(Stage::Evaluating);
    Ok(Evaluation {
        left_out,
        unjoined,
        findings: tracked.findings.iter().cloned().chain(speed).collect(),
        of_camera,
        geometry,
        steadying,
        notices,
        stitched,
        side_motion,
        assumptions,
        standings,
        measurement,
        pulses,
        track_fit,
        imposed_fit,
        departures,
        release_fit,
        energy_fit,
        damping,
        model: beside,
        by_model,
    })
}

/// What the motion says as it was stitched, and the damping that its peak energies have.
struct ReadOff {
    measurement: Measurement,
    pulses: Pulses,
    energy_fit: Result<EnergyFit, FitError>,
}

/// What the tracks, the motion behind body 1, and that of a chain that is let go say of the chain.
struct Fits {
    /// The recordings that the wave reaches while they are filmed, which the fit to the tracks takes.
    reached: Vec<Observation>,
    track_fit: Result<TrackFit, FitError>,
    departures: Option<Departures>,
    imposed_fit: Result<ImposedFit, FitError>,
    release_fit: Option<Result<ReleasedFit, FitError>>,
}

/// What the chain model is fitted to, and how.
struct Material<'a> {
    experiment: &'a Experiment,
    stitched: &'a Stitched,
    chain: &'a Chain,
    known: &'a [Known],
    /// Errors that the readings share.
    reading_errors: &'a [ReadingError],
    n_threads: NonZero<usize>,
}

impl Material<'_> {
    fn read_off(&self, shared: &SharedErrors, step: &impl Fn()) -> Result<ReadOff, Error> {
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
                let n_replicas = experiment.analysis.n_replicas;
                let of_energies = EnergyMeasurement { times_s: &motion.times_s, n_replicas };
                let measured = (motion, measurement.energies.as_ref());
                let fitted = |energies: &_| fit_peak_energies(energies, &of_energies, &model);
                shared.fit_energies(experiment, measured, n_threads, fitted)?
            }
            Err(why) => Err(why),
        };
        step();
        Ok(ReadOff { measurement, pulses, energy_fit })
    }

    /// Makes every fit that the chain's drive allows; `step` is called behind each.
    fn fits(&self, observations: &[Observation], step: &impl Fn()) -> Fits {
        let imposed_fit = self.behind_body_1();
        let (reached, track_fit) = match self.reached(observations) {
            Ok((model, reached, offsets_s)) => {
                let elsewhere = imposed_fit.as_ref().ok().map(|fit| fit.chain_damping_kg_per_s.value);
                let fit = fit_tracks(&reached, &offsets_s, &model, elsewhere);
                (reached, fit)
            }
            Err(why) => (observations.to_vec(), Err(why)),
        };
        let departures = track_fit.as_ref().ok().and_then(|fit| Departures::of(&reached, fit));
        step();
        let release_fit = self.since_release();
        step();
        Fits { reached, track_fit, departures, imposed_fit, release_fit }
    }

    /// The chain model as a fit to the tracks starts from it, and the recordings, with their impacts as the alignment has them, that tell when
    /// its wave came.
    fn reached(
        &self,
        observations: &[Observation],
    ) -> Result<(TrackModel, Vec<Observation>, Vec<f64>), FitError> {
        let model = track_model(self.experiment, self.chain.clone(), self.known, self.n_threads)?;
        let model = TrackModel { reading_errors: self.reading_errors.to_vec(), ..model };
        let alignments = &self.stitched.alignments;
        let offsets_s: Vec<f64> = alignments.iter().map(|one| one.trigger_offset_s.value).collect();
        let (reached, offsets_s) = reached(observations, &offsets_s, &model)?;
        Ok((model, reached, offsets_s))
    }

    /// Drive of each recording, relative to the mean drive, less one.
    fn drive_deviations(&self) -> Vec<f64> {
        self.stitched.alignments.iter().map(|one| one.drive_deviation.value).collect()
    }

    fn behind_body_1(&self) -> Result<ImposedFit, FitError> {
        moved_by_body_1(self.experiment)?;
        let model = ImposedModel {
            chain: self.chain.clone(),
            known: known_of_chain(self.known),
            drive_deviations: self.drive_deviations(),
            n_threads: self.n_threads,
        };
        fit_imposed(&self.stitched.motion, &model)
    }

    fn since_release(&self) -> Option<Result<ReleasedFit, FitError>> {
        self.experiment.is_released().then(|| {
            asked(self.experiment)?;
            let n_recordings = self.stitched.alignments.len().max(1) as f64;
            let model = ReleasedModel {
                chain: self.chain.clone(),
                state_sigma: self.experiment.drive_scatter() / n_recordings.sqrt(),
                known: known_of_chain(self.known),
                drive_deviations: self.drive_deviations(),
            };
            fit_release(&self.stitched.motion, &model)
        })
    }
}

/// Refuses to fit a model that nobody asks for.
fn asked(experiment: &Experiment) -> Result<(), FitError> {
    if experiment.analysis.fits { Ok(()) } else { Err(FitError::NotAsked) }
}

/// The striker that fits seek: they are refused for a chain that is driven otherwise. A second one at the far end counts as it is stated in every
/// trial; where it was not, what the model leaves over has structure.
fn one_striker(experiment: &Experiment) -> Result<&Striker, FitError> {
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

/// Says what the alignment of a chain that is driven at both ends rests on.
fn aligned_by_one_striker() -> Finding {
    let text = "with a [far_striker] views and trials are aligned as if what differs from strike to strike were the first striker's alone: a \
                recording has two drives, of which the alignment tells none; triggers of views that the other one moves are less certain than stated; \
                what the motion would be with drives that are alike is an error of it. The fits take the other one to be as stated in every trial";
    Finding { code: "far_striker", subject: "the alignment".into(), text: text.into() }
}

/// Says what the alignment of a shaken chain rests on where too few recordings see the body that is shaken.
fn aligned_without_body_1(observations: &[Observation]) -> Option<Finding> {
    const ENOUGH: usize = 3;
    let sees = |one: &&Observation| one.bodies.iter().any(|track| track.body == 1);
    let n_seen = observations.iter().filter(sees).count();
    let text = format!(
        "body 1, whose motion is in proportion to the drive, is seen by {n_seen} recordings: views and trials are aligned as if the first body that {ENOUGH} \
         see began in proportion to it, which a wave that was dispersed on its way does not quite"
    );
    (n_seen < ENOUGH).then(|| Finding { code: "drive", subject: "the alignment".into(), text })
}

/// Says which recordings say nothing of the chain but that it rests.
fn before_the_wave(all: &[Observation], reached: &[Observation]) -> Option<Finding> {
    let is_reached = |one: &&Observation| reached.iter().any(|other| other.recording == one.recording);
    let unreached: Vec<&str> =
        all.iter().filter(|one| !is_reached(one)).map(|one| one.recording.as_str()).collect();
    let text = "they end before the wave comes to what they show, so that nothing tells their trigger and drive: they are no part of the fit to the \
                tracks, nor of the mean that triggers, drives and the motion by the model count from. Record longer, or trigger these views later";
    (!unreached.is_empty()).then(|| Finding {
        code: "unreached",
        subject: named(&unreached),
        text: text.into(),
    })
}

/// Says that the fitted chain model is not shown beside the motion.
fn not_shown(why: &Error) -> Finding {
    let text = format!("not shown beside the motion: {why}");
    Finding { code: "chain_model", subject: "the fitted model".into(), text }
}

/// Says that the accepted chain model aligns no motion.
fn not_aligned(why: &FitError) -> Finding {
    let text = format!("there is none: {why}");
    Finding { code: "chain_model", subject: "the motion aligned by the chain model".into(), text }
}

impl Evaluation {
    /// The camera's motion, where the camera is told to move; it was taken out.
    pub fn camera_motion(&self) -> Option<&CameraMotion> {
        self.steadying.motion()
    }

    /// What the reader should know.
    pub fn warnings(&self) -> Vec<Finding> {
        let left_out = self.left_out_recordings().into_iter().map(|(recording, reason)| Finding {
            code: "left_out",
            subject: recording,
            text: format!("it was left out: {reason}"),
        });
        let aligned = Finding::all_of("alignment", "the alignment", self.stitched.warnings.iter().cloned());
        let of_damping = Finding::all_of("damping", "the damping", self.damping.warnings.iter().cloned());
        let findings = self.findings.iter().cloned().chain(left_out).chain(self.of_camera.iter().cloned());
        findings.chain(aligned).chain(self.notices.iter().cloned()).chain(of_damping).collect()
    }

    /// Recordings that were tracked and have no part in the motion, each with the reason.
    pub fn left_out_recordings(&self) -> Vec<(String, String)> {
        let contradict = self.left_out.iter().map(|one| (one.recording.clone(), one.evidence.to_string()));
        let unjoined = self.unjoined.iter().map(|one| (one.recording.clone(), one.reason.clone()));
        contradict.chain(unjoined).collect()
    }
}

/// A fit to the tracks that explains them.
fn accepted(track_fit: &Result<TrackFit, FitError>) -> Option<&TrackFit> {
    track_fit.as_ref().ok().filter(|fit| fit.leaves_noise_alone())
}

/// The gaps of the group velocity that the experiment names.
pub(crate) fn chosen_gaps(experiment: &Experiment) -> Option<RangeInclusive<usize>> {
    let analysis = &experiment.analysis;
    analysis.first_gap.zip(analysis.last_gap).map(|(first, last)| first..=last)
}

/// The chain model as a fit to the tracks starts from it.
///
/// # Errors
/// A fit that nobody asks for, and a chain that not one striker alone drives.
pub(crate) fn track_model(
    experiment: &Experiment,
    chain: Chain,
    known: &[Known],
    n_threads: NonZero<usize>,
) -> Result<TrackModel, FitError> {
    asked(experiment)?;
    let striker = one_striker(experiment)?;
    let (velocity, scatter) = (striker.velocity_m_per_s.get(), striker.velocity_sigma_m_per_s.get());
    Ok(TrackModel {
        chain,
        striker_velocity_m_per_s: Estimate::new(velocity, scatter),
        known: known.to_vec(),
        reading_errors: Vec::new(),
        n_threads,
    })
}

/// What the experiment knows only within an uncertainty, and the fit may move. Of a lens, what remains of its distortion counts as
/// an error of the scale, by its size in the picture's middle. A scale that the stage contradicts is known only within that, and one of
/// pictures that may be rolled within what they are shorter by then.
pub(crate) fn known(
    experiment: &Experiment,
    map: &ChainMap,
    contradiction: &ScaleCheck,
    shortening: f64,
) -> Vec<Known> {
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
    let of_gaps = (1..chain.n_bodies)
        .map(|gap| (Quantity::StiffnessOfGap(gap), scatter(experiment.contact.stiffness_scatter)));
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
    ]
    .into_iter()
    .chain(contradiction.of_views().map(|(view, sigma)| (Quantity::ScaleOfView(view), sigma)))
    .chain(of_masses)
    .chain(of_gaps)
    .filter(|(_, relative_sigma)| *relative_sigma > 0.0)
    .map(|(quantity, relative_sigma)| Known { quantity, relative_sigma })
    .collect()
}

/// The same without what the pictures' scale leaves open: it stands among the errors that the motion states.
fn known_of_chain(known: &[Known]) -> Vec<Known> {
    let is_of_pictures =
        |known: &&Known| matches!(known.quantity, Quantity::Scale | Quantity::ScaleOfView(_));
    known.iter().filter(|known| !is_of_pictures(known)).cloned().collect()
}

fn energy_model(material: &Material<'_>, spacing: Spacing) -> Result<EnergyModel, FitError> {
    let Material { experiment, stitched, chain, known, n_threads, .. } = *material;
    asked(experiment)?;
    let striker = one_striker(experiment)?;
    Ok(EnergyModel {
        chain: chain.clone(),
        striker_velocity_m_per_s: striker.mean_velocity_m_per_s(stitched.alignments.len()),
        drive_deviations: material.drive_deviations(),
        drive_scale_sigma: stitched.drive_scale_sigma.unwrap_or(DRIVE_SCALE_SIGMA),
        known: known_of_chain(known),
        spacing,
        n_threads,
    })
}

fn model_beside(
    experiment: &Experiment,
    motion: &ChainMotion,
    fit: &TrackFit,
    velocity_gaps: Option<RangeInclusive<usize>>,
) -> Result<ModelBeside, Error> {
    let striker = one_striker(experiment)?;
    let model = &fit.model;
    let fitted = fitted_motion(fit, &motion.times_s)?;
    let measurement = measure_motion(experiment, &exact_motion(&fitted), velocity_gaps, model.n_threads)?;
    let energies = |damping: f64| -> Result<Vec<f64>, Error> {
        let chain = Chain {
            damping_kg_per_s: experiment
                .chain
                .dampings_kg_per_s(damping * fit.damping.chain_damping_kg_per_s.value)?,
            drive: Drive::Striker(ModelStriker {
                mass_kg: striker.mass_kg.get(),
                velocity_m_per_s: fit.striker_velocity_m_per_s.value,
                damping_kg_per_s: damping * fit.damping.striker_damping_kg_per_s.value,
            }),
            ..model.chain.clone()
        };
        // Long enough for the wave to cross the chain at half the sound speed.
        let duration_s = 2.0 * experiment.linear_chain()?.crossing_time_s(model.chain.n_bodies());
        let schedule = Schedule::automatic(duration_s, duration_s / 100.0);
        Ok(simulate(&chain, &schedule)?.psi_max_j)
    };
    Ok(ModelBeside { motion: fitted, measurement, damped_j: energies(1.0)?, undamped_j: energies(0.0)? })
}
