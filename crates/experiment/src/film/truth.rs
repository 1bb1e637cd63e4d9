//! The truth behind films: what was drawn, and the mean motion that it made.

use std::num::NonZero;

use chainwave_measurement::{Trajectory, TrajectoryAt};
use ndarray::{Array2, ShapeBuilder};
use serde::{Deserialize, Serialize};

use super::{FilmTruth, Studio, Take, one_after_the_other};
use crate::error::Error;

/// The truth behind a synthetic experiment, as `truth.json` has it. Trials that were struck too fast on purpose, or whose view is
/// missing, are left out of every mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// Seed that everything was drawn from.
    pub seed: u64,
    /// c_d.
    pub c_d_kg_per_s: f64,
    /// c_s, where there is a striker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub c_s_kg_per_s: Option<f64>,
    /// Mean of the trials' striker velocities, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_velocity_m_per_s: Option<f64>,
    /// Mean of the trials' drives over the stated one, where no striker drives them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<f64>,
    /// Instant of the impact, or of the drive's beginning, after the trials' mean trigger.
    pub impact_time_s: f64,
    /// The same for each nominal striker velocity, in the order of the trials table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strikers: Vec<StrikerTruth>,
}

/// The truth behind the trials of one nominal striker velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrikerTruth {
    /// The nominal velocity.
    pub nominal_m_per_s: f64,
    /// Mean of the trials' striker velocities.
    pub striker_velocity_m_per_s: f64,
    /// Instant of the impact after the trials' mean trigger.
    pub impact_time_s: f64,
}

/// What was drawn for one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueTrial {
    /// Name of the recording.
    pub recording: String,
    /// Velocity of the striker, in metres per second; of any other drive its strength over the stated one.
    pub striker_velocity_m_per_s: f64,
    /// The trigger's delay after the impact, in seconds.
    pub trigger_delay_s: f64,
    /// Time of image 0 after the trigger, in seconds.
    pub frame_phase_s: f64,
    /// Where the stage really stood, in metres.
    pub stage_m: f64,
    /// The kinds of its faults, with spaces between.
    pub faults: String,
}

/// The mean motion of all sound trials of one nominal striker velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanMotion {
    /// The nominal velocity, in metres per second.
    pub nominal_m_per_s: f64,
    /// Sample times after the trials' mean trigger, in seconds.
    pub times_s: Vec<f64>,
    /// Displacement from rest in metres, shape `[time, body]`.
    pub displacement_m: Array2<f64>,
}

/// Whether two nominal velocities are the same; they are copies of one number.
fn is_nominal(one_m_per_s: f64, other_m_per_s: f64) -> bool {
    one_m_per_s.total_cmp(&other_m_per_s).is_eq()
}

/// The truth behind recordings while the trials' motions come one by one.
pub(super) struct GrowingTruth<'a> {
    studio: &'a Studio<'a>,
    truth: FilmTruth,
    /// When the impact of each mean motion is, after the trials' mean trigger, in seconds.
    impacts_s: Vec<f64>,
    /// How many trials each of their samples has.
    n_trials: Vec<Vec<u32>>,
}

impl GrowingTruth<'_> {
    /// Adds a trial's motion where its trial is sound.
    pub(super) fn add(&mut self, take: &Take<'_>, motion: &Trajectory) {
        if !self.studio.faults().is_sound(take.trial) {
            return;
        }
        let sums = self.truth.motions.iter_mut().zip(&self.impacts_s).zip(&mut self.n_trials);
        let of_its_own = sums.filter(|((sum, _), _)| is_nominal(sum.nominal_m_per_s, take.nominal_m_per_s));
        for ((sum, impact_s), n_trials) in of_its_own {
            let moments: Vec<Option<TrajectoryAt<'_>>> =
                sum.times_s.iter().map(|time_s| motion.at(time_s - impact_s)).collect();
            n_trials.iter_mut().zip(&moments).for_each(|(n, moment)| *n += u32::from(moment.is_some()));
            for (body, mut of_body) in sum.displacement_m.columns_mut().into_iter().enumerate() {
                for (sum_m, moment) in of_body.iter_mut().zip(&moments) {
                    *sum_m += moment.map_or(0.0, |moment| moment.displacement_m(body));
                }
            }
        }
    }

    /// The truth behind all that were added.
    pub(super) fn finished(self) -> FilmTruth {
        let Self { mut truth, n_trials, .. } = self;
        for (mean, n_trials) in truth.motions.iter_mut().zip(n_trials) {
            for (mut row, n) in mean.displacement_m.rows_mut().into_iter().zip(n_trials) {
                row.iter_mut().for_each(|sum_m| *sum_m /= f64::from(n));
            }
        }
        truth
    }
}

impl Studio<'_> {
    /// What is behind the recordings: for each nominal striker velocity the mean motion over its trials, each from its own impact, at the
    /// trials' mean trigger, which grows as they are added; what was drawn for each trial and each body.
    pub(super) fn truth(&self, takes: &[Take<'_>]) -> GrowingTruth<'_> {
        let sound: Vec<&Take> = takes.iter().filter(|take| self.faults().is_sound(take.trial)).collect();
        let mut nominals: Vec<f64> = Vec::new();
        for take in &sound {
            if !nominals.iter().any(|nominal| is_nominal(*nominal, take.nominal_m_per_s)) {
                nominals.push(take.nominal_m_per_s);
            }
        }
        let of = |nominal: f64| {
            sound.iter().copied().filter(move |take| is_nominal(take.nominal_m_per_s, nominal))
        };
        let strikers: Vec<StrikerTruth> =
            nominals.iter().map(|&nominal| striker(nominal, &of(nominal).collect::<Vec<_>>())).collect();
        let all = striker(0.0, &sound);
        let is_struck = self.experiment.striker.is_some();
        let motions: Vec<MeanMotion> =
            strikers.iter().map(|striker| self.no_motion(striker.nominal_m_per_s)).collect();
        let n_trials = motions.iter().map(|mean| vec![0; mean.times_s.len()]).collect();
        let impacts_s = strikers.iter().map(|striker| striker.impact_time_s).collect();
        let truth = FilmTruth {
            motions,
            trials: self.true_trials(takes),
            masses_kg: self.masses_kg.clone(),
            is_struck,
            parameters: Truth {
                seed: self.synthetic.seed,
                c_d_kg_per_s: self.synthetic.damping_kg_per_s.get(),
                c_s_kg_per_s: self.experiment.striker.as_ref().map(|_| self.synthetic.c_s_kg_per_s()),
                striker_velocity_m_per_s: is_struck.then_some(all.striker_velocity_m_per_s),
                drive: (!is_struck).then_some(all.striker_velocity_m_per_s),
                impact_time_s: all.impact_time_s,
                strikers: if is_struck { strikers } else { Vec::new() },
            },
        };
        GrowingTruth { studio: self, truth, impacts_s, n_trials }
    }

    /// What was drawn for each trial.
    pub(crate) fn true_trials(&self, takes: &[Take<'_>]) -> Vec<TrueTrial> {
        let of_take = |take: &Take| TrueTrial {
            recording: take.trial.recording.clone(),
            striker_velocity_m_per_s: take.draw.striker_velocity_m_per_s,
            trigger_delay_s: take.draw.trigger_delay_s,
            frame_phase_s: take.draw.frame_phase_s,
            stage_m: take.stage_m,
            faults: self.faults().names(take.trial),
        };
        takes.iter().map(of_take).collect()
    }

    /// The mean motion of some recordings' trials, each from its own impact, at their mean trigger, on the given times; `None` where
    /// no trial has these recordings.
    ///
    /// # Errors
    /// A chain that cannot be computed.
    pub(crate) fn mean_motion(
        &self,
        takes: &[Take<'_>],
        recordings: &[&str],
        times_s: &[f64],
        n_threads: NonZero<usize>,
    ) -> Result<Option<(StrikerTruth, Trajectory)>, Error> {
        let kept: Vec<&Take> =
            takes.iter().filter(|take| recordings.contains(&take.trial.recording.as_str())).collect();
        let Some(first) = kept.first() else { return Ok(None) };
        let truth = striker(first.nominal_m_per_s, &kept);
        let shape = (self.experiment.chain.n_bodies, times_s.len());
        let mut mean = Trajectory {
            times_s: times_s.to_vec(),
            displacement_m: Array2::zeros(shape),
            velocity_m_per_s: Array2::zeros(shape),
        };
        let n = kept.len() as f64;
        let motion_of = |take: &Take<'_>| self.motion(&take.draw);
        one_after_the_other(&kept, n_threads, motion_of, |_, motion| {
            let moments: Vec<Option<TrajectoryAt<'_>>> =
                times_s.iter().map(|time_s| motion.at(time_s - truth.impact_time_s)).collect();
            for row in 0..shape.0 {
                for (i, moment) in moments.iter().enumerate() {
                    let Some(moment) = moment else { continue };
                    mean.displacement_m[(row, i)] += moment.displacement_m(row) / n;
                    mean.velocity_m_per_s[(row, i)] += moment.velocity_m_per_s(row) / n;
                }
            }
        })?;
        Ok(Some((truth, mean)))
    }

    /// A mean motion of no trials, at all times that are filmed.
    fn no_motion(&self, nominal_m_per_s: f64) -> MeanMotion {
        let interval_s = self.synthetic.truth_interval_s();
        let [first, last] = self.synthetic.span_s().map(|time_s| time_s / interval_s);
        let times_s: Vec<f64> =
            (first.ceil() as i64..=last.floor() as i64).map(|k| k as f64 * interval_s).collect();
        // The times of a body lie side by side, as they do in each trial's motion.
        let displacement_m = Array2::zeros((times_s.len(), self.experiment.chain.n_bodies).f());
        MeanMotion { nominal_m_per_s, times_s, displacement_m }
    }
}

fn striker(nominal_m_per_s: f64, takes: &[&Take<'_>]) -> StrikerTruth {
    let n = takes.len().max(1) as f64;
    StrikerTruth {
        nominal_m_per_s,
        striker_velocity_m_per_s: takes.iter().map(|take| take.draw.striker_velocity_m_per_s).sum::<f64>()
            / n,
        impact_time_s: -takes.iter().map(|take| take.draw.trigger_delay_s).sum::<f64>() / n,
    }
}
