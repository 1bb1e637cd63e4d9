use chainwave_analysis::{Measurement, exact_motion};
use chainwave_measurement::{Estimate, Trajectory};
use ndarray::Array2;

use super::Job;
use super::evaluation::{Evaluation, measure_motion};
use crate::error::Error;
use crate::output::read_text;
use crate::synthesize::{Truth, is_nominal};
use crate::table::Table;

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

/// Reads the truth that `synthesize` left beside the recordings; `None` for a real experiment.
pub(crate) fn read(job: &Job, evaluation: &Evaluation) -> Result<Option<KnownTruth>, Error> {
    let (parameters, motion) = (job.recordings.join("truth.json"), job.recordings.join("truth.parquet"));
    if job.experiment.synthetic.is_none() || !parameters.exists() || !motion.exists() {
        return Ok(None);
    }
    let nominal_m_per_s = job.experiment.striker.velocity_m_per_s.get();
    let parameters: Truth = serde_json::from_str(&read_text(&parameters)?)
        .map_err(|wrong| Error::Configuration { path: parameters, message: wrong.to_string() })?;
    let Some(striker) = parameters.striker(nominal_m_per_s) else { return Ok(None) };
    let (striker_velocity_m_per_s, impact_time_s) = (striker.striker_velocity_m_per_s, striker.impact_time_s);
    let parameters = Truth { striker_velocity_m_per_s, impact_time_s, ..parameters };
    let times_s = &evaluation.stitched.motion.times_s;
    let truth = true_motion(&Table::read(&motion)?, striker.nominal_m_per_s, times_s)?;
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

/// The true displacements of one nominal striker velocity at the given times: the table's own samples, whose spacing divides the frame interval; between them,
/// linearly (an error of 1e-8 m at 10 us).
fn true_motion(table: &Table, nominal_m_per_s: f64, times_s: &[f64]) -> Result<Trajectory, Error> {
    let nominals = table.full_numbers("striker_velocity_m_per_s")?;
    let asked = |row: usize| is_nominal(nominals[row], nominal_m_per_s);
    let of = |numbers: Vec<f64>| -> Vec<f64> {
        numbers.into_iter().enumerate().filter_map(|(row, number)| asked(row).then_some(number)).collect()
    };
    let (t_s, x_m) = (of(table.full_numbers("t_s")?), of(table.full_numbers("x_m")?));
    let bodies = table.counts("body")?;
    let n_bodies = bodies.iter().copied().max().unwrap_or(1);
    let sampled: Vec<f64> = t_s.iter().step_by(n_bodies).copied().collect();
    let displacement_m = Array2::from_shape_fn((n_bodies, times_s.len()), |(row, i)| {
        let right = sampled.partition_point(|time| *time < times_s[i]).clamp(1, sampled.len() - 1);
        let (t0, t1) = (sampled[right - 1], sampled[right]);
        let share = ((times_s[i] - t0) / (t1 - t0)).clamp(0.0, 1.0);
        (1.0 - share) * x_m[(right - 1) * n_bodies + row] + share * x_m[right * n_bodies + row]
    });
    let velocity_m_per_s = Array2::zeros(displacement_m.dim());
    Ok(Trajectory { times_s: times_s.to_vec(), displacement_m, velocity_m_per_s })
}
