//! Time step of a chain of rings from its stability bound, and the size of the whole computation.

use super::{
    chain::{RingChain, RingDrive},
    ellipse::HalfEllipse,
    linear::Vibration,
    rod::Rod,
    schedule::RingSchedule,
};
use crate::{check, error::MechanicsError};

/// Automatic step over the largest stable one at rest; rings stiffen somewhat when they are pulled.
const SAFETY: f64 = 0.9;
/// Element-steps beyond which a simulation is refused (about an hour of computing).
const MAX_ELEMENT_STEPS: f64 = 4e12;
/// The rod of a half ring, its masses, and the steps that fit.
pub(crate) struct RingClock {
    pub(crate) rod: Rod,
    pub(crate) half: HalfEllipse,
    /// Mass of the half ring's wall within one bond.
    pub(crate) bonded_kg: f64,
    pub(crate) half_ring_kg: f64,
    pub(crate) decay_per_s: f64,
    pub(crate) stable_dt_s: f64,
    pub(crate) dt_s: f64,
    pub(crate) steps_per_output: u64,
    pub(crate) n_outputs: usize,
}

impl RingClock {
    pub(crate) fn new(chain: &RingChain, schedule: &RingSchedule) -> Result<Self, MechanicsError> {
        let ring = &chain.ring;
        let (rod, half) = Rod::and_half_ring(ring, ring.section(), chain.elements_per_ring)?;
        let bonded_kg = rod.section().mass_kg_per_m * half.bonded_m;
        let half_ring_kg =
            rod.section().mass_kg_per_m * rod.arc_m * rod.n_elements() as f64 + 2.0 * bonded_kg;
        check::positive("duration_s", schedule.duration_s)?;
        check::positive("output_interval_s", schedule.output_interval_s)?;
        let stable_dt_s = 2.0 / fastest_rad_per_s(chain, &rod, bonded_kg);
        if let Some(dt_s) = schedule.dt_s {
            check::positive("dt_s", dt_s)?;
            if dt_s > stable_dt_s {
                return Err(MechanicsError::UnstableStep { dt_s, limit_s: stable_dt_s });
            }
        }
        let aim_s = schedule.dt_s.unwrap_or(SAFETY * stable_dt_s);
        // The last output may lie a rounding beyond the end.
        let n_outputs = (schedule.duration_s / schedule.output_interval_s * (1.0 + 1e-12)).floor() + 1.0;
        let steps_per_output = (schedule.output_interval_s / aim_s * (1.0 - 1e-12)).ceil().max(1.0);
        let steps = n_outputs * steps_per_output;
        check_size(chain, schedule, steps, n_outputs)?;
        if let RingDrive::Imposed(motion) = &chain.drive {
            motion.check_covers((n_outputs - 1.0) * schedule.output_interval_s)?;
        }
        Ok(Self {
            rod,
            half,
            bonded_kg,
            half_ring_kg,
            decay_per_s: 0.5 * chain.damping_kg_per_s / half_ring_kg,
            stable_dt_s,
            dt_s: schedule.output_interval_s / steps_per_output,
            steps_per_output: steps_per_output as u64,
            n_outputs: n_outputs as usize,
        })
    }
}

/// Upper bound of the frequencies of the rings, and of the striker's contact with the first joint.
fn fastest_rad_per_s(chain: &RingChain, rod: &Rod, bonded_kg: f64) -> f64 {
    let ring = Vibration::new(rod, bonded_kg).largest_rad_per_s();
    let RingDrive::Striker(striker) = &chain.drive else { return ring };
    let joint_kg = 0.5 * rod.section().mass_kg_per_m * rod.arc_m + bonded_kg;
    let contact = 0.5 * striker.contact_stiffness_n_per_m * (joint_kg.recip() + 2.0 / striker.mass_kg);
    (ring * ring + contact).sqrt()
}

fn check_size(
    chain: &RingChain,
    schedule: &RingSchedule,
    steps: f64,
    n_outputs: f64,
) -> Result<(), MechanicsError> {
    let (rings, elements) = (chain.n_rings as f64, 0.5 * chain.elements_per_ring as f64);
    let per_ring = if schedule.shapes { 2.0 * elements } else { 4.0 };
    let limits = [
        (
            "elements times steps",
            steps * rings * elements,
            MAX_ELEMENT_STEPS,
            "shorten the simulation, or take fewer rings or elements",
        ),
        (
            "numbers to report",
            n_outputs * (rings + 1.0) * per_ring,
            check::MAX_STORED,
            "report less often, or leave out the shapes",
        ),
    ];
    for (quantity, found, limit, hint) in limits {
        if found > limit || found.is_nan() {
            return Err(MechanicsError::TooLarge { quantity, limit, found, hint });
        }
    }
    Ok(())
}
