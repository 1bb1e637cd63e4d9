//! Static equilibria of a rod by Newton's method.

use nalgebra::{DMatrix, DVector};

use super::rod::Rod;
use crate::error::MechanicsError;

/// Newton steps allowed; near a solution the error squares in each.
const MAX_STEPS: usize = 60;

/// Newton steps, relative to the displacements, that count as none.
const CONVERGED: f64 = 1e-11;
/// Newton steps that no longer shrink count as none below this: rounding of a stiff section's forces makes them.
const STALLED: f64 = 1e-6;

/// What holds a rod: unknowns with prescribed values, and loads on the others.
#[derive(Debug, Clone, Default)]
pub struct Support {
    /// Prescribed unknowns and their values, in metres or radians.
    pub prescribed: Vec<(usize, f64)>,
    /// Loaded unknowns and their dead loads, in newtons or newton metres.
    pub loads: Vec<(usize, f64)>,
}

/// A rod in equilibrium.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Displacements and end rotations.
    pub unknowns: DVector<f64>,
    /// Forces and moments by unknown that hold it: reactions where it is prescribed, loads elsewhere.
    pub forces: DVector<f64>,
    /// Strain energy in joules.
    pub energy_j: f64,
    /// Newton steps taken.
    pub steps: usize,
}

impl Rod {
    /// The equilibrium under a support that Newton's method reaches from a configuration nearby.
    ///
    /// # Errors
    /// [`MechanicsError::NoEquilibrium`] when it does not get there: take smaller steps of the load or displacement.
    pub fn equilibrium(&self, from: &DVector<f64>, support: &Support) -> Result<Equilibrium, MechanicsError> {
        let mut unknowns = from.clone();
        let mut loads = DVector::zeros(self.n_unknowns());
        for &(unknown, load) in &support.loads {
            loads[unknown] += load;
        }
        let free = self.free_unknowns(support);
        let mut least = f64::INFINITY;
        for steps in 0..MAX_STEPS {
            let elastic = self.elastic_forces(&unknowns);
            // What is prescribed moves together with the rest, so that no element takes all of it alone.
            let mut step = DVector::zeros(self.n_unknowns());
            for &(unknown, value) in &support.prescribed {
                step[unknown] = value - unknowns[unknown];
            }
            self.add_newton_step(&mut step, &unknowns, &(&elastic.forces - &loads), &free)?;
            // The step, not the residual, is held against rounding: a stiff section has large forces that cancel.
            let size = (0..self.n_unknowns()).map(|k| self.length_m(k, step[k])).fold(0.0, f64::max);
            let extent = (0..self.n_unknowns()).map(|k| self.length_m(k, unknowns[k])).fold(0.0, f64::max);
            if size <= CONVERGED * extent || (steps > 3 && size < STALLED * extent && size >= least) {
                return Ok(Equilibrium {
                    unknowns,
                    forces: elastic.forces,
                    energy_j: elastic.energy_j,
                    steps,
                });
            }
            least = least.min(size);
            // A step is cut where it would move nodes by more than an element's length.
            unknowns += step * (self.arc_m / size).min(1.0);
        }
        Err(MechanicsError::NoEquilibrium { steps: MAX_STEPS })
    }

    /// Rates of the unknowns in equilibria that follow given rates of the prescribed ones.
    pub(crate) fn following(
        &self,
        at: &DVector<f64>,
        rates: &[(usize, f64)],
    ) -> Result<DVector<f64>, MechanicsError> {
        let support = Support { prescribed: rates.to_vec(), loads: Vec::new() };
        let mut step = DVector::zeros(self.n_unknowns());
        for &(unknown, rate) in rates {
            step[unknown] = rate;
        }
        let none = DVector::zeros(self.n_unknowns());
        self.add_newton_step(&mut step, at, &none, &self.free_unknowns(&support))?;
        Ok(step)
    }

    /// Size of a change of an unknown as a length; a rotation acts over an element.
    fn length_m(&self, unknown: usize, change: f64) -> f64 {
        let arm_m = if unknown >= self.rotation(0) { self.arc_m } else { 1.0 };
        (arm_m * change).abs()
    }

    /// The unknowns that a support leaves free.
    fn free_unknowns(&self, support: &Support) -> Vec<usize> {
        let held = |unknown: &usize| support.prescribed.iter().any(|(held, _)| held == unknown);
        (0..self.n_unknowns()).filter(|unknown| !held(unknown)).collect()
    }

    /// Adds the changes of the free unknowns that the tangent stiffness asks for, given those of the others.
    fn add_newton_step(
        &self,
        step: &mut DVector<f64>,
        unknowns: &DVector<f64>,
        residual: &DVector<f64>,
        free: &[usize],
    ) -> Result<(), MechanicsError> {
        let stiffness = self.stiffness(unknowns);
        let right = -(residual + &stiffness * &*step);
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| stiffness[(free[i], free[j])]);
        let right = DVector::from_fn(free.len(), |i, _| right[free[i]]);
        let solution = matrix.lu().solve(&right).filter(|step| step.iter().all(|value| value.is_finite()));
        let solution = solution.ok_or(MechanicsError::NoEquilibrium { steps: 0 })?;
        for (&unknown, value) in free.iter().zip(&solution) {
            step[unknown] = *value;
        }
        Ok(())
    }
}
