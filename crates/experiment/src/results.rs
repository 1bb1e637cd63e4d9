//! The whole way of an experiment, from its recordings to what was decided.

use std::num::NonZero;

use crate::error::Error;
use crate::evaluation::decisions::{Decision, decide};
use crate::evaluation::notices::not_compared;
use crate::evaluation::truth::{KnownTruth, known_truth};
use crate::evaluation::{Evaluation, evaluate};
use crate::monitor::Monitor;
use crate::recordings::recording_state::{RecordingState, recording_states};
use crate::sanity::check;
use crate::setup::Setup;
use crate::tracked::Tracked;
use crate::tracking::store::TrackStore;
use crate::tracking::track;

/// What a run found.
pub struct Results {
    /// The tracks.
    pub tracked: Tracked,
    /// What followed from them.
    pub evaluation: Evaluation,
    /// The truth, where `synthesize` filmed the recordings.
    pub truth: Option<KnownTruth>,
    /// What was decided.
    pub decisions: Vec<Decision>,
}

impl Results {
    /// What became of each recording of the experiment, in the order of its trials table.
    pub fn recording_states(&self, setup: &Setup) -> Vec<RecordingState> {
        recording_states(&setup.trials, &self.tracked.failed, &self.evaluation.left_out_recordings())
    }
}

impl Setup {
    /// Checks, tracks, evaluates, compares with the truth where there is one, and decides.
    ///
    /// # Errors
    /// The experiment makes no sense, no recording can be tracked, or what was tracked cannot be evaluated; a single recording that fails is no error and stands in
    /// [`Tracked::failed`].
    pub fn run(
        &self,
        store: &dyn TrackStore,
        n_threads: NonZero<usize>,
        monitor: &Monitor<'_>,
    ) -> Result<Results, Error> {
        let sanity = check(self, n_threads)?;
        self.conclude(track(self, &sanity, store, n_threads, monitor)?, n_threads, monitor)
    }

    /// What follows from tracks.
    ///
    /// # Errors
    /// Nothing was tracked, or it cannot be evaluated.
    pub fn conclude(
        &self,
        tracked: Tracked,
        n_threads: NonZero<usize>,
        monitor: &Monitor<'_>,
    ) -> Result<Results, Error> {
        if tracked.recordings.is_empty() {
            return Err(Error::NothingLeft { what: "recordings", n: self.trials.len() });
        }
        let mut evaluation = evaluate(self, &tracked, n_threads, monitor)?;
        let truth = known_truth(self, &evaluation, n_threads);
        let truth = truth.map_err(|why| evaluation.notices.push(not_compared(&why))).ok().flatten();
        let decisions = decide(self, &tracked, &evaluation);
        Ok(Results { tracked, evaluation, truth, decisions })
    }
}
