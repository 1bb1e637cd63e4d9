use nalgebra::{DMatrix, DVector};

use super::Rod;

/// A rod's small vibrations about its unstressed shape: stiffness and masses by unknown, rotations of its ends last.
#[derive(Debug, Clone)]
pub(crate) struct Vibration {
    pub(crate) stiffness: DMatrix<f64>,
    pub(crate) masses_kg: DVector<f64>,
}

impl Vibration {
    /// The half ring whose ends carry `bonded_kg` each.
    pub(crate) fn new(rod: &Rod, bonded_kg: f64) -> Self {
        let mut masses_kg = rod.masses_kg();
        for unknown in [0, 1, 2 * rod.n_elements(), 2 * rod.n_elements() + 1] {
            masses_kg[unknown] += bonded_kg;
        }
        Self { stiffness: rod.stiffness(&DVector::zeros(rod.n_unknowns())), masses_kg }
    }

    /// The largest angular frequency, in rad/s, when the ends do not rotate and keep to the axis. No chain of such rings
    /// has a larger one.
    pub(crate) fn largest_rad_per_s(&self) -> f64 {
        let last = self.masses_kg.len() - 4;
        let free: Vec<usize> = (0..=last).filter(|&k| k != 1).collect();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            let (i, j) = (free[i], free[j]);
            self.stiffness[(i, j)] / (self.masses_kg[i] * self.masses_kg[j]).sqrt()
        });
        scaled.symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}
