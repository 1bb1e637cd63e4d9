//! `chainwave synthesize`: the recordings of an experiment as the camera would have written them, with the truth beside.

mod faults;
mod rings;
mod truth;

use std::path::Path;

use chainwave_measurement::{Estimate, Trajectory};
use chainwave_mechanics::{Contact, Contacts, Drive, FarEnd, Law, PowerLaw, Schedule, Striker};
use chainwave_synthetic::trials::{BodyQuantity, Draw, Scatter, body_factors, draw, stage_error_m};
use chainwave_synthetic::{Scene, Shot, film};
use serde::Serialize;

use self::faults::Faults;
pub(crate) use self::faults::{FAULT_KINDS, Fault};
pub(crate) use self::rings::FilmedRings;
pub(crate) use self::truth::{Truth, true_motion};
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
    Faults(&synthetic.faults).check(&trials, path)?;
    let studio = Studio::new(&experiment, &synthetic)?;
    let takes = studio.takes(&trials, arguments.jobs)?;
    if !is_up_to_date(&experiment, &trials, &arguments.out)? {
        remove_recordings(&trials, &arguments.out)?;
        write_plan(&experiment, &trials, &arguments.out)?;
    }
    let bar = progress::bar("filming", trials.len() as u64);
    let filmed = map_in_parallel(arguments.jobs, &takes, |take| {
        studio.film(take, &arguments.out).inspect(|()| bar.inc(1))
    });
    bar.finish_and_clear();
    filmed.into_iter().collect::<Result<(), _>>()?;
    truth::write(&studio, &takes, &arguments.out)?;
    Ok(Outcome::default())
}

/// The chain that is filmed, and how.
struct Studio<'a> {
    experiment: &'a Experiment,
    synthetic: &'a Synthetic,
    contact: Contacts,
    masses_kg: Vec<f64>,
}

/// One trial as it really was.
struct Take<'a> {
    trial: &'a Trial,
    draw: Draw,
    /// What the experiment takes its striker velocity for.
    nominal_m_per_s: f64,
    /// Where the stage really stands.
    stage_m: f64,
    motion: Trajectory,
}

impl<'a> Studio<'a> {
    fn new(experiment: &'a Experiment, synthetic: &'a Synthetic) -> Result<Self, Error> {
        let chain = &experiment.chain;
        let mass_kg = chain.mass_kg.get();
        let scatter = synthetic.mass_sigma_kg.get() / mass_kg;
        let stiffness_scatter = synthetic.stiffness_scatter.get();
        if synthetic.rings.is_some() && scatter + stiffness_scatter > 0.0 {
            return Err(Error::Argument(
                "[synthetic] mass_sigma_kg, stiffness_scatter: expected 0 with [synthetic.rings], whose rings are all alike, \
                 found more"
                    .into(),
            ));
        }
        let factors = body_factors(synthetic.seed, BodyQuantity::Mass, chain.n_bodies, scatter)?;
        let stiffness =
            body_factors(synthetic.seed, BodyQuantity::Stiffness, chain.n_bodies, stiffness_scatter)?;
        Ok(Self {
            experiment,
            synthetic,
            contact: contacts(experiment.contact.power_law()?, stiffness_scatter, &stiffness),
            masses_kg: factors.into_iter().map(|factor| factor * mass_kg).collect(),
        })
    }

    fn faults(&self) -> Faults<'a> {
        Faults(&self.synthetic.faults)
    }

    /// Draws and simulates every trial.
    fn takes<'b>(&self, trials: &'b [Trial], jobs: Option<u16>) -> Result<Vec<Take<'b>>, Error> {
        let scatters: Vec<Scatter> = trials.iter().map(|trial| self.scatter(trial)).collect();
        let draws = draw(self.synthetic.seed, &scatters)?;
        let drawn: Vec<(&Trial, Draw)> = trials.iter().zip(draws).collect();
        map_in_parallel(jobs, &drawn, |(trial, draw)| self.take(trial, *draw)).into_iter().collect()
    }

    fn take<'b>(&self, trial: &'b Trial, mut draw: Draw) -> Result<Take<'b>, Error> {
        draw.striker_velocity_m_per_s *= self.faults().striker_factor(trial);
        let sigma_m = self.synthetic.stage_sigma_m.get();
        Ok(Take {
            nominal_m_per_s: self.nominal(trial).value,
            stage_m: trial.stage_m + stage_error_m(self.synthetic.seed, trial.view.into(), sigma_m)?,
            motion: self.motion(&draw)?,
            trial,
            draw,
        })
    }

    fn scatter(&self, trial: &Trial) -> Scatter {
        let nominal_m_per_s = self.nominal(trial);
        Scatter {
            striker_velocity_m_per_s: nominal_m_per_s.value,
            striker_velocity_sigma_m_per_s: nominal_m_per_s.sigma,
            trigger_jitter_s: self.synthetic.trigger_jitter_s.get(),
            trigger_walk_s: self.synthetic.trigger_walk_s.get(),
            rate_hz: self.synthetic.camera.rate_hz,
        }
    }

    /// The striker velocity that the trials table names, else the experiment's, with its scatter.
    fn nominal(&self, trial: &Trial) -> Estimate {
        let striker = &self.experiment.striker;
        let usual = Estimate::new(striker.velocity_m_per_s.get(), striker.velocity_sigma_m_per_s.get());
        trial.striker_velocity_m_per_s.unwrap_or(usual)
    }

    /// Films a trial, unless its recording is there or lost.
    fn film(&self, take: &Take, folder: &Path) -> Result<(), Error> {
        let faults = self.faults();
        let path = folder.join(faults.file_name(take.trial));
        if path.exists() || faults.is_lost(take.trial) {
            return Ok(());
        }
        let shot = Shot {
            stage_m: take.stage_m,
            first_body_px: self.experiment.camera.first_body_px,
            first_image: self.synthetic.first_image,
            n_frames: self.synthetic.n_frames,
            trigger_delay_s: take.draw.trigger_delay_s,
            frame_phase_s: take.draw.frame_phase_s,
            noise_seed: take.draw.noise_seed,
            covers: faults.covers(take.trial),
        };
        let scene = Scene::new(&self.synthetic.camera, &self.synthetic.specimen, &shot, &take.motion)?;
        let rings = self.synthetic.rings.as_ref();
        let shapes = rings.map(|rings| rings.shapes(self, &take.draw)).transpose()?;
        let scene = match &shapes {
            Some(shapes) => scene.with_shapes(shapes)?,
            None => scene,
        };
        Ok(film(&path, &scene, &faults.of_file(take.trial))?)
    }

    fn motion(&self, draw: &Draw) -> Result<Trajectory, Error> {
        if let Some(rings) = &self.synthetic.rings {
            return rings.motion(self, draw);
        }
        let model = chainwave_mechanics::Chain {
            mass_kg: self.masses_kg.clone(),
            damping_kg_per_s: vec![self.synthetic.damping_kg_per_s.get(); self.masses_kg.len()],
            contact: self.contact.clone(),
            drive: Drive::Striker(Striker {
                mass_kg: self.experiment.striker.mass_kg.get(),
                velocity_m_per_s: draw.striker_velocity_m_per_s,
                damping_kg_per_s: self.synthetic.striker_damping_kg_per_s.get(),
            }),
            far_end: FarEnd::Free,
        };
        let duration_s = self.last_time_s() + 1e-3;
        let schedule = Schedule::automatic(duration_s, TRUTH_INTERVAL_S);
        Ok(chainwave_mechanics::simulate(&model, &schedule)?.trajectory)
    }

    fn first_time_s(&self) -> f64 {
        self.synthetic.first_image as f64 / self.synthetic.camera.rate_hz
    }

    fn last_time_s(&self) -> f64 {
        self.first_time_s() + self.synthetic.n_frames as f64 / self.synthetic.camera.rate_hz
    }
}

/// The contacts of bodies whose stiffnesses scatter: a gap is half of either neighbour, in series.
fn contacts(law: PowerLaw, scatter: f64, stiffness: &[f64]) -> Contacts {
    if scatter <= 0.0 {
        return law.into();
    }
    let gap = |pair: &[f64]| {
        let factor = 2.0 / (pair[0].recip() + pair[1].recip());
        Contact::from(Law::Power(PowerLaw { a: factor * law.a, ..law }))
    };
    Contacts::Each(stiffness.windows(2).map(gap).collect())
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
    let mut columns = vec![
        column("recording", trials.iter().map(|trial| trial.recording.as_str()).collect::<Vec<_>>()),
        column("view", trials.iter().map(|trial| trial.view).collect::<Vec<_>>()),
        column("trial", trials.iter().map(|trial| trial.trial).collect::<Vec<_>>()),
        column("stage_m", trials.iter().map(|trial| trial.stage_m).collect::<Vec<_>>()),
    ];
    let strikers: Option<Vec<Estimate>> = trials.iter().map(|trial| trial.striker_velocity_m_per_s).collect();
    if let Some(strikers) = strikers {
        let of = |value: &dyn Fn(&Estimate) -> f64| strikers.iter().map(value).collect::<Vec<f64>>();
        columns.push(column("striker_velocity_m_per_s", of(&|striker| striker.value)));
        columns.push(column("striker_velocity_sigma_m_per_s", of(&|striker| striker.sigma)));
    }
    table::write(&folder.join(&experiment.trials), columns)?;
    write_text(&folder.join("experiment.toml"), &plan(experiment)?)
}

/// Writes a value as indented JSON.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(path, &format!("{text}\n"))
}
