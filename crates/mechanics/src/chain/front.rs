//! The wave's front: bodies ahead of it are left out of the integration.

use crate::equations::state::ChainState;
use crate::lanes::{PADDING, padded};

/// Bodies that must rest ahead of the last one that moves: more than a step of any method can reach. Derivatives of the motion fall off
/// ahead of it as the motion does.
pub(crate) const MARGIN: usize = 16;

/// Finds how far the wave has come, so that the bodies ahead of it are left out.
///
/// A body enters while everything within [`MARGIN`] of it still moves by less than a stated fraction of the largest motion.
/// Ahead of the front the motion falls faster than exponentially with distance, by a factor of 1e-20 and more over the
/// margin, so what is neglected, the pull of a body at rest on the last one that moves, lies far below that fraction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Front {
    /// Fraction of the largest displacement and velocity; `None`: all bodies are integrated.
    negligible: Option<f64>,
    n_padded: usize,
}

impl Front {
    pub(crate) fn new(negligible: Option<f64>, n_masses: usize) -> Self {
        Self { negligible, n_padded: padded(n_masses) }
    }

    /// Sets how many masses are integrated at the start: those that move, and the margin.
    pub(crate) fn begin(&self, state: &mut ChainState) {
        state.active = self.n_padded;
        if self.negligible.is_some() {
            let moving = |i: &usize| state.x_m[*i] != 0.0 || state.v_m_per_s[*i] != 0.0;
            let n_moving = (0..self.n_padded).rev().find(moving).map_or(0, |last| last + 1);
            state.active = padded(n_moving + MARGIN).min(self.n_padded);
        }
    }

    /// Takes in more masses where the wave comes near the last of them, given the largest displacement (metres) and velocity
    /// (metres per second) of any mass; returns whether it did.
    pub(crate) fn advance(&self, state: &mut ChainState, x_m: f64, v_m_per_s: f64) -> bool {
        let Some(negligible) = self.negligible else { return false };
        let before = state.active;
        while state.active < self.n_padded && self.comes_near(state, negligible * x_m, negligible * v_m_per_s)
        {
            state.active += PADDING;
        }
        state.active > before
    }

    fn comes_near(&self, state: &ChainState, x_m: f64, v_m_per_s: f64) -> bool {
        let last = state.active.saturating_sub(MARGIN)..state.active;
        let moves = |values: &[f64], limit: f64| values.iter().any(|value| value.abs() > limit);
        moves(&state.x_m[last.clone()], x_m) || moves(&state.v_m_per_s[last], v_m_per_s)
    }
}
