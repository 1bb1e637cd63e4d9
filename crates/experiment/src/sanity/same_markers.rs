//! Whether two recordings show the same bodies where their rows place them.

use crate::configuration::Trial;
use crate::marker_pair::{AtRest, MarkerPair};
use crate::setup::Setup;

/// Whether one of the bodies with texture that two recordings should share at rest looks the same in both; `None` where they should share none, or
/// one cannot be read.
pub(super) fn same_markers(setup: &Setup, one: &Trial, other: &Trial) -> Option<bool> {
    let (one, other) = (AtRest::of(setup, one).ok()?, AtRest::of(setup, other).ok()?);
    let mut pairs = one.shared_with(&other).filter(MarkerPair::has_texture).peekable();
    pairs.peek()?;
    Some(pairs.any(|pair| pair.is_same(setup.method())))
}
