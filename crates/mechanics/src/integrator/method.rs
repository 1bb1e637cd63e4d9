//! The integrators by name, with their orders and stability bounds.

use std::{fmt, str::FromStr};

use super::symplectic;
use crate::error::MechanicsError;

/// The rungs of the ladder of integrators, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Symplectic Euler, of order 1.
    SymplecticEuler,
    /// Velocity Verlet, of order 2: one force a step.
    Verlet,
    /// Blanes and Moan's symplectic splitting of order 4: six forces a step.
    Symplectic4,
    /// Blanes and Moan's symplectic splitting of order 6: ten forces a step.
    Symplectic6,
    /// The classical Runge-Kutta method, of order 4.
    Rk4,
    /// Dormand and Prince's method of order 8(5,3): adaptive, with outputs by interpolation.
    Dop853,
    /// Kennedy and Carpenter's `ESDIRK4(3)6L[2]SA` of order 4: implicit and adaptive, for damping of any strength.
    Esdirk4,
}

impl Method {
    /// All rungs, from the lowest order to the highest; the one for stiff damping last.
    pub const LADDER: [Self; 7] = [
        Self::SymplecticEuler,
        Self::Verlet,
        Self::Symplectic4,
        Self::Rk4,
        Self::Symplectic6,
        Self::Dop853,
        Self::Esdirk4,
    ];

    /// Name in scenes and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::SymplecticEuler => "symplectic-euler",
            Self::Verlet => "verlet",
            Self::Symplectic4 => "symplectic4",
            Self::Symplectic6 => "symplectic6",
            Self::Rk4 => "rk4",
            Self::Dop853 => "dop853",
            Self::Esdirk4 => "esdirk4",
        }
    }

    /// Power of the step with which the error falls.
    pub fn order(self) -> u32 {
        match self {
            Self::SymplecticEuler => 1,
            Self::Verlet => 2,
            Self::Symplectic4 | Self::Rk4 | Self::Esdirk4 => 4,
            Self::Symplectic6 => 6,
            Self::Dop853 => 8,
        }
    }

    /// Whether the method chooses its steps by its own estimate of the error.
    pub fn is_adaptive(self) -> bool {
        matches!(self, Self::Dop853 | Self::Esdirk4)
    }

    pub(crate) fn is_symplectic(self) -> bool {
        matches!(self, Self::SymplecticEuler | Self::Verlet | Self::Symplectic4 | Self::Symplectic6)
    }

    /// Whether outputs may lie within a step.
    pub(crate) fn is_dense(self) -> bool {
        self == Self::Dop853
    }

    /// Power of the step with which an adaptive method's estimate of a step's error falls.
    pub(crate) fn error_order(self) -> u32 {
        match self {
            Self::Dop853 => 8,
            _ => self.order(),
        }
    }

    /// omega dt up to which an undamped oscillation does not grow.
    pub(crate) fn stable_oscillation(self) -> f64 {
        match self {
            // 2 sqrt(2).
            Self::Rk4 => 2.828,
            // Where the stability polynomial leaves the unit disc along the imaginary axis.
            Self::Dop853 => 3.9,
            Self::Esdirk4 => f64::INFINITY,
            Self::SymplecticEuler => symplectic::EULER.stable_oscillation,
            Self::Verlet => symplectic::VERLET.stable_oscillation,
            Self::Symplectic4 => symplectic::FOURTH.stable_oscillation,
            Self::Symplectic6 => symplectic::SIXTH.stable_oscillation,
        }
    }

    /// gamma dt up to which a decay does not grow; infinite where dampers are integrated exactly or implicitly.
    pub(crate) fn stable_decay(self) -> f64 {
        match self {
            // The radius of the largest half disc inside the region of stability, for decaying modes that oscillate too.
            Self::Rk4 => 2.61,
            Self::Dop853 => 3.9,
            // Steps back in time let the dampers feed energy in: at most by a factor e.
            Self::Symplectic4 | Self::Symplectic6 => 1.0,
            Self::SymplecticEuler | Self::Verlet | Self::Esdirk4 => f64::INFINITY,
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = MechanicsError;

    fn from_str(name: &str) -> Result<Self, MechanicsError> {
        Self::LADDER.into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let known = Self::LADDER.map(Self::name).join(", ");
            MechanicsError::UnknownMethod { found: name.to_owned(), known }
        })
    }
}
