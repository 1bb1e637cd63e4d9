//! A synthetic experiment beside its truth: the true motion put through the same analysis.

use std::num::NonZero;

use chainwave_analysis::{Measurement, exact_motion};
use chainwave_measurement::{Estimate, Trajectory};

use crate::chain::measuring::measure_motion;
use crate::configuration::Experiment;
use crate::error::Error;
use crate::evaluation::Evaluation;
use crate::film::{Studio, TrueTrial};
use crate::setup::Setup;

/// The truth of a synthetic experiment.
pub struct KnownTruth {
    /// c_d.
    pub chain_damping_kg_per_s: f64,
    /// c_s; 0 where there is no striker.
    pub striker_damping_kg_per_s: f64,
    /// Mean striker velocity of the recordings that were evaluated; of any other drive its strength over the stated one.
    pub striker_velocity_m_per_s: f64,
    /// Instant of the impact after their mean trigger.
    pub impact_time_s: f64,
    /// What was drawn for each trial that was filmed.
    pub trials: Vec<TrueTrial>,
    /// The true motion on the measured time base.
    pub motion: Trajectory,
    /// What the analysis makes of the true motion.
    pub measurement: Measurement,
    /// Root mean square of the error of x_n(t), in metres.
    pub motion_rms_m: f64,
    /// Share of the samples of x_n(t) whose 95 % interval holds the truth.
    pub motion_coverage: f64,
}

/// Written beside the recordings that were filmed; where it is missing, an experiment with a synthetic part is a real one.
pub const TRUTH: &str = "truth.json";
/// Stands in a folder that is filmed into from before the first film, with the plan by which: recordings there may be replaced by films of another.
pub const FILMED: &str = ".filmed.toml";
/// What was filmed as it stands beside recordings for whoever reads it, and in folders without the sign for all.
const STATED: &str = "experiment.toml";

/// The truth about the recordings that were evaluated, where they were filmed here; `None` for a real experiment.
///
/// `truth.parquet` is about all sound trials. Here the trials are drawn and simulated again, so that the truth is the mean over
/// those that were read and kept, as the measurement is. They are those of the experiment and the table beside the recordings, whichever of them are evaluated here, and
/// whatever the experiment that is evaluated states: what is drawn for one trial goes with its place in the table.
pub(crate) fn known_truth(
    setup: &Setup,
    evaluation: &Evaluation,
    n_threads: NonZero<usize>,
) -> Result<Option<KnownTruth>, Error> {
    let paths = [FILMED, STATED].map(|name| setup.recordings.join(name));
    let Some(path) = paths.into_iter().find(|path| path.exists() && setup.recordings.join(TRUTH).exists())
    else {
        return Ok(None);
    };
    let filmed = Experiment::read(&path)?;
    let Some(synthetic) = &filmed.synthetic else { return Ok(None) };
    let (n_filmed, n_stated) = (filmed.chain.n_bodies, setup.experiment.chain.n_bodies);
    if n_filmed != n_stated {
        return Err(Error::Value(format!(
            "{}: expected a chain of {n_filmed} bodies, as was filmed, found {n_stated}",
            setup.path.display()
        )));
    }
    let trials = filmed.read_trials(&path)?;
    let studio = Studio::new(&filmed, synthetic)?;
    let takes = studio.takes(&trials)?;
    let alignments = &evaluation.stitched.alignments;
    let kept: Vec<&str> = alignments.iter().map(|alignment| alignment.recording.as_str()).collect();
    let times_s = &evaluation.stitched.motion.times_s;
    let Some((striker, truth)) = studio.mean_motion(&takes, &kept, times_s, n_threads)? else {
        return Ok(None);
    };
    let measured = &evaluation.stitched.motion.displacement_m;
    let mut seen = exact_motion(&truth);
    // What was not measured is withheld from the truth too, so that both are evaluated over the same samples.
    seen.displacement_m
        .zip_mut_with(measured, |truth, measured| *truth = truth.filter(|_| measured.is_some()));
    let velocity = evaluation.measurement.group_velocity.as_ref().ok();
    let gaps = velocity.map(|velocity| velocity.gaps.0..=velocity.gaps.1);
    let measurement = measure_motion(&setup.experiment, &seen, gaps, n_threads)?;
    let pairs: Vec<(Estimate, f64)> =
        measured.iter().zip(&truth.displacement_m).filter_map(|(x, truth)| Some(((*x)?, *truth))).collect();
    let n = pairs.len().max(1) as f64;
    let squares: f64 = pairs.iter().map(|(x, truth)| (x.value - truth).powi(2)).sum();
    let inside = pairs.iter().filter(|(x, truth)| x.covers_95(*truth)).count();
    Ok(Some(KnownTruth {
        chain_damping_kg_per_s: synthetic.damping_kg_per_s.get(),
        striker_damping_kg_per_s: synthetic.c_s_kg_per_s(),
        striker_velocity_m_per_s: striker.striker_velocity_m_per_s,
        impact_time_s: striker.impact_time_s,
        trials: studio.true_trials(&takes),
        motion: truth,
        measurement,
        motion_rms_m: (squares / n).sqrt(),
        motion_coverage: inside as f64 / n,
    }))
}
