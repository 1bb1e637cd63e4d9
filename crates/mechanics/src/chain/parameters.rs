//! A chain's parameters: masses, dampers, contacts, drive and far end.

use super::imposed::ImposedMotion;
use crate::{check, contact::contacts::Contacts, error::MechanicsError};

/// A chain of bodies in contact, each a point mass with a dashpot to ground:
/// m x_n'' = F(Delta_{n-1}) - F(Delta_n) - c_d x_n', with the overlap Delta_n = x_n - x_{n+1} of gap n.
///
/// Body n (from 1, the struck one) is entry n - 1 of the lists. Gaps are bonded: they push and pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Mass of each body in kilograms.
    pub mass_kg: Vec<f64>,
    /// Dashpot c_d of each body to ground, in kilograms per second.
    pub damping_kg_per_s: Vec<f64>,
    /// What lies in the gaps; a [`crate::PowerLaw`] turns `into()` it.
    pub contact: Contacts,
    /// What sets the chain in motion.
    pub drive: Drive,
    /// What stands behind the last body.
    pub far_end: FarEnd,
}

/// What sets the chain in motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// A body that strikes body 1; the chain is at rest until then.
    Striker(Striker),
    /// Body 1 moves as given, whatever the force; the others start at rest.
    Imposed(ImposedMotion),
    /// No drive: the chain is let go from this state, one entry a body.
    Free {
        /// Displacement at t = 0 in metres.
        displacement_m: Vec<f64>,
        /// Velocity at t = 0 in metres per second.
        velocity_m_per_s: Vec<f64>,
    },
}

/// A body that touches body 1 at t = 0 and pushes only.
///
/// While the overlap Delta with body 1 is not negative, the contact force is max(0, F(Delta) + c_s (v_striker - v_1)),
/// else 0. It may leave and strike again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Striker {
    /// Mass in kilograms.
    pub mass_kg: f64,
    /// Velocity towards the chain at t = 0, in metres per second.
    pub velocity_m_per_s: f64,
    /// Damping c_s of its contact, in kilograms per second.
    pub damping_kg_per_s: f64,
}

/// What stands behind the last body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FarEnd {
    /// Nothing.
    Free,
    /// A wall that does not move, bonded to the last body by one more gap like the last.
    Fixed,
}

impl Chain {
    /// Number of bodies.
    pub fn n_bodies(&self) -> usize {
        self.mass_kg.len()
    }

    /// Whether a dashpot takes energy from the bodies once the striker has left.
    pub(crate) fn is_damped(&self) -> bool {
        let gaps = 0..self.n_bodies();
        let between = gaps.into_iter().any(|gap| self.contact.of_gap(gap).damping_kg_per_s > 0.0);
        between || self.damping_kg_per_s.iter().any(|&c| c > 0.0)
    }

    /// Refuses a chain whose lists differ in length or whose parameters have no meaning.
    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        let n = self.n_bodies();
        check::require(n > 0, "number of bodies", "at least 1", n as f64)?;
        check::length("damping_kg_per_s", n, self.damping_kg_per_s.len())?;
        check::each_body("mass_kg", &self.mass_kg, check::positive)?;
        check::each_body("damping_kg_per_s", &self.damping_kg_per_s, check::not_negative)?;
        self.contact.check(n)?;
        self.drive.check(n)
    }
}

impl Drive {
    fn check(&self, n_bodies: usize) -> Result<(), MechanicsError> {
        match self {
            Self::Striker(striker) => {
                check::positive("striker mass_kg", striker.mass_kg)?;
                check::not_negative("striker velocity_m_per_s", striker.velocity_m_per_s)?;
                check::not_negative("striker damping_kg_per_s", striker.damping_kg_per_s)
            }
            Self::Imposed(_) => Ok(()),
            Self::Free { displacement_m, velocity_m_per_s } => {
                check::length("initial displacement_m", n_bodies, displacement_m.len())?;
                check::length("initial velocity_m_per_s", n_bodies, velocity_m_per_s.len())?;
                check::each_body("initial displacement_m", displacement_m, check::finite)?;
                check::each_body("initial velocity_m_per_s", velocity_m_per_s, check::finite)
            }
        }
    }
}
