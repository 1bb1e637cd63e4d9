//! `chainwave run`: an experiment all the way, from recordings to figures, fitted damping and a report.
//!
//! Tracking takes nearly all the time and goes by recordings: each one's tracks are kept in the folder `.work` of the
//! results until its bytes or the settings change. What follows takes seconds and is computed anew, from the kept tracks,
//! so an interrupted run that goes on gives the same bytes as one that was not. Several machines may each track a share first.

mod accuracy;
mod dataset;
mod explain;
mod figures;
mod markers;
mod provenance;
mod pulses;
mod report;
mod results;
mod strikers;
mod summary;

use std::path::{Path, PathBuf};
use std::time::Instant;

use chainwave_experiment::{
    Economy, Evaluation, FailedRecording, Finding, Plan, RecordingState, Setup, State, Tracked,
    TrackedRecording, check, check_share, compare_strikers, plan, recording_states, track, track_share,
};
use serde_json::{Value, json};

pub(crate) use self::figures::draw_motion;
pub(crate) use self::provenance::PROVENANCE;
pub(crate) use self::results::{states_as_json, warnings_as_json, write_measurement};
use crate::cli;
use crate::error::Error;
use crate::kept::KeptFolder;
use crate::limits::{foreseen_as_json, limits_as_json};
use crate::on_demand;
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished, write_json};
use crate::parallel::threads;
use crate::progress;
use crate::terminal;

/// Processes an experiment.
pub(crate) fn run(arguments: &cli::Run) -> Result<Outcome, Error> {
    let mut whole = Setup::read(&arguments.experiment, arguments.recordings.as_deref())?;
    whole.takes_partial = arguments.partial;
    on_demand::expect_recordings_of(&whole)?;
    make_folder(&arguments.out)?;
    let setups = whole.by_striker();
    let folder_of = |setup: &Setup| match setups.len() {
        1 => arguments.out.clone(),
        _ => arguments.out.join(format!("striker-{}-m-per-s", setup.experiment.nominal_drive().value)),
    };
    let mut outcome = Outcome::default();
    if let Some(share) = arguments.share {
        for setup in &setups {
            let store = KeptFolder::in_results(&folder_of(setup))?;
            let bar = progress::bar("tracking", 0);
            let show = progress::shown_on(&bar);
            let monitor = progress::monitor(&show);
            let sanity = check_share(setup, threads(arguments.jobs))?;
            name_findings(&sanity.findings);
            let (n_tracked, failed) =
                track_share(setup, &sanity, share, &store, threads(arguments.jobs), &monitor)?;
            name_failed(&failed, &mut outcome);
            summary::print_share(setup, n_tracked);
        }
        return Ok(outcome);
    }
    if setups.len() > 1 {
        // What an earlier run of one velocity left here is none of theirs.
        results::remove_results(&arguments.out)?;
        results::remove_tracks(&arguments.out)?;
    }
    let mut unread = 0;
    let mut concluded: Vec<(Setup, Evaluation)> = Vec::with_capacity(setups.len());
    let mut states = Vec::with_capacity(whole.trials.len());
    for (index, setup) in setups.iter().enumerate() {
        let place = match setups.len() {
            1 => String::new(),
            n => format!(" ({} of {n})", index + 1),
        };
        let (jobs, dataset) = (arguments.jobs, arguments.dataset.as_deref());
        let (explain, budget) = (arguments.explain, arguments.budget);
        let out = folder_of(setup);
        make_folder(&out)?;
        let economy = accuracy::choose(setup, arguments, &place)?;
        if let Some(economy) = &economy {
            states.extend(accuracy::not_needed(setup, economy));
        }
        let economy = economy.as_ref();
        let setup = economy.map_or(setup, |economy| &economy.setup);
        let run = Run { setup, out, jobs, explain, budget, economy, dataset, place };
        let (of_recordings, evaluation) = run.carry_out(&mut outcome)?;
        // One velocity without recordings does not end the others.
        let is_read = of_recordings.iter().any(|one| one.state != State::Failed);
        unread += usize::from(!is_read);
        states.extend(of_recordings);
        concluded.extend(evaluation.map(|evaluation| (setup.clone(), evaluation)));
    }
    if unread == setups.len() {
        return Err(Error::nothing_left("striker velocities", unread));
    }
    results::write_states(&arguments.out, &states)?;
    if setups.len() > 1 {
        provenance::write(&whole, &arguments.out)?;
    }
    terminal::tell("recordings", states_as_json(states.clone()));
    terminal::tell("results", setups.iter().filter_map(|setup| read_results(&folder_of(setup))).collect());
    summary::print_states(&arguments.out, &states);
    if setups.len() > 1 && !concluded.is_empty() {
        let (setups, evaluations): (Vec<Setup>, Vec<Evaluation>) = concluded.into_iter().unzip();
        let waves = compare_strikers(&setups, &evaluations, threads(arguments.jobs))?;
        let figures = strikers::write(&whole.experiment, &arguments.out, &waves)?;
        let velocity = |(setup, evaluation)| report::Velocity {
            setup,
            evaluation,
            folder: folder_of(setup).file_name().unwrap_or_default().to_string_lossy().into_owned(),
        };
        let velocities: Vec<report::Velocity<'_>> = setups.iter().zip(&evaluations).map(velocity).collect();
        report::write_comparison(&arguments.out, &velocities, &figures)?;
    }
    Ok(outcome)
}

/// The evaluation of one striker velocity, and where its results go.
struct Run<'a> {
    setup: &'a Setup,
    out: PathBuf,
    jobs: Option<u16>,
    explain: bool,
    /// Whether the sources of each uncertainty are asked for.
    budget: bool,
    /// What was chosen for the accuracy that is asked for.
    economy: Option<&'a Economy>,
    /// Folder of the partitioned tracks, where they are asked for.
    dataset: Option<&'a Path>,
    /// Which of several velocities it is, for bars.
    place: String,
}

impl Run<'_> {
    /// What became of each recording, and what followed; `None` where tracks could not be evaluated: they are written all the same, and the
    /// failure is named.
    fn carry_out(&self, outcome: &mut Outcome) -> Result<(Vec<RecordingState>, Option<Evaluation>), Error> {
        let (setup, out) = (self.setup, self.out.as_path());
        let mut clock = Clock::new();
        let store = KeptFolder::in_results(out)?;
        store.remove_unfinished()?;
        remove_unfinished(out)?;
        remove_unfinished(&out.join("figures"))?;
        results::remove_rehearsed(out)?;
        let sanity = check(setup, threads(self.jobs))?;
        name_findings(&sanity.findings);
        clock.stage("sanity");
        let bar = progress::bar(&format!("tracking{}", self.place), 0);
        let show = progress::shown_on(&bar);
        let monitor = progress::monitor(&show);
        let tracked = track(setup, &sanity, &store, threads(self.jobs), &monitor)?;
        name_failed(&tracked.failed, outcome);
        summary::print_lines(explain::notes(&tracked));
        if self.explain {
            summary::print_lines(explain::stages(&tracked));
        }
        clock.stage("tracking");
        if tracked.recordings.is_empty() {
            let reason = Error::nothing_left("recordings", setup.trials.len());
            if self.place.is_empty() {
                return Err(reason);
            }
            let states = recording_states(&setup.trials, &tracked.failed, &[]);
            results::write_unsolved(out, &tracked.findings, states.clone(), &reason.to_string())?;
            results::remove_tracks(out)?;
            outcome.fail(reason);
            return Ok((states, None));
        }
        results::write_tracks(out, &tracked)?;
        if let Some(folder) = self.dataset {
            dataset::write(setup, folder, &tracked)?;
        }
        let findings = tracked.findings.clone();
        let unsolved = unsolved(setup, &tracked);
        let bar = progress::stepped(&format!("stitching and fits{}", self.place));
        let show = progress::shown_on(&bar);
        let mut results = match setup.conclude(tracked, threads(self.jobs), &progress::monitor(&show)) {
            Ok(results) => results,
            Err(error) => {
                results::write_unsolved(out, &findings, unsolved.clone(), &error.to_string())?;
                provenance::write(setup, out)?;
                outcome.fail(error);
                return Ok((unsolved, None));
            }
        };
        clock.stage("stitching, analysis and fit");
        results.decisions.extend(self.economy.iter().flat_map(|economy| economy.decisions.iter().cloned()));
        results::write(setup, out, &results)?;
        clock.stage("tables");
        let mut figures = figures::draw(&setup.experiment, out, &results.evaluation, outcome)?;
        figures.extend(markers::draw(setup, out, &results, outcome)?);
        figures::remove_others(out, &figures)?;
        clock.stage("figures");
        let budget = self.budget.then(|| self.error_budget(&mut clock)).transpose()?;
        let reached = self.economy.map(|economy| accuracy::reached(economy, &results.evaluation));
        if let (Some(economy), Some(reached)) = (self.economy, &reached) {
            accuracy::write(out, economy, reached)?;
        }
        let rehearsed = report::Rehearsed { budget: budget.as_ref(), reached: reached.as_deref() };
        report::write(setup, out, &results, &figures, &rehearsed)?;
        provenance::write(setup, out)?;
        clock.stage("report");
        summary::print(setup, out, &results, &clock);
        // What is not asked for is no news.
        let refusals = results.evaluation.damping.refusals().into_iter();
        for (name, reason) in refusals.filter(|_| setup.experiment.analysis.fits) {
            Outcome::note(format!("{name} is refused: {reason}"));
        }
        Ok((results.recording_states(setup), Some(results.evaluation)))
    }
}

impl Run<'_> {
    /// What the uncertainty of each result comes from: a plan of the experiment as it was filmed, also in `error_budget.json`.
    fn error_budget(&self, clock: &mut Clock) -> Result<Plan, Error> {
        let bar = progress::bar(&format!("error budget{}", self.place), 0);
        let show = progress::shown_on(&bar);
        let begin = Instant::now();
        let now_s = || begin.elapsed().as_secs_f64();
        let plan = plan(self.setup, threads(self.jobs), &progress::monitor(&show), &now_s)?;
        let mut budget = limits_as_json(&plan);
        budget["foreseen"] = foreseen_as_json(&plan);
        write_json(&self.out.join("error_budget.json"), &budget)?;
        clock.stage("error budget");
        Ok(plan)
    }
}

/// What a folder of results says, for programs; none where nothing was written.
fn read_results(folder: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(folder.join("results.json")).ok().filter(|_| terminal::is_json())?;
    let results: Value = serde_json::from_str(&text).ok()?;
    Some(json!({ "folder": folder, "results": results }))
}

/// Tells what contradicts the experiment before time is spent on it; the summary says so again.
fn name_findings(findings: &[Finding]) {
    summary::print_lines(findings.iter().map(|finding| format!("warning, before work: {finding}")));
}

/// What became of each recording where nothing follows from the tracks.
fn unsolved(setup: &Setup, tracked: &Tracked) -> Vec<RecordingState> {
    let left_out = |one: &TrackedRecording| {
        (one.trial.recording.clone(), "the tracks could not be evaluated".to_owned())
    };
    let left_out: Vec<(String, String)> = tracked.recordings.iter().map(left_out).collect();
    recording_states(&setup.trials, &tracked.failed, &left_out)
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
