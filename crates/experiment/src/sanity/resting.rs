//! Recordings at rest, each opened once for all that compares them with each other.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use crate::configuration::Trial;
use crate::geometry::marker_pair::AtRest;
use crate::setup::Setup;

/// A recording by its last few frames at rest.
pub(super) struct Resting {
    pub(super) trial: Trial,
    /// `None` where it cannot be read: tracking names it.
    pub(super) shown: Option<AtRest>,
}

impl Resting {
    pub(super) fn of(setup: &Setup, trial: &Trial) -> Self {
        Self { trial: trial.clone(), shown: AtRest::of_few_frames(setup, trial).ok() }
    }
}

/// All recordings, those of one view and place of the stage together.
pub(super) fn resting_views(setup: &Setup, n_threads: NonZero<usize>) -> Vec<Vec<Resting>> {
    let of_views = Trial::by_place(setup.trials.iter());
    let trials: Vec<&Trial> = of_views.iter().flatten().collect();
    let opened = map_in_parallel(trials.len(), n_threads, |index| Resting::of(setup, trials[index]));
    let mut opened = opened.into_iter();
    of_views.iter().map(|of_view| opened.by_ref().take(of_view.len()).collect()).collect()
}
