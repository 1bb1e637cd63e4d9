//! What a least-squares problem is to the solver: bounds, values of its unknowns, normal equations around them, and why it has no minimum.

use nalgebra::DVector;

use super::bordered::{N_OWN, NormalEquations, Own};

/// A least-squares problem, as the solver sees it.
pub(crate) trait LeastSquares {
    /// Why it may refuse values.
    type Error;

    /// Between what its unknowns lie.
    fn bounds(&self) -> &Bounds;

    /// Its normal equations around values of the unknowns.
    fn equations(&self, at: &Unknowns) -> Result<NormalEquations, Self::Error>;
}

/// Values of all unknowns, or a step of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unknowns {
    /// Those that all residuals share.
    pub(crate) shared: DVector<f64>,
    /// Those of each recording.
    pub(crate) own: Vec<Own>,
}

/// Lowest and highest values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bounds {
    /// Of each shared unknown.
    pub(crate) shared: Vec<(f64, f64)>,
    /// Of each recording's own, the same for all.
    pub(crate) own: [(f64, f64); N_OWN],
}

/// Why a search found no minimum, or the minimum has no width.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Failure<E> {
    /// The problem refused its values.
    Problem(E),
    /// Shared unknowns that the residuals do not determine; none where it is a recording that does not determine its own.
    Undetermined(Vec<usize>),
    /// Steps did not become short.
    Unsettled {
        /// Rounds gone.
        rounds: usize,
    },
    /// Steps promised nothing that would be worth it ([`Stop::worth`]).
    GivenUp {
        /// Rounds gone.
        rounds: usize,
    },
}

impl Unknowns {
    /// Shared unknowns alone.
    pub(crate) fn dense(shared: DVector<f64>) -> Self {
        Self { shared, own: Vec::new() }
    }

    pub(super) fn moved(&self, step: &Self) -> Self {
        let own = self.own.iter().zip(&step.own).map(|(own, step)| own + step).collect();
        Self { shared: &self.shared + &step.shared, own }
    }

    /// The step from other values to these.
    pub(super) fn less(&self, other: &Self) -> Self {
        let own = self.own.iter().zip(&other.own).map(|(own, other)| own - other).collect();
        Self { shared: &self.shared - &other.shared, own }
    }
}

impl Bounds {
    /// Bounds of shared unknowns alone.
    pub(crate) fn dense(shared: Vec<(f64, f64)>) -> Self {
        Self { shared, own: [(f64::NEG_INFINITY, f64::INFINITY); N_OWN] }
    }

    /// The nearest values between the bounds.
    pub(crate) fn nearest(&self, mut values: Unknowns) -> Unknowns {
        let shared = values.shared.iter_mut().zip(&self.shared);
        shared.for_each(|(value, (lowest, highest))| *value = value.clamp(*lowest, *highest));
        for own in &mut values.own {
            let each = own.iter_mut().zip(&self.own);
            each.for_each(|(value, (lowest, highest))| *value = value.clamp(*lowest, *highest));
        }
        values
    }
}
