//! `chainwave run`: an experiment all the way, from recordings to figures, fitted damping and a report.
//!
//! Tracking takes nearly all the time and goes by recordings: each one's tracks are kept in the folder `.work` of the
//! results until its bytes or the settings change. What follows takes seconds and is computed anew, from the kept tracks,
//! so an interrupted run that goes on gives the same bytes as one that was not. Several machines may each track a share first.

pub(crate) mod decisions;
pub(crate) mod evaluation;
mod figures;
mod notices;
mod provenance;
mod report;
mod results;
mod share;
mod shared_errors;
mod stages;
mod standing;
mod strikers;
mod summary;
pub(crate) mod tracking;
pub(crate) mod truth;
mod wording;

use std::path::{Path, PathBuf};
use std::time::Instant;

use chainwave_measurement::Estimate;
use chainwave_mechanics::Chain;

use self::decisions::Decision;
use self::evaluation::Evaluation;
pub(crate) use self::figures::draw_motion;
pub(crate) use self::results::write_measurement;
pub(crate) use self::share::Share;
use self::tracking::Tracked;
pub(crate) use self::tracking::View;
use self::truth::KnownTruth;
use crate::calibration::ChainMap;
use crate::cli;
use crate::error::Error;
use crate::experiment::{Experiment, Trial};
use crate::outcome::Outcome;
use crate::output::make_folder;

/// What a run works on.
#[derive(Clone)]
pub(crate) struct Job {
    /// The experiment.
    pub(crate) experiment: Experiment,
    /// Where it was read.
    pub(crate) path: PathBuf,
    /// From its pictures to the chain.
    pub(crate) calibration: ChainMap,
    /// Its recordings.
    pub(crate) trials: Vec<Trial>,
    /// Where they lie.
    pub(crate) recordings: PathBuf,
    /// Where the results go.
    pub(crate) out: PathBuf,
    /// Recordings tracked at a time.
    pub(crate) jobs: Option<u16>,
}

/// A synthetic experiment beside its truth.
pub(crate) struct Comparison {
    /// The tracks.
    pub(crate) tracked: Tracked,
    /// What followed from them.
    pub(crate) evaluation: Evaluation,
    /// The truth of it.
    pub(crate) truth: KnownTruth,
    /// What was decided.
    pub(crate) decisions: Vec<Decision>,
}

/// Processes an experiment.
pub(crate) fn run(arguments: &cli::Run) -> Result<Outcome, Error> {
    let job = Job::read(arguments)?;
    make_folder(&job.out)?;
    let jobs = job.by_striker();
    let mut outcome = Outcome::default();
    if let Some(share) = arguments.share {
        for job in &jobs {
            summary::print_share(job, tracking::track_share(job, share, &mut outcome)?);
        }
        return Ok(outcome);
    }
    let mut evaluations = Vec::with_capacity(jobs.len());
    for job in &jobs {
        make_folder(&job.out)?;
        evaluations.push(job.carry_out(&mut outcome)?);
    }
    if jobs.len() > 1 {
        strikers::compare(&job, &jobs, &evaluations)?;
    }
    Ok(outcome)
}

impl Job {
    /// Reads the experiment that the arguments name.
    pub(crate) fn read(arguments: &cli::Run) -> Result<Self, Error> {
        let path = arguments.experiment.clone();
        let experiment = Experiment::read(&path)?;
        let trials = experiment.read_trials(&path)?;
        let calibration = ChainMap::read(&experiment, &path)?;
        let beside = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let recordings = arguments.recordings.clone().unwrap_or(beside);
        Ok(Self {
            experiment,
            path,
            calibration,
            trials,
            recordings,
            out: arguments.out.clone(),
            jobs: arguments.jobs,
        })
    }

    /// One job for each striker velocity, with a folder of its own where there are several.
    fn by_striker(&self) -> Vec<Self> {
        let mut velocities: Vec<Estimate> =
            self.trials.iter().filter_map(|trial| trial.striker_velocity_m_per_s).collect();
        velocities.sort_by(|a, b| b.value.total_cmp(&a.value));
        velocities.dedup_by(|a, b| a.value.total_cmp(&b.value).is_eq());
        let several = velocities.len() > 1;
        let of_velocity = |velocity: &Estimate| {
            let mut job = self.clone();
            let nominal = |trial: &Trial| trial.striker_velocity_m_per_s.map(|found| found.value);
            job.trials
                .retain(|trial| nominal(trial).is_some_and(|value| value.total_cmp(&velocity.value).is_eq()));
            job.experiment.striker.set_velocity(*velocity);
            if several {
                job.out = self.out.join(format!("striker-{}-m-per-s", velocity.value));
            }
            job
        };
        match velocities.is_empty() {
            true => vec![self.clone()],
            false => velocities.iter().map(of_velocity).collect(),
        }
    }

    fn carry_out(&self, outcome: &mut Outcome) -> Result<Evaluation, Error> {
        let mut clock = Clock::new();
        let tracked = tracking::track_all(self, outcome)?;
        clock.stage("tracking");
        let evaluation = evaluation::evaluate(self, &tracked)?;
        clock.stage("stitching, analysis and fit");
        let truth = truth::read(self, &evaluation)?;
        let decisions = decisions::decide(self, &tracked, &evaluation);
        results::write(self, &tracked, &evaluation, &decisions)?;
        clock.stage("tables");
        let figures = figures::draw(self, &evaluation)?;
        clock.stage("figures");
        report::write(self, &evaluation, truth.as_ref(), &decisions, &figures)?;
        provenance::write(self)?;
        clock.stage("report");
        summary::print(self, &evaluation, truth.as_ref(), &clock);
        Ok(evaluation)
    }

    /// Evaluates a synthetic experiment beside its truth, and writes nothing but the kept tracks.
    pub(crate) fn compare_with_truth(&self, outcome: &mut Outcome) -> Result<Comparison, Error> {
        make_folder(&self.out)?;
        let tracked = tracking::track_all(self, outcome)?;
        let evaluation = evaluation::evaluate(self, &tracked)?;
        let truth = truth::read(self, &evaluation)?.ok_or_else(|| Error::Configuration {
            path: self.path.clone(),
            message: "expected truth.json and truth.parquet beside the recordings, found none".into(),
        })?;
        let decisions = decisions::decide(self, &tracked, &evaluation);
        Ok(Comparison { tracked, evaluation, truth, decisions })
    }

    /// The chain as the experiment states it, with usual damping.
    pub(crate) fn chain(&self) -> Result<Chain, Error> {
        Ok(evaluation::starting_chain(self, self.experiment.contact.power_law()?))
    }

    /// The first recording that shows bodies, with their subsets and the frames at rest.
    pub(crate) fn first_view(&self) -> Result<View, Error> {
        tracking::first_view(self)
    }

    /// The folder of the kept tracks.
    fn kept(&self) -> PathBuf {
        self.result(".work")
    }

    /// A path in the folder of the results.
    pub(crate) fn result(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }
}

/// How long each stage took.
pub(crate) struct Clock {
    last: Instant,
    stages: Vec<(&'static str, f64)>,
}

impl Clock {
    fn new() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    fn stage(&mut self, name: &'static str) {
        self.stages.push((name, self.last.elapsed().as_secs_f64()));
        self.last = Instant::now();
    }

    /// Names and durations in seconds, in order.
    pub(crate) fn stages(&self) -> &[(&'static str, f64)] {
        &self.stages
    }
}
