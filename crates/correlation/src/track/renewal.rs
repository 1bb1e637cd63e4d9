//! When a subset has changed so much that it must be prepared anew.
//!
//! Every frame is compared with the reference itself, so errors do not add up. A new reference is taken only where the
//! match decays: each new one adds the uncertainty of its own place, for good (the drift by which trackers walk off that
//! compare each frame with the one before).

use chainwave_measurement::{Estimate, Position};

use crate::icgn::outcome::Match;

/// Frames in a row in which the match must have decayed.
const PATIENCE: u32 = 3;

/// How a subset's matches fare since it was prepared.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Decay {
    /// Correlation of the first match in another frame.
    first_zncc: Option<f64>,
    /// Decayed matches in a row.
    n_decayed: u32,
    /// Uncertainty of the place where the subset was prepared, along x and y.
    origin_px: [f64; 2],
    /// How it was turned there.
    origin_rad: Option<Estimate>,
}

impl Decay {
    /// Whether a subset is to be prepared anew where this match of all of it, in another frame than its own, was made.
    pub(crate) fn calls_for_renewal(&mut self, found: &Match, share: f64) -> bool {
        let zncc = found.position.zncc;
        let first = *self.first_zncc.get_or_insert(zncc);
        self.n_decayed = if zncc < share * first { self.n_decayed + 1 } else { 0 };
        self.n_decayed >= PATIENCE
    }

    /// The state of a subset that is prepared at a position of a track, which [`Decay::total`] is part of.
    pub(crate) fn renewed_at(position: &Position) -> Self {
        let origin_px = [position.x_px.sigma, position.y_px.sigma];
        Self { origin_px, origin_rad: position.theta_rad, ..Self::default() }
    }

    /// A position with the uncertainty of where its subset was prepared, and turned since the first reference.
    pub(crate) fn total(&self, position: Position) -> Position {
        let mut total = position;
        total.x_px.sigma = total.x_px.sigma.hypot(self.origin_px[0]);
        total.y_px.sigma = total.y_px.sigma.hypot(self.origin_px[1]);
        if let (Some(origin), Some(theta)) = (self.origin_rad, &mut total.theta_rad) {
            let (sin, cos) = (origin.value + theta.value).sin_cos();
            *theta = Estimate::new(sin.atan2(cos), theta.sigma.hypot(origin.sigma));
        }
        total
    }
}
