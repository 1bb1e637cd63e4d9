//! What follows from the tracks: stitched motion, wave quantities, fits, and the model beside the measurement.

mod beyond_table;
pub(crate) mod decisions;
mod lost_bodies;
pub(crate) mod notices;
pub(crate) mod recording_alignment;
pub(crate) mod strikers;
mod told_by_model;
pub(crate) mod truth;
mod unseen_bodies;

use std::num::NonZero;

use chainwave_analysis::{CameraMotion, Measurement, Pulses};
use chainwave_inference::{
    AlignedMotion, EnergyFit, FitError, ImposedFit, ReleasedFit, TrackFit, aligned_motion, critical_kg_per_s,
};
use chainwave_measurement::{Observation, both_in_parallel};
use chainwave_stitching::{Assumption, Outlier, Stitched};

use crate::chain::stated_motion::StatedMotion;
use crate::configuration::Experiment;
use crate::error::Error;
use crate::evaluation::beyond_table::beyond_table;
use crate::evaluation::notices::{
    aligned_by_one_striker, aligned_without_body_1, before_the_wave, not_aligned, not_shown, notices,
};
use crate::evaluation::recording_alignment::RecordingAlignments;
use crate::evaluation::told_by_model::{Widened, accepted};
use crate::finding::{Finding, LeftOutRecording};
use crate::fitting::contacts_asked::add_contacts_asked;
use crate::fitting::damping::StatedDamping;
use crate::fitting::drive_off::DriveOff;
use crate::fitting::fits::{Departures, Fits, Material, ReadOff, priors};
use crate::fitting::model_beside::{ModelBeside, model_beside};
use crate::merging::joint::Joint;
use crate::merging::merged;
use crate::merging::picture_geometry::PictureGeometry;
use crate::merging::side_motion::SideMotion;
use crate::merging::stabilisation::Stabilisation;
use crate::monitor::{Monitor, Stage};
use crate::sanity::speed;
use crate::setup::Setup;
use crate::tracked::Tracked;

/// To be raised whenever the same tracks would give other results; `results_of_the_small_experiment_are_those_of_the_evaluations_version` among the tests of the whole guards it.
pub const EVALUATION_VERSION: u32 = 36;

/// Everything that follows from the tracks.
pub struct Evaluation {
    /// Recordings that contradict the others of their view, and were left out.
    pub left_out: Vec<Outlier>,
    /// Recordings whose view could not be joined with the others.
    pub unjoined: Vec<LeftOutRecording>,
    /// What contradicts the experiment.
    pub findings: Vec<Finding>,
    /// Whether the camera moves.
    pub(crate) stabilisation: Stabilisation,
    /// What of the camera is shared by frames and trials: its motion, its scale, and what lies on its sensor.
    pub(crate) of_camera: Vec<Finding>,
    /// What bodies tell of the camera's view and its lens.
    pub(crate) geometry: Option<PictureGeometry>,
    /// What recordings had amiss that was put right.
    pub(crate) notices: Vec<Finding>,
    /// What the bodies do besides moving along the chain.
    pub side_motion: SideMotion,
    /// The motion, and how views and trials were aligned.
    pub stitched: Stitched,
    /// What merging took to be so.
    pub(crate) assumptions: Vec<Assumption>,
    /// Trigger and drive of each recording, by the model where the tracks accept it.
    pub recording_alignments: RecordingAlignments,
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
    let of_all = merged(setup, tracked, &stated, n_threads)?;
    step();
    let Joint { setup: mapped, scale, observations, .. } = &of_all.joint;
    let priors = &priors(experiment, &mapped.map, scale, of_all.shortening);
    let chain = &experiment.chain_model()?;
    let material = Material::of(experiment, &of_all, chain, priors, n_threads);
    // Neither asks what the other finds.
    let read_off = || material.read_off(&of_all.shared, &step);
    let (read, fits) = both_in_parallel(n_threads, read_off, || material.fits(observations, &step));
    let widened = Widened::of(&of_all, &fits.track_fit);
    let again =
        |one: &Widened| Material { stitched: &one.stitched, ..material }.read_off(&of_all.shared, &|| ());
    let read = widened.as_ref().map_or(read, again);
    let ReadOff { mut measurement, pulses, energy_fit } = read?;
    let Joint { geometry, observations, stabilisation, stitched, left_out, unjoined, .. } = of_all.joint;
    let (stitched, told) = widened.map_or((stitched, Vec::new()), |one| (one.stitched, one.findings));
    let drive_off = drive_off(experiment, &fits.track_fit);
    let damping = damping_of(&fits, &energy_fit, drive_off.as_ref(), critical_kg_per_s(chain));
    let Fits { reached, track_fit, departures, imposed_fit, release_fit } = fits;
    let used = measurement.group_velocity.as_ref().ok().map(|velocity| velocity.gaps.0..=velocity.gaps.1);
    let recording_alignments =
        RecordingAlignments::of(&stitched.alignments, accepted(&track_fit), experiment.far_striker.is_some());
    let mut notices = notices(experiment, &tracked.recordings, &observations, &recording_alignments);
    notices.extend(before_the_wave(&observations, &reached));
    notices.extend(of_drive(experiment, &observations, drive_off.as_ref()));
    notices.extend(beyond_table(chain, &measurement.strain));
    notices.extend(of_model(&track_fit));
    let believed = track_fit.as_ref().ok().filter(|fit| fit.is_believed());
    notices.extend(told);
    if let Some(fit) = believed {
        // Values that the chain refuses are named by what shows its motion.
        add_contacts_asked(&mut measurement, chain, fit).unwrap_or_default();
    }
    let c_g = measurement.group_velocity.as_ref().ok().map(|found| found.velocity_m_per_s);
    let of_speed = || c_g.map(|c_g| speed(experiment, &stated, c_g)).transpose();
    let by_fit = || {
        let beside = believed.map(|fit| model_beside(experiment, &stitched.motion, fit, used));
        let aligned = |fit| aligned_motion(&reached, fit, &stitched.motion.times_s);
        (beside, accepted(&track_fit).map(aligned))
    };
    let (speed, (model, by_model)) = both_in_parallel(n_threads, of_speed, by_fit);
    let model = model.and_then(|beside| beside.map_err(|why| notices.push(not_shown(&why))).ok());
    let by_model = by_model.and_then(|aligned| aligned.map_err(|why| notices.push(not_aligned(&why))).ok());
    step();
    monitor.ended(Stage::Evaluating);
    Ok(Evaluation {
        left_out,
        unjoined,
        findings: tracked.findings.iter().cloned().chain(speed?.flatten()).collect(),
        of_camera: of_all.of_camera,
        geometry,
        stabilisation,
        notices,
        stitched,
        side_motion: of_all.side_motion,
        assumptions: of_all.assumptions,
        recording_alignments,
        measurement,
        pulses,
        track_fit,
        imposed_fit,
        departures,
        release_fit,
        energy_fit,
        damping,
        model,
        by_model,
    })
}

/// The damping that stands for the experiment: of a chain that is let go by its tracks or its motion, of others by tracks, motion and energies.
fn damping_of(
    fits: &Fits,
    energy_fit: &Result<EnergyFit, FitError>,
    drive_off: Option<&DriveOff>,
    critical_kg_per_s: f64,
) -> StatedDamping {
    match &fits.release_fit {
        Some(fit) => StatedDamping::of_release(&fits.track_fit, fit, critical_kg_per_s),
        None => {
            let Fits { track_fit, imposed_fit, .. } = fits;
            StatedDamping::of(track_fit, imposed_fit, energy_fit, drive_off, critical_kg_per_s)
        }
    }
}

/// What the reader should know of the chain model.
fn of_model(track_fit: &Result<TrackFit, FitError>) -> Vec<Finding> {
    let said = track_fit.iter().flat_map(TrackFit::warnings);
    Finding::all_of("chain_model", "the chain model", said)
}

/// A drive that a fit to the tracks which explains them finds elsewhere than it is stated.
fn drive_off(experiment: &Experiment, track_fit: &Result<TrackFit, FitError>) -> Option<DriveOff> {
    DriveOff::of(accepted(track_fit)?, experiment.nominal_drive())
}

/// What the alignment does not know of the chain's drive, and what the tracks say against it.
fn of_drive(
    experiment: &Experiment,
    observations: &[Observation],
    drive_off: Option<&DriveOff>,
) -> Vec<Finding> {
    let by_one_striker = experiment.far_striker.as_ref().map(|_| aligned_by_one_striker());
    let without_body_1 = experiment.is_shaken().then(|| aligned_without_body_1(observations)).flatten();
    by_one_striker.into_iter().chain(without_body_1).chain(drive_off.map(DriveOff::finding)).collect()
}

impl Evaluation {
    /// The camera's motion, where the camera is told to move; it was taken out.
    pub fn camera_motion(&self) -> Option<&CameraMotion> {
        self.stabilisation.motion()
    }

    /// What the reader should know.
    pub fn warnings(&self) -> Vec<Finding> {
        let left_out =
            self.left_out_recordings().into_iter().map(|LeftOutRecording { recording, reason }| Finding {
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
    pub fn left_out_recordings(&self) -> Vec<LeftOutRecording> {
        let contradict = self.left_out.iter().map(|one| LeftOutRecording {
            recording: one.recording.clone(),
            reason: one.evidence.to_string(),
        });
        contradict.chain(self.unjoined.iter().cloned()).collect()
    }
}
