//! `chainwave run`: an experiment all the way, from recordings to figures, fitted damping and a report.
//!
//! Tracking takes nearly all the time and goes by recordings: each one's tracks are kept in the folder `.work` of the
//! results until its bytes or the settings change. What follows takes seconds and is computed anew, from the kept tracks,
//! so an interrupted run that goes on gives the same bytes as one that was not. Several machines may each track a share first.

mod explain;
mod figures;
mod provenance;
mod report;
mod results;
mod strikers;
mod summary;

use std::path::{Path, PathBuf};
use std::time::Instant;

use chainwave_experiment::{
    Evaluation, FailedRecording, Results, Setup, compare_strikers, track, track_share,
};

pub(crate) use self::figures::draw_motion;
pub(crate) use self::results::write_measurement;
use crate::cli;
use crate::error::Error;
use crate::kept::KeptFolder;
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished};
use crate::parallel::threads;
use crate::progress;

/// Processes an experiment.
pub(crate) fn run(arguments: &cli::Run) -> Result<Outcome, Error> {
    let whole = Setup::read(&arguments.experiment, arguments.recordings.as_deref())?;
    make_folder(&arguments.out)?;
    let setups = whole.by_striker();
    let folder_of = |setup: &Setup| match setups.len() {
        1 => arguments.out.clone(),
        _ => {
            arguments.out.join(format!("striker-{}-m-per-s", setup.experiment.striker.velocity_m_per_s.get()))
        }
    };
    let mut outcome = Outcome::default();
    if let Some(share) = arguments.share {
        for setup in &setups {
            let store = KeptFolder::in_results(&folder_of(setup))?;
            let bar = progress::bar("tracking", 0);
            let show = progress::shown_on(&bar);
            let monitor = progress::monitor(&show);
            let (n_tracked, failed) = track_share(setup, share, &store, threads(arguments.jobs), &monitor)?;
            name_failed(&failed, &mut outcome);
            summary::print_share(setup, n_tracked);
        }
        return Ok(outcome);
    }
    let mut evaluations: Vec<Evaluation> = Vec::with_capacity(setups.len());
    for setup in &setups {
        let run = Run { setup, out: folder_of(setup), jobs: arguments.jobs, explain: arguments.explain };
        make_folder(&run.out)?;
        evaluations.push(run.carry_out(&mut outcome)?.evaluation);
    }
    if setups.len() > 1 {
        let waves = compare_strikers(&setups, &evaluations, threads(arguments.jobs))?;
        strikers::write(&whole.experiment, &arguments.out, &waves)?;
    }
    Ok(outcome)
}

/// The evaluation of one striker velocity, and where its results go.
struct Run<'a> {
    setup: &'a Setup,
    out: PathBuf,
    jobs: Option<u16>,
    explain: bool,
}

impl Run<'_> {
    fn carry_out(&self, outcome: &mut Outcome) -> Result<Results, Error> {
        let (setup, out) = (self.setup, self.out.as_path());
        let mut clock = Clock::new();
        let store = KeptFolder::in_results(out)?;
        store.remove_unfinished()?;
        remove_unfinished(out)?;
        let bar = progress::bar("tracking", 0);
        let show = progress::shown_on(&bar);
        let monitor = progress::monitor(&show);
        let tracked = track(setup, &store, threads(self.jobs), &monitor)?;
        name_failed(&tracked.failed, outcome);
        summary::print_lines(explain::notes(&tracked));
        if self.explain {
            summary::print_lines(explain::stages(&tracked));
        }
        clock.stage("tracking");
        let results = setup.conclude(tracked, threads(self.jobs))?;
        clock.stage("stitching, analysis and fit");
        results::write(&setup.experiment, out, &results)?;
        clock.stage("tables");
        let figures = figures::draw(&setup.experiment, out, &results.evaluation)?;
        clock.stage("figures");
        report::write(setup, out, &results, &figures)?;
        provenance::write(setup, out)?;
        clock.stage("report");
        summary::print(setup, out, &results, &clock);
        Ok(results)
    }
}

/// Names recordings that failed on standard error.
pub(crate) fn name_failed(failed: &[FailedRecording], outcome: &mut Outcome) {
    failed.iter().for_each(|one| outcome.fail(&one.error));
}

/// The folder of figures in a folder of results, made where it is missing.
fn figures_folder(out: &Path) -> Result<PathBuf, Error> {
    let folder = out.join("figures");
    make_folder(&folder)?;
    Ok(folder)
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
