//! What moves the first joint: the striker or an imposed motion.

use super::{
    block::Joints,
    chain::{RingChain, RingDrive},
};
use crate::equations::imposed::ImposedMotion;

/// What moves the first joint, in the kernel's units.
#[derive(Debug)]
pub(crate) struct Driver<'a> {
    kind: DriverKind<'a>,
    keep: f64,
    gain: f64,
    /// Energy that the striker's damper took, less what an imposed motion put in.
    lost: f64,
    /// Times the striker's contact opened or closed.
    pub(crate) switches: u32,
}

#[derive(Debug)]
enum DriverKind<'a> {
    Striker(HalfStriker),
    /// Counted from where the motion is at t = 0.
    Imposed {
        motion: &'a ImposedMotion,
        start_m: f64,
        dt_s: f64,
        length_m: f64,
    },
}

/// Half of the striker: the other half strikes the mirror image.
#[derive(Debug, Clone, Copy)]
struct HalfStriker {
    place: f64,
    velocity: f64,
    inverse_mass: f64,
    stiffness: f64,
    damping: f64,
    touching: bool,
}

/// What a step did to the first joint and the striker.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveStep {
    /// Velocity of the joint after the step.
    pub(crate) velocity: f64,
    /// The same before it; at t = 0 such that their mean is the velocity at that time.
    pub(crate) velocity_before: f64,
    /// Place of the striker, and its velocity before and after.
    pub(crate) striker: Option<[f64; 3]>,
    /// Energy held by the striker: of its motion and of its contact.
    pub(crate) energy: f64,
    /// Momentum of the striker.
    pub(crate) momentum: f64,
    /// Energy that its damper took until the middle of the step, less what an imposed motion put in.
    pub(crate) lost: f64,
}

/// Units of the kernel, and what the dampers leave of a velocity and a force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Units {
    pub(crate) length_m: f64,
    pub(crate) element_kg: f64,
    pub(crate) dt_s: f64,
    pub(crate) keep: f64,
    pub(crate) gain: f64,
}

impl<'a> Driver<'a> {
    /// `None` where nothing drives the chain.
    pub(crate) fn new(chain: &'a RingChain, units: Units) -> Option<Self> {
        let Units { length_m, element_kg, dt_s, keep, gain } = units;
        let kind = match &chain.drive {
            RingDrive::Striker(striker) => DriverKind::Striker(HalfStriker {
                place: 0.0,
                velocity: striker.velocity_m_per_s * dt_s / length_m,
                inverse_mass: 2.0 * element_kg / striker.mass_kg,
                stiffness: 0.5 * striker.contact_stiffness_n_per_m * dt_s * dt_s / element_kg,
                damping: 0.5 * striker.damping_kg_per_s * dt_s / element_kg,
                touching: true,
            }),
            RingDrive::Imposed(motion) => {
                DriverKind::Imposed { motion, start_m: motion.displacement_m(0.0), dt_s, length_m }
            }
            RingDrive::Free { .. } => return None,
        };
        Some(Self { kind, keep, gain, lost: 0.0, switches: 0 })
    }

    /// Moves the drive and the first joint by a step; `force` is the ring's on the joint.
    pub(crate) fn kick(&mut self, step: u64, joints: &mut Joints, force: f64) -> DriveStep {
        let (place, velocity, inverse_mass) =
            (joints.places[0], joints.velocities[0], joints.inverse_masses[0]);
        let mut start_velocity = 0.0;
        let (mut kick, lost) = match &mut self.kind {
            DriverKind::Striker(striker) => {
                let was_touching = striker.touching;
                // The chain is at rest at t = 0, so the first kick is that of half a step.
                let share = if step == 0 { 0.5 } else { 1.0 };
                let (keep, gain) = (self.keep, share * self.gain * inverse_mass);
                let kicked = striker.kick(share, place, velocity, [keep, gain], force * inverse_mass);
                self.switches += u32::from(striker.touching != was_touching);
                kicked
            }
            DriverKind::Imposed { motion, start_m, dt_s, length_m } => {
                let moved_m = motion.displacement_m((step + 1) as f64 * *dt_s) - *start_m;
                let velocity_after = moved_m / *length_m - place;
                start_velocity = motion.velocity_m_per_s(0.0) * *dt_s / *length_m;
                // The ring's force on the joint does work against the drive.
                let lost = force / self.gain * 0.5 * (velocity + velocity_after);
                (
                    DriveStep {
                        velocity: velocity_after,
                        velocity_before: velocity,
                        striker: None,
                        energy: 0.0,
                        momentum: 0.0,
                        lost: 0.0,
                    },
                    lost,
                )
            }
        };
        if step == 0 {
            kick.velocity_before = 2.0 * start_velocity - kick.velocity;
        }
        kick.lost = self.lost + 0.5 * lost;
        self.lost += lost;
        joints.velocities[0] = kick.velocity;
        joints.places[0] = place + kick.velocity;
        kick
    }
}

impl HalfStriker {
    /// Contact force by the rule of the mean velocity, and the motion of both sides.
    fn kick(
        &mut self,
        share: f64,
        place: f64,
        velocity: f64,
        [keep, gain]: [f64; 2],
        pushed: f64,
    ) -> (DriveStep, f64) {
        let overlap = self.place - place;
        self.touching = overlap >= 0.0;
        // Mean closing velocity over the step: `closing` without the contact force, less `give` times the force.
        let closing = self.velocity - 0.5 * (velocity * (1.0 + keep) + pushed);
        let give = 0.5 * (share * self.inverse_mass + gain);
        let spring = self.stiffness * overlap;
        let force = match self.touching {
            true => ((spring + self.damping * closing) / (1.0 + self.damping * give)).max(0.0),
            false => 0.0,
        };
        let before = self.velocity;
        let after = before - share * self.inverse_mass * force;
        let (mean_closing, stored) = match self.touching {
            true => (closing - give * force, 0.5 * spring * overlap),
            false => (0.0, 0.0),
        };
        let lost = if self.touching { share * (force - spring) * mean_closing } else { 0.0 };
        // At t = 0 the velocity is known at that time.
        let before = if share < 1.0 { 2.0 * before - after } else { before };
        let kick = DriveStep {
            velocity: velocity * keep + pushed + gain * force,
            velocity_before: velocity,
            striker: Some([self.place, before, after]),
            energy: 0.5 * before * after / self.inverse_mass + stored,
            momentum: 0.5 * (before + after) / self.inverse_mass,
            lost: 0.0,
        };
        self.velocity = after;
        self.place += after;
        (kick, lost)
    }
}
