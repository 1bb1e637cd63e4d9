//! Whether two recordings show the same bodies where their rows place them.

use chainwave_correlation::Method;

use super::resting::Resting;
use crate::geometry::marker_pair::MarkerPair;

/// Whether one of the bodies that two recordings should share at rest looks the same in both; `None` where they should share none that each of them finds
/// again in its own frames, or one cannot be read.
pub(super) fn same_markers(method: Method, one: &Resting, other: &Resting) -> Option<bool> {
    let (one, other) = (one.shown.as_ref()?, other.shown.as_ref()?);
    let mut differ = false;
    for pair in one.shared_with(other).filter(MarkerPair::has_texture) {
        if pair.is_same(method) {
            return Some(true);
        }
        differ |= [one, other].iter().all(|recording| recording.finds_again(pair.body, method));
    }
    differ.then_some(false)
}
