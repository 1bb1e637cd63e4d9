//! `chainwave synthesize`: the recordings of an experiment as the camera would have written them, with the truth beside.

use std::path::Path;

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Drive, FarEnd, PowerLaw, Schedule, Striker};
use chainwave_synthetic::trials::{Draw, Scatter};
use chainwave_synthetic::{Shot, film};
use serde::{Deserialize, Serialize};

use crate::cli;
use crate::error::Error;
use crate::experiment::{Experiment, Synthetic, Trial};
use crate::outcome::Outcome;
use crate::output::{make_folder, read_text, remove_unfinished, write_text};
use crate::parallel::map_in_parallel;
use crate::progress;
use crate::table::{self, column};

/// Interval of the simulated motion and of `truth.parquet`: 1/175 of the shortest period of the chain.
const TRUTH_INTERVAL_S: f64 = 1e-5;

/// The truth behind a synthetic experiment: `truth.json`.
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
}

/// Films every recording of an experiment's trials table. A recording that is there already with the same settings is kept.
pub(crate) fn synthesize(arguments: &cli::Synthesize) -> Result<Outcome, Error> {
    let path = &arguments.experiment;
    let mut experiment = Experiment::read(path)?;
    let trials = experiment.read_trials(path)?;
    let synthetic = experiment.synthetic.as_mut().ok_or_else(|| Error::Configuration {
        path: path.clone(),
        message: "expected a [synthetic] part that says what is filmed, found none".into(),
    })?;
    synthetic.seed = arguments.seed.unwrap_or(synthetic.seed);
    let synthetic = synthetic.clone();
    make_folder(&arguments.out)?;
    remove_unfinished(&arguments.out)?;
    let studio = Studio::new(&experiment, &synthetic, &trials)?;
    if !is_up_to_date(&experiment, &trials, &arguments.out)? {
        remove_recordings(&trials, &arguments.out)?;
        write_plan(&experiment, &trials, &arguments.out)?;
    }
    let bar = progress::bar("filming", trials.len() as u64);
    let shots: Vec<(&Trial, &Draw)> = trials.iter().zip(&studio.draws).collect();
    let filmed = map_in_parallel(arguments.jobs, &shots, |(trial, draw)| {
        studio.film(trial, draw, &arguments.out).inspect(|_| bar.inc(1))
    });
    bar.finish_and_clear();
    let motions: Vec<Trajectory> = filmed.into_iter().collect::<Result<_, _>>()?;
    studio.write_truth(&motions, &arguments.out)?;
    Ok(Outcome::default())
}

struct Studio<'a> {
    experiment: &'a Experiment,
    synthetic: &'a Synthetic,
    draws: Vec<Draw>,
    contact: PowerLaw,
}

impl<'a> Studio<'a> {
    fn new(experiment: &'a Experiment, synthetic: &'a Synthetic, trials: &[Trial]) -> Result<Self, Error> {
        let scatter = Scatter {
            striker_velocity_m_per_s: experiment.striker.velocity_m_per_s.get(),
            striker_velocity_sigma_m_per_s: experiment.striker.velocity_sigma_m_per_s.get(),
            trigger_jitter_s: synthetic.trigger_jitter_s.get(),
            rate_hz: synthetic.camera.rate_hz,
        };
        let draws = chainwave_synthetic::trials::draw(synthetic.seed, trials.len(), &scatter)?;
        Ok(Self { experiment, synthetic, draws, contact: experiment.contact.power_law()? })
    }

    /// Simulates one trial and films it, unless its recording is there.
    fn film(&self, trial: &Trial, draw: &Draw, folder: &Path) -> Result<Trajectory, Error> {
        let motion = self.motion(draw)?;
        let path = folder.join(&trial.recording);
        if !path.exists() {
            let shot = Shot {
                stage_m: trial.stage_m,
                first_body_px: self.experiment.camera.first_body_px,
                first_image: self.synthetic.first_image,
                n_frames: self.synthetic.n_frames,
                trigger_delay_s: draw.trigger_delay_s,
                frame_phase_s: draw.frame_phase_s,
                noise_seed: draw.noise_seed,
            };
            film(&path, &self.synthetic.camera, &self.synthetic.specimen, &shot, &motion)?;
        }
        Ok(motion)
    }

    fn motion(&self, draw: &Draw) -> Result<Trajectory, Error> {
        let chain = &self.experiment.chain;
        let model = chainwave_mechanics::Chain {
            mass_kg: vec![chain.mass_kg.get(); chain.n_bodies],
            damping_kg_per_s: vec![self.synthetic.damping_kg_per_s.get(); chain.n_bodies],
            contact: self.contact,
            drive: Drive::Striker(Striker {
                mass_kg: self.experiment.striker.mass_kg.get(),
                velocity_m_per_s: draw.striker_velocity_m_per_s,
                damping_kg_per_s: self.synthetic.striker_damping_kg_per_s.get(),
            }),
            far_end: FarEnd::Free,
        };
        let duration_s = self.last_time_s() + 1e-3;
        let schedule = Schedule { duration_s, output_interval_s: TRUTH_INTERVAL_S, dt_s: None };
        Ok(chainwave_mechanics::simulate(&model, &schedule)?.trajectory)
    }

    fn first_time_s(&self) -> f64 {
        self.synthetic.first_image as f64 / self.synthetic.camera.rate_hz
    }

    fn last_time_s(&self) -> f64 {
        self.first_time_s() + self.synthetic.n_frames as f64 / self.synthetic.camera.rate_hz
    }

    /// Writes the mean motion over all trials, each from its own impact, at the trials' mean trigger; and what is behind it.
    fn write_truth(&self, motions: &[Trajectory], folder: &Path) -> Result<(), Error> {
        let n = motions.len() as f64;
        let mean = |of: &dyn Fn(&Draw) -> f64| self.draws.iter().map(of).sum::<f64>() / n;
        let truth = Truth {
            seed: self.synthetic.seed,
            c_d_kg_per_s: self.synthetic.damping_kg_per_s.get(),
            c_s_kg_per_s: self.synthetic.striker_damping_kg_per_s.get(),
            striker_velocity_m_per_s: mean(&|draw| draw.striker_velocity_m_per_s),
            impact_time_s: -mean(&|draw| draw.trigger_delay_s),
        };
        let (mut times, mut bodies, mut displacements) = (Vec::new(), Vec::new(), Vec::new());
        let (first, last) = (self.first_time_s() / TRUTH_INTERVAL_S, self.last_time_s() / TRUTH_INTERVAL_S);
        for k in first.ceil() as i64..=last.floor() as i64 {
            let time_s = k as f64 * TRUTH_INTERVAL_S;
            let moments: Vec<Moment<'_>> =
                motions.iter().filter_map(|motion| motion.at(time_s - truth.impact_time_s)).collect();
            for row in 0..self.experiment.chain.n_bodies {
                let x_m: f64 = moments.iter().map(|moment| moment.displacement_m(row)).sum();
                times.push(time_s);
                bodies.push(row as u32 + 1);
                displacements.push(x_m / n);
            }
        }
        let columns = vec![column("t_s", times), column("body", bodies), column("x_m", displacements)];
        table::write(&folder.join("truth.parquet"), columns)?;
        write_json(&folder.join("truth.json"), &truth)?;
        self.write_trial_truths(folder)
    }

    fn write_trial_truths(&self, folder: &Path) -> Result<(), Error> {
        let of = |value: &dyn Fn(&Draw) -> f64| self.draws.iter().map(value).collect::<Vec<f64>>();
        let columns = vec![
            column("striker_velocity_m_per_s", of(&|draw| draw.striker_velocity_m_per_s)),
            column("trigger_delay_s", of(&|draw| draw.trigger_delay_s)),
        ];
        table::write(&folder.join("truth_trials.csv"), columns)
    }
}

/// Whether the folder already holds this very plan, so that its finished recordings may be kept.
fn is_up_to_date(experiment: &Experiment, trials: &[Trial], folder: &Path) -> Result<bool, Error> {
    let path = folder.join("experiment.toml");
    if !path.exists() || read_text(&path)? != plan(experiment)? {
        return Ok(false);
    }
    Ok(experiment.read_trials(&path).is_ok_and(|found| found == trials))
}

fn remove_recordings(trials: &[Trial], folder: &Path) -> Result<(), Error> {
    for trial in trials {
        let path = folder.join(&trial.recording);
        if path.exists() {
            std::fs::remove_file(&path)
                .map_err(Error::file(&path, "remove the recording of another plan"))?;
        }
    }
    Ok(())
}

fn plan(experiment: &Experiment) -> Result<String, Error> {
    toml::to_string(experiment).map_err(|wrong| Error::Argument(wrong.to_string()))
}

/// Writes `experiment.toml` and `trials.csv` beside the recordings, so that `run` can start there.
fn write_plan(experiment: &Experiment, trials: &[Trial], folder: &Path) -> Result<(), Error> {
    let columns = vec![
        column("recording", trials.iter().map(|trial| trial.recording.as_str()).collect::<Vec<_>>()),
        column("view", trials.iter().map(|trial| trial.view).collect::<Vec<_>>()),
        column("trial", trials.iter().map(|trial| trial.trial).collect::<Vec<_>>()),
        column("stage_m", trials.iter().map(|trial| trial.stage_m).collect::<Vec<_>>()),
    ];
    table::write(&folder.join(&experiment.trials), columns)?;
    write_text(&folder.join("experiment.toml"), &plan(experiment)?)
}

/// Writes a value as indented JSON.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(path, &format!("{text}\n"))
}
