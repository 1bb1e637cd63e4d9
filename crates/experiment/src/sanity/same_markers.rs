//! Whether two recordings show the same bodies where their rows place them.

use crate::configuration::Trial;
use crate::marker_pair::{AtRest, MarkerPair};
use crate::setup::Setup;

/// Whether one of the bodies that two recordings should share at rest looks the same in both; `None` where they should share none that each of them finds
/// again in its own frames, or one cannot be read.
pub(super) fn same_markers(setup: &Setup, one: &Trial, other: &Trial) -> Option<bool> {
    let method = setup.method();
    let (one, other) = (AtRest::of_few_frames(setup, one).ok()?, AtRest::of_few_frames(setup, other).ok()?);
    let mut differ = false;
    for pair in one.shared_with(&other).filter(MarkerPair::has_texture) {
        if pair.is_same(method) {
            return Some(true);
        }
        differ |= [&one, &other].iter().all(|recording| recording.finds_again(pair.body, method));
    }
    differ.then_some(false)
}
