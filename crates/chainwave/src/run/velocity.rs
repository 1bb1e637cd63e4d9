//! One striker velocity of an experiment: from its recordings to its report.

use std::path::{Path, PathBuf};
use std::time::Instant;

use chainwave_experiment::{
    Economy, FailedRecording, LeftOutRecording, Plan, RecordingState, Results, Setup, Tracked, check, plan,
    recording_states, track,
};

use super::ended::{Done, End, Evaluated};
use super::named::{name_failed, name_findings};
use super::stage_times::StageTimes;
use super::{accuracy, dataset, explain, figures, markers, outputs, provenance, report, results, summary};
use crate::cli;
use crate::error::Error;
use crate::kept::KeptFolder;
use crate::outcome::Outcome;
use crate::output::{FIGURES_FOLDER, make_folder, remove_unfinished, write_json};
use crate::parallel::threads;
use crate::plan_json::{foreseen_as_json, limits_as_json};
use crate::progress;

/// A striker velocity that is to be evaluated.
pub(super) struct Velocity<'a> {
    /// The experiment as it is stated.
    pub(super) stated: &'a Setup,
    /// Where its results go.
    pub(super) out: PathBuf,
    pub(super) arguments: &'a cli::Run,
    /// Which of several velocities it is, for bars.
    pub(super) place: String,
    /// What stands before a failure: the velocity, where it is one of several.
    pub(super) said_of: String,
}

impl Velocity<'_> {
    /// Evaluates it. What is wrong with one velocity is its end and no error, as the others go on.
    ///
    /// # Errors
    /// What ends them all: the user asked to stop, the disk takes nothing, or the program with OpenCV takes over.
    pub(super) fn carry_out(&self, outcome: &mut Outcome) -> Result<Done, Error> {
        match self.attempt(outcome) {
            Err(error) if !error.ends_all() => {
                let reason = error.to_string();
                let trials = &self.stated.trials;
                let states = recording_states(trials, &[], &LeftOutRecording::each_of(trials, &reason));
                results::write_unsolved(&self.out, &[], &states, &reason)?;
                outputs::remove_tracks(&self.out)?;
                Ok(Done { states, end: End::Nothing(error) })
            }
            done => done,
        }
    }

    fn attempt(&self, outcome: &mut Outcome) -> Result<Done, Error> {
        make_folder(&self.out)?;
        let economy = accuracy::choose(self.stated, self.arguments, &self.place)?;
        let setup = economy.as_ref().map_or(self.stated, |economy| &economy.setup);
        let run = Run { velocity: self, setup, economy: economy.as_ref() };
        run.carry_out(outcome)
    }
}

/// The evaluation of a velocity.
struct Run<'a> {
    velocity: &'a Velocity<'a>,
    /// The experiment as it is run.
    setup: &'a Setup,
    /// What was chosen for the accuracy that is asked for.
    economy: Option<&'a Economy>,
}

impl Run<'_> {
    fn carry_out(&self, outcome: &mut Outcome) -> Result<Done, Error> {
        let (setup, out, arguments) = (self.setup, self.velocity.out.as_path(), self.velocity.arguments);
        let mut clock = StageTimes::new();
        let tracked = self.tracked(&mut clock, outcome)?;
        if tracked.recordings.is_empty() {
            let reason = Error::nothing_left("recordings", setup.trials.len());
            let states = self.states(&tracked.failed, &[]);
            results::write_unsolved(out, &tracked.findings, &states, &reason.to_string())?;
            outputs::remove_tracks(out)?;
            return Ok(Done { states, end: End::Nothing(reason) });
        }
        results::write_tracks(out, &tracked)?;
        if let Some(folder) = &arguments.dataset {
            dataset::write(setup, folder, &tracked)?;
        }
        clock.stage("tracking");
        let (findings, unsolved) = (tracked.findings.clone(), self.unsolved(&tracked));
        let bar = progress::stepped(&format!("stitching and fits{}", self.velocity.place));
        let show = progress::shown_on(&bar);
        match setup.conclude(tracked, threads(arguments.jobs), &progress::monitor(&show)) {
            Ok(results) => self.write(results, &mut clock, outcome),
            Err(error) => {
                let reason = error.to_string();
                results::write_unsolved(out, &findings, &unsolved, &reason)?;
                provenance::write(self.velocity.stated, &setup.experiment, &unsolved, out)?;
                outcome.fail(format!("{}{reason}", self.velocity.said_of));
                Ok(Done { states: unsolved, end: End::Unsolved(reason) })
            }
        }
    }

    fn tracked(&self, clock: &mut StageTimes, outcome: &mut Outcome) -> Result<Tracked, Error> {
        let (out, arguments) = (self.velocity.out.as_path(), self.velocity.arguments);
        let n_threads = threads(arguments.jobs);
        let store = KeptFolder::in_results(out)?;
        store.remove_unfinished()?;
        remove_unfinished(out)?;
        remove_unfinished(&out.join(FIGURES_FOLDER))?;
        outputs::remove_rehearsed(out)?;
        let sanity = check(self.setup, n_threads)?;
        name_findings(&sanity.findings);
        clock.stage("sanity");
        let bar = progress::bar(&format!("tracking{}", self.velocity.place), 0);
        let show = progress::shown_on(&bar);
        let tracked = track(self.setup, &sanity, &store, n_threads, &progress::monitor(&show))?;
        name_failed(&tracked.failed, outcome);
        summary::print_lines(explain::notes(&tracked));
        if arguments.explain {
            summary::print_lines(explain::stages(&tracked));
        }
        Ok(tracked)
    }

    /// Writes what was found, and says so.
    fn write(
        &self,
        mut results: Results,
        clock: &mut StageTimes,
        outcome: &mut Outcome,
    ) -> Result<Done, Error> {
        let (setup, out) = (self.setup, self.velocity.out.as_path());
        clock.stage("stitching, analysis and fit");
        results.decisions.extend(self.economy.iter().flat_map(|economy| economy.decisions.iter().cloned()));
        let states = self.states(&results.tracked.failed, &results.evaluation.left_out_recordings());
        results::write(setup, out, &results, &states)?;
        clock.stage("tables");
        let mut figures = figures::draw(&setup.experiment, out, &results.evaluation, outcome)?;
        figures.extend(markers::draw(setup, out, &results, outcome)?);
        outputs::remove_figures(out, &figures)?;
        clock.stage("figures");
        let budget = self.budget(clock, outcome)?;
        let reached = self.economy.map(|economy| accuracy::reached(economy, &results.evaluation));
        if let (Some(economy), Some(reached)) = (self.economy, &reached) {
            accuracy::write(out, economy, reached)?;
        }
        let rehearsed = report::Rehearsed { budget: budget.as_ref(), reached: reached.as_deref() };
        report::write(setup, out, &results, &states, &figures, &rehearsed)?;
        provenance::write(self.velocity.stated, &setup.experiment, &states, out)?;
        clock.stage("report");
        summary::print(setup, out, &results, clock);
        // What is not asked for is no news.
        let refusals = results.evaluation.damping.refusals().into_iter();
        for (name, reason) in refusals.filter(|_| setup.experiment.analysis.fits) {
            Outcome::note(format!("{name} is refused: {reason}"));
        }
        let evaluated = Evaluated { setup: setup.clone(), evaluation: results.evaluation };
        Ok(Done { states, end: End::Evaluated(Box::new(evaluated)) })
    }

    /// What the uncertainty of each result comes from, where that is asked for: a plan of the experiment as it was filmed, also in
    /// `error_budget.json`. Results stand without it: where it cannot be made, that is named.
    fn budget(&self, clock: &mut StageTimes, outcome: &mut Outcome) -> Result<Option<Plan>, Error> {
        if !self.velocity.arguments.budget {
            return Ok(None);
        }
        let planned = self.error_budget(&self.velocity.out);
        clock.stage("error budget");
        match planned {
            Ok(plan) => Ok(Some(plan)),
            Err(error) if error.ends_all() => Err(error),
            Err(error) => {
                outcome.fail(format!("{}the error budget: {error}", self.velocity.said_of));
                Ok(None)
            }
        }
    }

    fn error_budget(&self, out: &Path) -> Result<Plan, Error> {
        let bar = progress::bar(&format!("error budget{}", self.velocity.place), 0);
        let show = progress::shown_on(&bar);
        let begin = Instant::now();
        let now_s = || begin.elapsed().as_secs_f64();
        let n_threads = threads(self.velocity.arguments.jobs);
        let plan = plan(self.setup, n_threads, &progress::monitor(&show), &now_s)?;
        let mut budget = limits_as_json(&plan);
        budget["foreseen"] = foreseen_as_json(&plan);
        write_json(&out.join(outputs::ERROR_BUDGET), &budget)?;
        Ok(plan)
    }

    /// What became of each recording that the experiment states: those that were not needed are left out as well.
    fn states(&self, failed: &[FailedRecording], left_out: &[LeftOutRecording]) -> Vec<RecordingState> {
        let stated = self.velocity.stated;
        let not_needed = self.economy.map_or_else(Vec::new, |economy| accuracy::not_needed(stated, economy));
        recording_states(&stated.trials, failed, &[left_out, &not_needed].concat())
    }

    /// The same where nothing follows from the tracks.
    fn unsolved(&self, tracked: &Tracked) -> Vec<RecordingState> {
        let trials = tracked.recordings.iter().map(|one| &one.trial);
        let left_out = LeftOutRecording::each_of(trials, "the tracks could not be evaluated");
        self.states(&tracked.failed, &left_out)
    }
}
