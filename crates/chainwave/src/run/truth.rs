use chainwave_analysis::{Measurement, exact_motion};
use chainwave_measurement::{Estimate, Trajectory};

use super::Job;
use super::evaluation::{Evaluation, measure_motion};
use crate::error::Error;
use crate::output::read_text;
use crate::synthesize::{Truth, true_motion};

/// The truth of a synthetic experiment, put through the same analysis.
pub(crate) struct KnownTruth {
    /// Damping, striker velocity, impact.
    pub(crate) parameters: Truth,
    /// The true motion on the measured time base.
    pub(crate) motion: Trajectory,
    /// What the analysis makes of the true motion.
    pub(crate) measurement: Measurement,
    /// Root mean square of the error of x_n(t), in metres.
    pub(crate) motion_rms_m: f64,
    /// Share of the samples of x_n(t) whose 95 % interval holds the truth.
    pub(crate) motion_coverage: f64,
}

/// The truth about the recordings that were evaluated, where `synthesize` filmed them; `None` for a real experiment.
///
/// `truth.parquet` is about all sound trials. Here the trials are drawn and simulated again, so that the truth is the mean over
/// those that were read and kept, as the measurement is.
pub(crate) fn read(job: &Job, evaluation: &Evaluation) -> Result<Option<KnownTruth>, Error> {
    let parameters = job.recordings.join("truth.json");
    if job.experiment.synthetic.is_none() || !parameters.exists() {
        return Ok(None);
    }
    let parameters: Truth = serde_json::from_str(&read_text(&parameters)?)
        .map_err(|wrong| Error::Configuration { path: parameters, message: wrong.to_string() })?;
    let trials = job.experiment.read_trials(&job.path)?;
    let alignments = &evaluation.stitched.alignments;
    let kept: Vec<&str> = alignments.iter().map(|alignment| alignment.recording.as_str()).collect();
    let times_s = &evaluation.stitched.motion.times_s;
    let Some((striker, truth)) = true_motion(&job.experiment, &trials, &kept, times_s, job.jobs)? else {
        return Ok(None);
    };
    let (striker_velocity_m_per_s, impact_time_s) = (striker.striker_velocity_m_per_s, striker.impact_time_s);
    let parameters = Truth { striker_velocity_m_per_s, impact_time_s, ..parameters };
    let law = job.experiment.contact.power_law()?;
    let measured = &evaluation.stitched.motion.displacement_m;
    let mut seen = exact_motion(&truth);
    // What was not measured is withheld from the truth too, so that both are evaluated over the same samples.
    seen.displacement_m
        .zip_mut_with(measured, |truth, measured| *truth = truth.filter(|_| measured.is_some()));
    let velocity = evaluation.measurement.group_velocity.as_ref().ok();
    let gaps = velocity.map(|velocity| velocity.gaps.0..=velocity.gaps.1);
    let measurement = measure_motion(job, &seen, &law, gaps)?;
    let pairs: Vec<(Estimate, f64)> =
        measured.iter().zip(&truth.displacement_m).filter_map(|(x, truth)| Some(((*x)?, *truth))).collect();
    let n = pairs.len().max(1) as f64;
    let squares: f64 = pairs.iter().map(|(x, truth)| (x.value - truth).powi(2)).sum();
    let inside = pairs.iter().filter(|(x, truth)| x.covers_95(*truth)).count();
    Ok(Some(KnownTruth {
        parameters,
        motion: truth,
        measurement,
        motion_rms_m: (squares / n).sqrt(),
        motion_coverage: inside as f64 / n,
    }))
}
