use super::Ring;
use crate::{FarEnd, ImposedMotion, MechanicsError, check};

/// A chain of equal rings, bonded at their poles, that moves in mirror symmetry about its axis.
///
/// Joint n (from 1, the struck pole) is where ring n begins; joint N + 1 is the far pole of the last ring.
#[derive(Debug, Clone, PartialEq)]
pub struct RingChain {
    /// Each ring.
    pub ring: Ring,
    /// Number of rings.
    pub n_rings: usize,
    /// Elements around each ring: an even number, at least 4.
    pub elements_per_ring: usize,
    /// Dashpot to ground of each ring in kilograms per second, spread like its mass.
    pub damping_kg_per_s: f64,
    /// What sets the first joint in motion.
    pub drive: RingDrive,
    /// What stands behind the last joint.
    pub far_end: FarEnd,
}

/// What sets the first joint in motion.
#[derive(Debug, Clone, PartialEq)]
pub enum RingDrive {
    /// A body that strikes the first joint; the chain is at rest until then.
    Striker(RingStriker),
    /// The first joint moves as given, whatever the force.
    Imposed(ImposedMotion),
}

/// A body that touches the first joint at t = 0 and pushes only.
///
/// While the overlap Delta with the joint is not negative, the contact force is max(0, k Delta + c (v_striker - v_1)), else 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingStriker {
    /// Mass in kilograms.
    pub mass_kg: f64,
    /// Velocity towards the chain at t = 0, in metres per second.
    pub velocity_m_per_s: f64,
    /// Stiffness k of its contact, in newtons per metre.
    pub contact_stiffness_n_per_m: f64,
    /// Damping c of its contact, in kilograms per second.
    pub damping_kg_per_s: f64,
}

impl RingChain {
    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        self.ring.check()?;
        check::require(self.n_rings > 0, "number of rings", "at least 1", self.n_rings as f64)?;
        check::not_negative("ring damping_kg_per_s", self.damping_kg_per_s)?;
        match &self.drive {
            RingDrive::Striker(striker) => striker.check(),
            RingDrive::Imposed(_) => Ok(()),
        }
    }
}

impl RingStriker {
    fn check(&self) -> Result<(), MechanicsError> {
        check::positive("striker mass_kg", self.mass_kg)?;
        check::not_negative("striker velocity_m_per_s", self.velocity_m_per_s)?;
        check::positive("striker contact_stiffness_n_per_m", self.contact_stiffness_n_per_m)?;
        check::not_negative("striker damping_kg_per_s", self.damping_kg_per_s)
    }
}
