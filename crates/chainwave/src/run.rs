//! `chainwave run`: an experiment all the way, from recordings to figures, fitted damping and a report.
//!
//! Tracking takes nearly all the time and goes by recordings: each one's tracks are kept in the folder `.work` of the
//! results until its bytes or the settings change. What follows takes seconds and is computed anew, from the kept tracks,
//! so an interrupted run that goes on gives the same bytes as one that was not.

mod decisions;
mod evaluation;
mod figures;
mod provenance;
mod report;
mod results;
mod shared_errors;
mod summary;
mod tracking;
mod truth;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::calibration::ChainMap;
use crate::cli;
use crate::error::Error;
use crate::experiment::{Experiment, Trial};
use crate::outcome::Outcome;
use crate::output::make_folder;

/// What a run works on.
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

/// Processes an experiment.
pub(crate) fn run(arguments: &cli::Run) -> Result<Outcome, Error> {
    let job = Job::read(arguments)?;
    make_folder(&job.out)?;
    job.carry_out()
}

impl Job {
    fn read(arguments: &cli::Run) -> Result<Self, Error> {
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

    fn carry_out(&self) -> Result<Outcome, Error> {
        let mut outcome = Outcome::default();
        let mut clock = Clock::new();
        let tracked = tracking::track_all(self, &mut outcome)?;
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
        Ok(outcome)
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
