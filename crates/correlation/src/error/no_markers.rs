//! Why no markers are proposed.

use std::fmt;

/// Why no markers are proposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoMarkers {
    /// Nothing in the picture differs from its noise in both directions.
    NoTexture,
    /// Texture everywhere: one surface, no markers.
    Everywhere,
    /// What texture there is has nowhere the size and shape of a marker.
    NoPatch,
}

impl fmt::Display for NoMarkers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::NoTexture => "nothing with a texture (is it lit, and in focus?)",
            Self::Everywhere => "texture all over the picture",
            Self::NoPatch => "texture, but no patch of it that could be a marker",
        })
    }
}
