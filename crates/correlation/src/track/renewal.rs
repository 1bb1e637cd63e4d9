//! When a subset has changed so much that it must be prepared anew.
//!
//! Every frame is compared with the reference itself, so errors do not add up. A new reference is taken only where the
//! match decays: each new one adds the uncertainty of its own place, for good (the drift by which trackers walk off that
//! compare each frame with the one before).
//!
//! What lies over a part of a subset, or throws its shadow there, makes the match worse as well, and a subset that is prepared from there is
//! the obstacle in part, and follows it. So a subset is prepared anew only where all of it was matched, all its parts ([`Cells`]) have become
//! worse, and little by little.

use chainwave_measurement::{Estimate, Position};

use crate::icgn::outcome::Match;
use crate::track::cells::Cells;

/// Frames in a row in which the match must have decayed.
const PATIENCE: u32 = 3;
/// Share of the loss at which a subset is prepared anew that is no gradual one from a frame to the next.
const SUDDEN: f64 = 0.5;

/// How a subset's matches fare since it was prepared.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Decay {
    /// Correlation of the first match in another frame.
    first_zncc: Option<f64>,
    /// The same of its parts.
    first_cells: Option<Cells>,
    /// Correlation of the last match.
    last_zncc: Option<f64>,
    /// Decayed matches in a row, the first of which came little by little.
    n_decayed: u32,
    /// Whether it is decayed since it fell at once.
    is_sudden: bool,
    /// Uncertainty of the place where the subset was prepared, along x and y.
    origin_px: [f64; 2],
    /// How it was turned there.
    origin_rad: Option<Estimate>,
}

impl Decay {
    /// Whether a subset is to be prepared anew where this match, in another frame than its own, was made; `cells` gives the correlations of its
    /// parts.
    pub(crate) fn calls_for_renewal(
        &mut self,
        found: &Match,
        share: f64,
        cells: impl FnOnce() -> Option<Cells>,
    ) -> bool {
        if !found.is_whole {
            self.n_decayed = 0;
            return false;
        }
        let zncc = found.position.zncc;
        let last = self.last_zncc.replace(zncc);
        let Some(first) = self.first_zncc else {
            self.first_zncc = Some(zncc);
            self.first_cells = cells();
            return false;
        };
        if zncc >= share * first {
            (self.n_decayed, self.is_sudden) = (0, false);
            return false;
        }
        let fell = last.map_or(0.0, |last| last - zncc);
        self.is_sudden |= self.n_decayed == 0 && fell > SUDDEN * (1.0 - share) * first;
        self.n_decayed = if self.is_sudden { 0 } else { self.n_decayed + 1 };
        if self.n_decayed < PATIENCE {
            return false;
        }
        let (Some(before), Some(now)) = (self.first_cells, cells()) else { return false };
        before.have_all_lost(&now, first - zncc)
    }

    /// Whether a match of all of the subset is none that has decayed.
    pub(crate) fn is_fresh(&self, found: &Match, share: f64) -> bool {
        found.is_whole && self.first_zncc.is_none_or(|first| found.position.zncc >= share * first)
    }

    /// Whether the last match had decayed.
    pub(crate) fn is_decayed(&self) -> bool {
        self.n_decayed > 0 || self.is_sudden
    }

    /// The state of a subset that is found again as it was at first.
    pub(crate) fn returned(self, found: &Match) -> Self {
        Self { last_zncc: Some(found.position.zncc), n_decayed: 0, is_sudden: false, ..self }
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
