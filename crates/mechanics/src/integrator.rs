mod implicit;
mod kick;
mod method;
mod rows;
mod runge_kutta;
mod symplectic;
mod tableau;

use pulp::{Simd, WithSimd};

pub use method::Method;

use crate::{lanes::vectorised, model::Model, state::State};
use implicit::Implicit;
use runge_kutta::RungeKutta;
use symplectic::Symplectic;

/// A rung of the ladder: it knows rates, forces and steps, and nothing of outputs, switches or energies.
///
/// A step has two halves. `begin` prepares the state that it starts from; `advance` then goes on by any length from there,
/// so that a step can be tried with several lengths.
pub(crate) trait Integrator {
    /// Prepares steps from a state; `continued` says that it is where the last step ended, unchanged.
    fn begin<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, continued: bool);

    /// The state `step.h_s` after `from`, which was given to `begin`, into `to`.
    fn advance<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, step: Step, to: &mut State);

    /// Estimated error of the last step, where the method has one.
    fn local_error(&self) -> Option<LocalError>;

    /// Evaluations of the forces of all gaps so far.
    fn evaluations(&self) -> u64;
}

/// Start and length of a step in seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub(crate) time_s: f64,
    pub(crate) h_s: f64,
}

/// Largest errors of any mass that a step has added, as the method estimates them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalError {
    pub(crate) x_m: f64,
    pub(crate) v_m_per_s: f64,
}

/// Every rung.
#[derive(Debug)]
pub(crate) enum Rung {
    RungeKutta(RungeKutta),
    Symplectic(Symplectic),
    Implicit(Implicit),
}

impl Rung {
    pub(crate) fn new(method: Method, model: &Model<'_>) -> Self {
        match method {
            Method::Rk4 => Self::RungeKutta(RungeKutta::new(&tableau::RK4, model)),
            Method::Dop853 => Self::RungeKutta(RungeKutta::new(&tableau::DOP853, model)),
            Method::Esdirk4 => Self::Implicit(Implicit::new(model)),
            Method::SymplecticEuler => Self::Symplectic(Symplectic::new(&symplectic::EULER, model)),
            Method::Verlet => Self::Symplectic(Symplectic::new(&symplectic::VERLET, model)),
            Method::Symplectic4 => Self::Symplectic(Symplectic::new(&symplectic::FOURTH, model)),
            Method::Symplectic6 => Self::Symplectic(Symplectic::new(&symplectic::SIXTH, model)),
        }
    }

    /// [`Integrator::begin`] with the machine's best vectors.
    pub(crate) fn begin(&mut self, model: &Model<'_>, from: &State, continued: bool) {
        vectorised(Begin { rung: self, model, from, continued });
    }

    /// [`Integrator::advance`] with the machine's best vectors.
    pub(crate) fn advance(&mut self, model: &Model<'_>, from: &State, step: Step, to: &mut State) {
        to.touching = from.touching;
        to.active = from.active;
        vectorised(Advance { rung: self, model, from, step, to });
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
        model: &Model<'_>,
        ends: [&State; 2],
        step: Step,
        fraction: f64,
        at: &mut State,
    ) {
        if let Self::RungeKutta(rung) = self {
            vectorised(runge_kutta::Interpolate { rung, model, ends, step, fraction, at });
        }
    }
}

struct Begin<'a> {
    rung: &'a mut Rung,
    model: &'a Model<'a>,
    from: &'a State,
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
    model: &'a Model<'a>,
    from: &'a State,
    step: Step,
    to: &'a mut State,
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
