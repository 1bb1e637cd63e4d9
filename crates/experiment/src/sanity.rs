//! Whether an experiment makes sense: what its numbers, its pictures at rest and its tracks contradict, in the user's terms.
//!
//! Before work, [`check`] looks at the numbers and at one recording of each view at rest. What cannot be meant is an error; a view whose
//! pictures show other bodies than its stage says is left out; everything else is a [`Finding`]. What only tracks can tell follows from
//! them: motion during the stated rest, and a stage or a scale that the pictures contradict.

mod bodies;
mod duplicates;
mod light;
mod other_view;
mod pitch;
mod repetition;
mod rest;
mod resting;
mod same_markers;
mod shutter;
mod speed;
mod stage;
mod stated;
mod unlisted;
mod view_at_rest;
mod zoom;

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

pub(crate) use self::light::{MOVING_LIGHT, moving_light};
pub use self::rest::{LeftRest, first_to_leave_rest};
pub(crate) use self::rest::{MOTION_AT_REST, left_rest};
use self::resting::resting_views;
pub(crate) use self::shutter::rolling_shutter;
pub(crate) use self::speed::speed;
use self::view_at_rest::{Facts, ViewAtRest, views_at_rest};
use crate::error::Error;
use crate::finding::{Finding, Sanity};
use crate::setup::Setup;
use crate::tracked::Tracked;

/// Looks at an experiment before it is tracked: its numbers, and the pictures of each view at rest. Recordings that cannot be read are
/// passed over: tracking names them.
///
/// # Errors
/// [`Error::Configuration`] where nothing is left to track: neighbours inside each other's subsets, no body in any view, no texture under
/// any subset.
pub fn check(setup: &Setup, n_threads: NonZero<usize>) -> Result<Sanity, Error> {
    let mut sanity = Sanity::default();
    sanity.findings.extend(unlisted::recordings(setup));
    let resting = resting_views(setup, n_threads);
    other_view::mislabelled(setup, &resting, n_threads, &mut sanity);
    duplicates::twice(setup, &mut sanity);
    zoom::magnified_trials(setup, &resting, n_threads, &mut sanity);
    drop(resting);
    check_views(setup, n_threads, sanity)
}

/// Looks at what a share of an experiment needs before it is tracked: numbers and views. All recordings are compared with each other by the run that evaluates
/// them, as each share would do that for all.
///
/// # Errors
/// As [`check`].
pub fn check_share(setup: &Setup, n_threads: NonZero<usize>) -> Result<Sanity, Error> {
    check_views(setup, n_threads, Sanity::default())
}

fn check_views(setup: &Setup, n_threads: NonZero<usize>, mut sanity: Sanity) -> Result<Sanity, Error> {
    let views = views_at_rest(setup, &sanity);
    if views.is_empty() {
        return Ok(sanity);
    }
    sanity.findings.extend(stated::frame_rate(setup, &views));
    stated::rest(setup, &views)?;
    sanity.findings.extend(stated::scale(setup, &views)?);
    sanity.findings.extend(stated::masses(setup, &views)?);
    sanity.findings.extend(stated::velocity(setup, &views));
    sanity.findings.extend(stated::profile_times(setup, &views));
    stage::empty_views(setup, &views, &mut sanity)?;
    stage::other_bodies(setup, &views, &mut sanity)?;
    let is_used = |view: &&ViewAtRest| sanity.reason(&view.trial.recording).is_none();
    let used: Vec<&ViewAtRest> = views.iter().filter(is_used).collect();
    let facts = map_in_parallel(used.len(), n_threads, |index| Facts::of(setup, used[index]));
    let facts: Vec<Facts> = facts.into_iter().flatten().collect();
    sanity.findings.extend(bodies::off_texture(setup, &facts)?);
    sanity.findings.extend(bodies::beyond_the_ends(setup, &facts));
    sanity.findings.extend(pitch::contradicted(setup, &facts));
    let at_rest = map_in_parallel(used.len(), n_threads, |index| rest::motion_in_view(setup, used[index]));
    sanity.findings.extend(at_rest.into_iter().flatten());
    Ok(sanity)
}

/// What the tracks contradict.
pub(crate) fn of_tracks(setup: &Setup, tracked: &Tracked) -> Vec<Finding> {
    let at_rest = rest::motion(setup, tracked).into_iter();
    let of_stage = stage::contradicted(setup, &tracked.stages);
    at_rest.chain(of_stage).collect()
}
