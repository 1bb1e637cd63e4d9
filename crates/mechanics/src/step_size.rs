use crate::{Chain, Drive, FarEnd, MechanicsError, PowerLaw, rk4::Rk4};

/// omega dt that the automatic step aims at, with omega the fastest oscillation of the stiffest gap. A chain of 300 bodies
/// struck at 2.73 m/s then keeps its energy within 1e-9 over 150 ms, and its displacements within 2e-9 of the largest.
const AIM: f64 = 0.02;
/// omega dt up to which a finished run stands although its gaps stiffened beyond the first estimate.
const ACCEPTED: f64 = 0.05;
/// gamma dt that the automatic step aims at, with gamma the fastest decay.
const DECAY_AIM: f64 = 0.1;

/// How fast a chain can oscillate and decay, which bounds the time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Upper bound of omega^2 over the contact stiffness: 2 max over gaps of the two inverse masses' sum (Gershgorin, for
    /// the forces of the gaps). It is the exact 4 / m of a long uniform chain.
    inverse_mass_per_kg: f64,
    /// Upper bound of the decay rate: largest ground damping over mass, plus the striker contact's.
    decay_per_s: f64,
}

impl Pace {
    pub(crate) fn new(chain: &Chain) -> Self {
        let (mass, damping) = (&chain.mass_kg, &chain.damping_kg_per_s);
        let mut inverse: Vec<f64> = mass.iter().map(|m| m.recip()).collect();
        let mut decay_per_s =
            damping.iter().zip(&inverse).map(|(c, inverse)| c * inverse).fold(0.0, f64::max);
        match &chain.drive {
            Drive::Striker(striker) => {
                decay_per_s += striker.damping_kg_per_s * (striker.mass_kg.recip() + inverse[0]);
                inverse.insert(0, striker.mass_kg.recip());
            }
            Drive::Imposed(_) => inverse[0] = 0.0,
            Drive::Free { .. } => {}
        }
        if chain.far_end == FarEnd::Fixed {
            inverse.push(0.0);
        }
        let widest = inverse.windows(2).map(|pair| pair[0] + pair[1]).fold(0.0, f64::max);
        Self { inverse_mass_per_kg: 2.0 * widest, decay_per_s }
    }

    fn omega_rad_per_s(&self, stiffness_n_per_m: f64) -> f64 {
        (self.inverse_mass_per_kg * stiffness_n_per_m).sqrt()
    }

    /// Step that the automatic choice aims at; infinite for a single free body.
    pub(crate) fn automatic_s(&self, stiffness_n_per_m: f64) -> f64 {
        (AIM / self.omega_rad_per_s(stiffness_n_per_m)).min(DECAY_AIM / self.decay_per_s)
    }

    /// Whether an automatic step of `dt_s` stands when the gaps reached this stiffness.
    pub(crate) fn accepts(&self, dt_s: f64, stiffness_n_per_m: f64) -> bool {
        dt_s * self.omega_rad_per_s(stiffness_n_per_m) <= ACCEPTED
    }

    /// Refuses a step beyond the stability bound at this stiffness.
    pub(crate) fn check_stable(&self, dt_s: f64, stiffness_n_per_m: f64) -> Result<(), MechanicsError> {
        let bound = if self.decay_per_s > 0.0 { Rk4::STABLE_DAMPED } else { Rk4::STABLE_UNDAMPED };
        let limit_s = bound / self.omega_rad_per_s(stiffness_n_per_m).max(self.decay_per_s);
        if dt_s <= limit_s {
            return Ok(());
        }
        Err(MechanicsError::StepTooLarge { dt_s, limit_s, stiffness_n_per_m })
    }
}

/// Stiffness at the stiffer end of a range of overlaps; the law's stiffness is monotone.
pub(crate) fn stiffest_n_per_m(law: &PowerLaw, overlap_range_m: [f64; 2]) -> f64 {
    overlap_range_m.map(|overlap_m| law.stiffness_n_per_m(overlap_m)).into_iter().fold(0.0, f64::max)
}
