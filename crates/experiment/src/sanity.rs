//! Whether an experiment makes sense: what its numbers, its pictures at rest and its tracks contradict, in the user's terms.
//!
//! Before work, [`check`] looks at the numbers and at one recording of each view at rest. What cannot be meant is an error; a view whose
//! pictures show other bodies than its stage says is left out; everything else is a [`Finding`]. What only tracks can tell follows from
//! them: motion during the stated rest, and a stage or a scale that the pictures contradict.

mod bodies;
mod fill_in;
mod pitch;
mod rest;
mod scene;
mod speed;
mod stage;
mod stated;

use std::fmt;
use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

pub(crate) use self::fill_in::expect_filled_in;
use self::scene::{Facts, Scene, scenes};
pub(crate) use self::speed::speed;
pub(crate) use self::stage::StatedStep;
use crate::configuration::Trial;
use crate::error::Error;
use crate::setup::Setup;
use crate::tracking::Tracked;

/// Something that contradicts what the experiment states; the work can go on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Its kind, in a word for programs.
    pub code: &'static str,
    /// What it is about: a key of the configuration, a view, recordings.
    pub subject: String,
    /// What was expected and found, with numbers, and what may be behind it.
    pub text: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.text)
    }
}

/// What was found before work.
#[derive(Debug, Clone, Default)]
pub struct Sanity {
    /// What contradicts the experiment.
    pub findings: Vec<Finding>,
    /// Recordings that are not to be tracked, and why.
    pub left_out: Vec<(String, String)>,
}

impl Sanity {
    /// Why a recording is left out, where it is.
    pub(crate) fn reason(&self, recording: &str) -> Option<&str> {
        self.left_out.iter().find(|(name, _)| name == recording).map(|(_, reason)| reason.as_str())
    }

    /// Leaves out all recordings of a view.
    fn leave_out(&mut self, trials: &[Trial], reason: &str) {
        self.left_out.extend(trials.iter().map(|trial| (trial.recording.clone(), reason.to_owned())));
    }
}

/// Looks at an experiment before it is tracked: its numbers, and the pictures of each view at rest. Recordings that cannot be read are
/// passed over: tracking names them.
///
/// # Errors
/// [`Error::Configuration`] where nothing is left to track: neighbours inside each other's subsets, no body in any view, no texture under
/// any subset.
pub fn check(setup: &Setup, n_threads: NonZero<usize>) -> Result<Sanity, Error> {
    let scenes = scenes(setup);
    let mut sanity = Sanity::default();
    if scenes.is_empty() {
        return Ok(sanity);
    }
    sanity.findings.extend(stated::scale(setup, &scenes)?);
    sanity.findings.extend(stated::masses(setup, &scenes)?);
    stage::empty_views(setup, &scenes, &mut sanity)?;
    stage::other_bodies(setup, &scenes, &mut sanity);
    let is_used = |scene: &&Scene| sanity.reason(&scene.trial.recording).is_none();
    let used: Vec<&Scene> = scenes.iter().filter(is_used).collect();
    let facts = map_in_parallel(used.len(), n_threads, |index| Facts::of(setup, used[index]));
    let facts: Vec<Facts> = facts.into_iter().flatten().collect();
    sanity.findings.extend(bodies::off_texture(setup, &facts)?);
    sanity.findings.extend(bodies::beyond_the_ends(setup, &facts));
    sanity.findings.extend(pitch::contradicted(setup, &facts));
    Ok(sanity)
}

/// What the tracks contradict.
pub(crate) fn of_tracks(setup: &Setup, tracked: &Tracked) -> Vec<Finding> {
    rest::motion(setup, tracked).into_iter().chain(stage::contradicted(setup, &tracked.stages)).collect()
}
