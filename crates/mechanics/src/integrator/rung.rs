//! Any of the integrators, run with the machine's vectors.

use pulp::{Simd, WithSimd};

use super::{
    implicit::Implicit,
    method::Method,
    runge_kutta::{self, RungeKutta},
    step::{Integrator, LocalError, TimeStep},
    symplectic::{self, Symplectic},
    tableau,
};
use crate::equations::{model::ChainModel, state::ChainState};

/// Every rung.
#[derive(Debug)]
pub(crate) enum Rung {
    RungeKutta(RungeKutta),
    Symplectic(Symplectic),
    Implicit(Box<Implicit>),
}

impl Rung {
    pub(crate) fn new(method: Method, model: &ChainModel<'_>) -> Self {
        match method {
            Method::Rk4 => Self::RungeKutta(RungeKutta::new(&tableau::RK4, model)),
            Method::Dop853 => Self::RungeKutta(RungeKutta::new(&tableau::DOP853, model)),
            Method::Esdirk4 => Self::Implicit(Box::new(Implicit::new(model))),
            Method::SymplecticEuler => Self::Symplectic(Symplectic::new(&symplectic::EULER, model)),
            Method::Verlet => Self::Symplectic(Symplectic::new(&symplectic::VERLET, model)),
            Method::Symplectic4 => Self::Symplectic(Symplectic::new(&symplectic::FOURTH, model)),
            Method::Symplectic6 => Self::Symplectic(Symplectic::new(&symplectic::SIXTH, model)),
        }
    }

    /// [`Integrator::begin`] with the machine's best vectors.
    pub(crate) fn begin(&mut self, model: &ChainModel<'_>, from: &ChainState, continued: bool) {
        chainwave_vectors::dispatch(Begin { rung: self, model, from, continued });
    }

    /// [`Integrator::advance`] with the machine's best vectors.
    pub(crate) fn advance(
        &mut self,
        model: &ChainModel<'_>,
        from: &ChainState,
        step: TimeStep,
        to: &mut ChainState,
    ) {
        to.touching = from.touching;
        to.active = from.active;
        chainwave_vectors::dispatch(Advance { rung: self, model, from, step, to });
    }

    pub(crate) fn local_error(&self) -> Option<LocalError> {
        match self {
            Self::RungeKutta(rung) => rung.local_error(),
            Self::Symplectic(rung) => rung.local_error(),
            Self::Implicit(rung) => rung.local_error(),
        }
    }

    pub(crate) fn evaluations(&self) -> u64 {
        match self {
            Self::RungeKutta(rung) => rung.evaluations(),
            Self::Symplectic(rung) => rung.evaluations(),
            Self::Implicit(rung) => rung.evaluations(),
        }
    }

    /// The state a fraction of the way through the last step; only for a method that interpolates.
    pub(crate) fn interpolate(
        &mut self,
        model: &ChainModel<'_>,
        ends: [&ChainState; 2],
        step: TimeStep,
        fraction: f64,
        at: &mut ChainState,
    ) {
        if let Self::RungeKutta(rung) = self {
            chainwave_vectors::dispatch(runge_kutta::Interpolate { rung, model, ends, step, fraction, at });
        }
    }
}

struct Begin<'a> {
    rung: &'a mut Rung,
    model: &'a ChainModel<'a>,
    from: &'a ChainState,
    continued: bool,
}

impl WithSimd for Begin<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rung, model, from, continued } = self;
        match rung {
            Rung::RungeKutta(rung) => rung.begin(simd, model, from, continued),
            Rung::Symplectic(rung) => rung.begin(simd, model, from, continued),
            Rung::Implicit(rung) => rung.begin(simd, model, from, continued),
        }
    }
}

struct Advance<'a> {
    rung: &'a mut Rung,
    model: &'a ChainModel<'a>,
    from: &'a ChainState,
    step: TimeStep,
    to: &'a mut ChainState,
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rung, model, from, step, to } = self;
        match rung {
            Rung::RungeKutta(rung) => rung.advance(simd, model, from, step, to),
            Rung::Symplectic(rung) => rung.advance(simd, model, from, step, to),
            Rung::Implicit(rung) => rung.advance(simd, model, from, step, to),
        }
    }
}
