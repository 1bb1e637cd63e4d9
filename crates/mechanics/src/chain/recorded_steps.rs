//! States of all masses, step after step.

use ndarray::{Array2, ArrayView2, ShapeBuilder, s};

use super::record::Record;
use crate::equations::{row::MassRow, state::ChainState};

/// States one behind the other.
#[derive(Debug)]
pub(crate) struct RecordedSteps {
    n_masses: usize,
    x_m: Vec<f64>,
    v_m_per_s: Vec<f64>,
}

impl Record for RecordedSteps {
    fn takes(&self, _: usize) -> bool {
        true
    }

    fn record(&mut self, _: usize, state: &ChainState) {
        self.x_m.extend_from_slice(&state.x_m[..self.n_masses]);
        self.v_m_per_s.extend_from_slice(&state.v_m_per_s[..self.n_masses]);
    }
}

impl RecordedSteps {
    /// None yet of the masses of a row, with room for so many.
    pub(crate) fn new(row: &MassRow<'_>, n_steps: usize) -> Self {
        let n_masses = row.n_masses();
        let room = || Vec::with_capacity(n_masses * n_steps);
        Self { n_masses, x_m: room(), v_m_per_s: room() }
    }

    /// Displacements and velocities of the masses in so many states from one on, those of a state side by side.
    pub(super) fn of(&self, first: usize, n: usize) -> [Array2<f64>; 2] {
        [&self.x_m, &self.v_m_per_s].map(|rows| {
            let shape = (self.n_masses, rows.len() / self.n_masses.max(1)).f();
            let all = ArrayView2::from_shape(shape, rows);
            all.map_or_else(|_| Array2::default((0, 0)), |all| all.slice(s![.., first..first + n]).to_owned())
        })
    }

    /// Forgets the first so many states.
    pub(super) fn forget(&mut self, n: usize) {
        for rows in [&mut self.x_m, &mut self.v_m_per_s] {
            rows.drain(..n * self.n_masses);
        }
    }

    /// How many displacements are held.
    #[cfg(test)]
    pub(super) fn n_held(&self) -> usize {
        self.x_m.len()
    }
}
