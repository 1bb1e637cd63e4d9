//! How a contact law goes on in tension.

/// How a law goes on in tension, where its own range ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tension {
    /// A power law goes on along its tangent below this overlap over delta_0, in (-1, 0); a table along that at its first
    /// point; a spring is linear anyhow.
    Tangent {
        /// Overlap over delta_0 where the tangent takes over.
        limit: f64,
    },
    /// The contact opens and carries nothing: beyond the end of its range (-delta_0 of a power law, 0 of a spring, the first
    /// point of a table) the force stays as it is there.
    Detach,
}

impl Default for Tension {
    /// The tangent from -0.9 delta_0. A chain of 26 bodies struck at 2.73 m/s reaches -0.3 while the wave runs down and -0.5
    /// once it has come back from a free end, so ordinary scenes stay inside the law; and there the tangent is already
    /// stiffer than a ring pulled by that much.
    fn default() -> Self {
        Self::Tangent { limit: -0.9 }
    }
}
