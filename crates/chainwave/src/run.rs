//! `chainwave run`: an experiment all the way, from recordings to figures, fitted damping and a report.
//!
//! Tracking takes nearly all the time and goes by recordings: each one's tracks are kept in the folder `.work` of the
//! results until its bytes or the settings change. What follows takes seconds and is computed anew, from the kept tracks,
//! so an interrupted run that goes on gives the same bytes as one that was not. Several machines may each track a share first.

mod accuracy;
mod dataset;
mod ended;
mod explain;
mod figures;
mod markers;
mod named;
mod outputs;
mod provenance;
mod pulses;
mod report;
mod results;
mod stage_times;
mod strikers;
mod summary;
mod velocity;

use std::path::{Path, PathBuf};

use chainwave_experiment::{
    Evaluation, RecordingState, Setup, Share, TrackedShare, check_share, compare_strikers, track_share,
};
use serde_json::{Value, json};

use self::ended::{Done, End, Evaluated};
use self::figures::Figure;
pub(crate) use self::figures::draw_motion;
pub(crate) use self::named::name_failed;
use self::named::name_findings;
pub(crate) use self::outputs::PROVENANCE;
pub(crate) use self::results::{states_as_json, warnings_as_json, write_measurement};
use self::velocity::Velocity;
use crate::cli;
use crate::error::Error;
use crate::kept::KeptFolder;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::output::{expect_apart_from_recordings, make_folder};
use crate::parallel::threads;
use crate::progress;
use crate::terminal;

/// Processes an experiment.
pub(crate) fn run(arguments: &cli::Run) -> Result<Outcome, Error> {
    let mut whole = Setup::read(&arguments.experiment, arguments.recordings.as_deref())?;
    whole.takes_partial = arguments.partial;
    on_demand::expect_recordings_of(&whole)?;
    expect_apart_from_recordings(&arguments.out, whole.trials.iter().map(|trial| whole.path_of(trial)))?;
    make_folder(&arguments.out)?;
    let batch = Batch { setups: whole.by_striker(), whole, arguments };
    match arguments.share {
        Some(share) => batch.track(share),
        None => batch.carry_out(),
    }
}

/// The striker velocities of an experiment. One of which nothing can be had does not end the others.
struct Batch<'a> {
    whole: Setup,
    /// One for each velocity.
    setups: Vec<Setup>,
    arguments: &'a cli::Run,
}

impl Batch<'_> {
    fn is_of_several(&self) -> bool {
        self.setups.len() > 1
    }

    /// The folder of the results of one of several velocities, in that of all.
    fn name_of(setup: &Setup) -> String {
        outputs::velocity_folder(setup.experiment.nominal_drive().value)
    }

    fn folder_of(&self, setup: &Setup) -> PathBuf {
        match self.is_of_several() {
            true => self.arguments.out.join(Self::name_of(setup)),
            false => self.arguments.out.clone(),
        }
    }

    /// What stands before a failure of one of several velocities.
    fn said_of(&self, setup: &Setup) -> String {
        match self.is_of_several() {
            true => format!("striker {} m/s: ", setup.experiment.nominal_drive().value),
            false => String::new(),
        }
    }

    /// Tracks a share of the recordings.
    fn track(&self, share: Share) -> Result<Outcome, Error> {
        let mut outcome = Outcome::default();
        let mut n_failed = 0;
        for setup in &self.setups {
            match self.track_velocity(setup, share, &mut outcome) {
                Err(error) if self.is_of_several() && !error.ends_all() => {
                    outcome.fail(format!("{}{error}", self.said_of(setup)));
                    n_failed += 1;
                }
                tracked => tracked?,
            }
        }
        match n_failed == self.setups.len() {
            true => Err(Error::nothing_left("striker velocities", n_failed)),
            false => Ok(outcome),
        }
    }

    fn track_velocity(&self, setup: &Setup, share: Share, outcome: &mut Outcome) -> Result<(), Error> {
        let n_threads = threads(self.arguments.jobs);
        let store = KeptFolder::in_results(&self.folder_of(setup))?;
        let bar = progress::bar("tracking", 0);
        let show = progress::shown_on(&bar);
        let sanity = check_share(setup, n_threads)?;
        name_findings(&sanity.findings);
        let monitor = progress::monitor(&show);
        let TrackedShare { n_tracked, failed } =
            track_share(setup, &sanity, share, &store, n_threads, &monitor)?;
        name_failed(&failed, outcome);
        summary::print_share(setup, n_tracked);
        Ok(())
    }

    /// Evaluates the velocities one after the other, and compares them.
    fn carry_out(&self) -> Result<Outcome, Error> {
        let out = &self.arguments.out;
        self.remove_other_runs()?;
        let mut outcome = Outcome::default();
        let mut done = Vec::with_capacity(self.setups.len());
        for (index, setup) in self.setups.iter().enumerate() {
            let one = self.velocity(index, setup).carry_out(&mut outcome)?;
            if let (true, End::Nothing(error)) = (self.is_of_several(), &one.end) {
                outcome.fail(format!("{}{error}", self.said_of(setup)));
            }
            done.push(one);
        }
        let states: Vec<RecordingState> = done.iter().flat_map(|one| one.states.clone()).collect();
        results::write_states(out, &states)?;
        if done.iter().all(|one| matches!(one.end, End::Nothing(_))) {
            return Err(self.nothing_left(done));
        }
        terminal::tell("recordings", states_as_json(&states));
        let folders = self.setups.iter().map(|setup| self.folder_of(setup));
        terminal::tell("results", folders.filter_map(|folder| read_results(&folder)).collect());
        summary::print_states(out, &states);
        if self.is_of_several() {
            self.compare(&done, &states, &mut outcome)?;
        }
        Ok(outcome)
    }

    /// Removes what an earlier run of other velocities left in the folder: none of it is this one's.
    fn remove_other_runs(&self) -> Result<(), Error> {
        let out = &self.arguments.out;
        if !self.is_of_several() {
            outputs::remove_other_velocities(out, &[])?;
            return outputs::remove_comparison(out);
        }
        let own: Vec<String> = self.setups.iter().map(Self::name_of).collect();
        outputs::remove_other_velocities(out, &own)?;
        outputs::remove_conclusions(out)?;
        outputs::remove_tracks(out)
    }

    fn velocity<'a>(&'a self, index: usize, setup: &'a Setup) -> Velocity<'a> {
        let place = match self.setups.len() {
            1 => String::new(),
            n => format!(" ({} of {n})", index + 1),
        };
        let (out, said_of) = (self.folder_of(setup), self.said_of(setup));
        Velocity { stated: setup, out, arguments: self.arguments, place, said_of }
    }

    /// Why nothing could be done.
    fn nothing_left(&self, done: Vec<Done>) -> Error {
        match done.into_iter().next() {
            Some(Done { end: End::Nothing(error), .. }) if !self.is_of_several() => error,
            _ => Error::nothing_left("striker velocities", self.setups.len()),
        }
    }

    /// Writes what several velocities have in common: the waves beside each other, and the way to each, also to those that failed.
    fn compare(&self, done: &[Done], states: &[RecordingState], outcome: &mut Outcome) -> Result<(), Error> {
        let out = &self.arguments.out;
        let evaluated = |one| match one {
            &Done { end: End::Evaluated(ref found), .. } => Some(found.as_ref()),
            _ => None,
        };
        let evaluated: Vec<&Evaluated> = done.iter().filter_map(evaluated).collect();
        let figures = match self.draw_waves(&evaluated) {
            Err(error) if !error.ends_all() => {
                outcome.fail(format!("the striker velocities beside each other: {error}"));
                Vec::new()
            }
            drawn => drawn?,
        };
        let velocity = |(setup, one)| report::OneOfSeveral { setup, done: one, folder: Self::name_of(setup) };
        let velocities: Vec<report::OneOfSeveral<'_>> = self.setups.iter().zip(done).map(velocity).collect();
        report::write_comparison(out, &self.whole.experiment.name, &velocities, &figures)?;
        provenance::write(&self.whole, &self.whole.experiment, states, out)
    }

    /// Writes and draws the waves of the velocities that were evaluated.
    fn draw_waves(&self, evaluated: &[&Evaluated]) -> Result<Vec<Figure>, Error> {
        if evaluated.is_empty() {
            return Ok(Vec::new());
        }
        let pairs: Vec<(&Setup, &Evaluation)> =
            evaluated.iter().map(|one| (&one.setup, &one.evaluation)).collect();
        let waves = compare_strikers(&pairs, threads(self.arguments.jobs))?;
        strikers::write(&self.whole.experiment, &self.arguments.out, &waves)
    }
}

/// What a folder of results says, for programs; none where nothing was written.
fn read_results(folder: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(folder.join(outputs::RESULTS)).ok().filter(|_| terminal::is_json())?;
    let results: Value = serde_json::from_str(&text).ok()?;
    Some(json!({ "folder": folder, "results": results }))
}
