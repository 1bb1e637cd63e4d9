//! A chain of rings: ring, number, mesh, drive and far end.

use super::section::Ring;
use crate::{
    check,
    equations::{imposed::ImposedMotion, parameters::FarEnd},
    error::MechanicsError,
};

/// Share of its largest displacement at which an imposed motion may begin.
const LARGEST_START: f64 = 0.01;

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
    /// The first joint moves as given, whatever the force, counted from where it is at t = 0: all is at rest there, and what a measured motion
    /// has of noise at its beginning would be a shock. It has to begin within a hundredth of its largest displacement.
    Imposed(ImposedMotion),
    /// No drive: the chain is let go from this state, one entry a joint, from joint 1 to N + 1. Each ring starts in the
    /// equilibrium of its overlap, and its nodes move as this equilibrium does with its joints.
    Free {
        /// Displacement at t = 0 in metres.
        displacement_m: Vec<f64>,
        /// Velocity at t = 0 in metres per second; 0 at a fixed far end.
        velocity_m_per_s: Vec<f64>,
    },
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
        let is_struck = matches!(self.far_end, FarEnd::Struck(_));
        let expected = "0 with rings, whose far end is free or fixed";
        check::require(!is_struck, "strikers at the far end", expected, 1.0)?;
        match &self.drive {
            RingDrive::Striker(striker) => striker.check(),
            RingDrive::Imposed(motion) => {
                let start_m = motion.displacement_m(0.0);
                check::require(
                    start_m.abs() <= LARGEST_START * motion.largest_displacement_m(),
                    "displacement of the imposed motion at t = 0",
                    "about 0, where the rings rest (hint: count it from there, or let go a chain that is held)",
                    start_m,
                )
            }
            RingDrive::Free { displacement_m, velocity_m_per_s } => {
                self.check_state(displacement_m, velocity_m_per_s)
            }
        }
    }

    fn check_state(&self, displacement_m: &[f64], velocity_m_per_s: &[f64]) -> Result<(), MechanicsError> {
        let n_joints = self.n_rings + 1;
        check::length("initial displacement_m", n_joints, displacement_m.len())?;
        check::length("initial velocity_m_per_s", n_joints, velocity_m_per_s.len())?;
        check::each_body("initial displacement_m", displacement_m, check::finite)?;
        check::each_body("initial velocity_m_per_s", velocity_m_per_s, check::finite)?;
        let last = velocity_m_per_s[self.n_rings];
        check::require(
            self.far_end == FarEnd::Free || last == 0.0,
            format!("initial velocity_m_per_s of body {n_joints}, at a fixed far end"),
            "0",
            last,
        )
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
