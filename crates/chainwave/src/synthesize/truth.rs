use std::path::Path;

use chainwave_measurement::{Moment, Trajectory};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

use super::{Studio, TRUTH_INTERVAL_S, Take, write_json};
use crate::error::Error;
use crate::experiment::{Experiment, Trial};
use crate::table::{self, column};

/// The truth behind a synthetic experiment: `truth.json`. Trials that were struck too fast on purpose, or whose view is
/// missing, are left out of every mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Truth {
    /// Seed that everything was drawn from.
    pub(crate) seed: u64,
    /// c_d.
    pub(crate) c_d_kg_per_s: f64,
    /// c_s.
    pub(crate) c_s_kg_per_s: f64,
    /// Mean of the trials' striker velocities.
    pub(crate) striker_velocity_m_per_s: f64,
    /// Instant of the impact after the trials' mean trigger.
    pub(crate) impact_time_s: f64,
    /// The same for each nominal striker velocity, in the order of the trials table.
    pub(crate) strikers: Vec<StrikerTruth>,
}

/// The truth behind the trials of one nominal striker velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StrikerTruth {
    /// The nominal velocity.
    pub(crate) nominal_m_per_s: f64,
    /// Mean of the trials' striker velocities.
    pub(crate) striker_velocity_m_per_s: f64,
    /// Instant of the impact after the trials' mean trigger.
    pub(crate) impact_time_s: f64,
}

/// The mean motion of some recordings' trials, each from its own impact, at their mean trigger, on the given times; `None` where
/// no trial has these recordings. `trials` is the whole table, since draws follow its order.
pub(crate) fn true_motion(
    experiment: &Experiment,
    trials: &[Trial],
    recordings: &[&str],
    times_s: &[f64],
    jobs: Option<u16>,
) -> Result<Option<(StrikerTruth, Trajectory)>, Error> {
    let Some(synthetic) = &experiment.synthetic else { return Ok(None) };
    let studio = Studio::new(experiment, synthetic)?;
    let takes = studio.takes(trials, jobs)?;
    let kept: Vec<&Take> =
        takes.iter().filter(|take| recordings.contains(&take.trial.recording.as_str())).collect();
    let Some(first) = kept.first() else { return Ok(None) };
    let truth = striker(first.nominal_m_per_s, &kept);
    let shape = (experiment.chain.n_bodies, times_s.len());
    let mut mean = Trajectory {
        times_s: times_s.to_vec(),
        displacement_m: Array2::zeros(shape),
        velocity_m_per_s: Array2::zeros(shape),
    };
    for (i, time_s) in times_s.iter().enumerate() {
        for moment in kept.iter().filter_map(|take| take.motion.at(time_s - truth.impact_time_s)) {
            for row in 0..shape.0 {
                mean.displacement_m[(row, i)] += moment.displacement_m(row) / kept.len() as f64;
                mean.velocity_m_per_s[(row, i)] += moment.velocity_m_per_s(row) / kept.len() as f64;
            }
        }
    }
    Ok(Some((truth, mean)))
}

/// Whether two nominal velocities are the same; they are copies of one number.
fn is_nominal(one_m_per_s: f64, other_m_per_s: f64) -> bool {
    one_m_per_s.total_cmp(&other_m_per_s).is_eq()
}

/// Writes what is behind the recordings: for each nominal striker velocity the mean motion over its trials, each from its own
/// impact, at the trials' mean trigger; what was drawn for each trial and each body.
pub(super) fn write(studio: &Studio, takes: &[Take], folder: &Path) -> Result<(), Error> {
    let sound: Vec<&Take> = takes.iter().filter(|take| studio.faults().is_sound(take.trial)).collect();
    let mut nominals: Vec<f64> = Vec::new();
    for take in &sound {
        if !nominals.iter().any(|nominal| is_nominal(*nominal, take.nominal_m_per_s)) {
            nominals.push(take.nominal_m_per_s);
        }
    }
    let of =
        |nominal: f64| sound.iter().copied().filter(move |take| is_nominal(take.nominal_m_per_s, nominal));
    let strikers: Vec<StrikerTruth> =
        nominals.iter().map(|&nominal| striker(nominal, &of(nominal).collect::<Vec<_>>())).collect();
    let all = striker(0.0, &sound);
    let truth = Truth {
        seed: studio.synthetic.seed,
        c_d_kg_per_s: studio.synthetic.damping_kg_per_s.get(),
        c_s_kg_per_s: studio.synthetic.striker_damping_kg_per_s.get(),
        striker_velocity_m_per_s: all.striker_velocity_m_per_s,
        impact_time_s: all.impact_time_s,
        strikers,
    };
    let mut motion = MotionTable::default();
    for striker in &truth.strikers {
        let motions: Vec<&Trajectory> = of(striker.nominal_m_per_s).map(|take| &take.motion).collect();
        motion.append(studio, striker, &motions);
    }
    motion.write(&folder.join("truth.parquet"))?;
    write_json(&folder.join("truth.json"), &truth)?;
    write_trials(studio, takes, folder)?;
    write_bodies(studio, folder)
}

fn striker(nominal_m_per_s: f64, takes: &[&Take]) -> StrikerTruth {
    let n = takes.len().max(1) as f64;
    StrikerTruth {
        nominal_m_per_s,
        striker_velocity_m_per_s: takes.iter().map(|take| take.draw.striker_velocity_m_per_s).sum::<f64>()
            / n,
        impact_time_s: -takes.iter().map(|take| take.draw.trigger_delay_s).sum::<f64>() / n,
    }
}

/// `truth.parquet`, column by column.
#[derive(Default)]
struct MotionTable {
    times_s: Vec<f64>,
    bodies: Vec<u32>,
    displacements_m: Vec<f64>,
    nominals_m_per_s: Vec<f64>,
}

impl MotionTable {
    fn append(&mut self, studio: &Studio, striker: &StrikerTruth, motions: &[&Trajectory]) {
        let [first, last] =
            [studio.first_time_s(), studio.last_time_s()].map(|time_s| time_s / TRUTH_INTERVAL_S);
        for k in first.ceil() as i64..=last.floor() as i64 {
            let time_s = k as f64 * TRUTH_INTERVAL_S;
            let moments: Vec<Moment<'_>> =
                motions.iter().filter_map(|motion| motion.at(time_s - striker.impact_time_s)).collect();
            for row in 0..studio.experiment.chain.n_bodies {
                let sum_m: f64 = moments.iter().map(|moment| moment.displacement_m(row)).sum();
                self.times_s.push(time_s);
                self.bodies.push(row as u32 + 1);
                self.displacements_m.push(sum_m / moments.len() as f64);
                self.nominals_m_per_s.push(striker.nominal_m_per_s);
            }
        }
    }

    fn write(self, path: &Path) -> Result<(), Error> {
        let columns = vec![
            column("t_s", self.times_s),
            column("body", self.bodies),
            column("x_m", self.displacements_m),
            column("striker_velocity_m_per_s", self.nominals_m_per_s),
        ];
        table::write(path, columns)
    }
}

/// `truth_trials.csv`: one row a recording, in the order of the trials table.
fn write_trials(studio: &Studio, takes: &[Take], folder: &Path) -> Result<(), Error> {
    let of = |value: &dyn Fn(&Take) -> f64| takes.iter().map(value).collect::<Vec<f64>>();
    let faults = |take: &Take| studio.faults().names(take.trial);
    let columns = vec![
        column("recording", takes.iter().map(|take| take.trial.recording.as_str()).collect::<Vec<_>>()),
        column("striker_velocity_m_per_s", of(&|take| take.draw.striker_velocity_m_per_s)),
        column("trigger_delay_s", of(&|take| take.draw.trigger_delay_s)),
        column("frame_phase_s", of(&|take| take.draw.frame_phase_s)),
        column("stage_m", of(&|take| take.stage_m)),
        column("faults", takes.iter().map(faults).collect::<Vec<_>>()),
    ];
    table::write(&folder.join("truth_trials.csv"), columns)
}

/// `truth_bodies.csv`: what bodies differ in.
fn write_bodies(studio: &Studio, folder: &Path) -> Result<(), Error> {
    let bodies: Vec<u32> = (1..).take(studio.masses_kg.len()).collect();
    let columns = vec![column("body", bodies), column("mass_kg", studio.masses_kg.clone())];
    table::write(&folder.join("truth_bodies.csv"), columns)
}
