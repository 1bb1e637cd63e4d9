//! Bounds of the chain's oscillation and decay (Gershgorin), and the stable step that follows from them.

use super::{
    ledger::Ledger,
    parameters::{Chain, Drive, FarEnd},
};
use crate::{
    contact::contacts::{Contact, Contacts},
    error::MechanicsError,
    integrator::method::Method,
};

/// How fast a chain can oscillate and decay, which bounds the time step.
#[derive(Debug, Clone)]
pub(crate) struct Pace<'a> {
    chain: &'a Chain,
    /// The row's inverse masses, the striker's first where there is one; zero where the motion is imposed.
    inverse_mass_per_kg: Vec<f64>,
    /// Upper bound of the decay rate.
    pub(crate) decay_per_s: f64,
    shift: usize,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let mut inverse: Vec<f64> = chain.mass_kg.iter().map(|m| m.recip()).collect();
        let mut ground = chain.damping_kg_per_s.clone();
        let mut shift = 0;
        let mut of_striker = 0.0;
        match &chain.drive {
            Drive::Striker(striker) => {
                inverse.insert(0, striker.mass_kg.recip());
                ground.insert(0, 0.0);
                of_striker = striker.damping_kg_per_s;
                shift = 1;
            }
            Drive::Imposed(_) => inverse[0] = 0.0,
            Drive::Free { .. } => {}
        }
        let mut pace = Self { chain, inverse_mass_per_kg: inverse, decay_per_s: 0.0, shift };
        let dashpot = |gap: usize| match gap {
            0 if shift == 1 => of_striker,
            _ => pace.contact(gap).damping_kg_per_s,
        };
        pace.decay_per_s = pace.largest_row(dashpot, |mass| ground[mass]);
        pace
    }

    /// The contact behind a mass of the row.
    fn contact(&self, gap: usize) -> &Contact {
        self.chain.contact.behind(gap, self.shift)
    }

    /// Gershgorin's bound of the eigenvalues of M^-1 times a matrix of couplings behind the masses and to ground.
    fn largest_row(&self, coupling: impl Fn(usize) -> f64, ground: impl Fn(usize) -> f64) -> f64 {
        let n = self.inverse_mass_per_kg.len();
        let n_gaps = if self.chain.far_end == FarEnd::Fixed { n } else { n - 1 };
        let mut before = 0.0;
        let mut largest = 0.0_f64;
        for (mass, inverse_mass) in self.inverse_mass_per_kg.iter().enumerate() {
            let behind = if mass < n_gaps { coupling(mass) } else { 0.0 };
            largest = largest.max(inverse_mass * (2.0 * (before + behind) + ground(mass)));
            before = behind;
        }
        largest
    }

    /// Fastest oscillation with all gaps at rest, in radians per second.
    pub(crate) fn omega_at_rest(&self) -> f64 {
        let k_0_n_per_m = self.chain.contact.k_0_n_per_m();
        let stiffness = |gap: usize| match &self.chain.contact {
            Contacts::Same(_) => k_0_n_per_m,
            Contacts::Each(_) | Contacts::Struck { .. } => self.contact(gap).stiffness_n_per_m(0.0),
        };
        self.largest_row(stiffness, |_| 0.0).sqrt()
    }

    /// Fastest oscillation with every gap as stiff as it ever was.
    pub(crate) fn omega_reached(&self, ledger: &Ledger) -> f64 {
        let stiffest = |gap: usize| {
            let [least_m, most_m] = ledger.range_m(gap);
            // A striker that has left does not count.
            let least_m = if gap < self.shift { least_m.max(0.0) } else { least_m };
            self.contact(gap).stiffest_n_per_m(least_m, most_m)
        };
        self.largest_row(stiffest, |_| 0.0).sqrt()
    }

    /// Refuses a step beyond the method's stability bound at this frequency.
    pub(crate) fn check_stable(
        &self,
        method: Method,
        dt_s: f64,
        omega_rad_per_s: f64,
    ) -> Result<(), MechanicsError> {
        let limit_s = self.stable_s(method, omega_rad_per_s);
        if dt_s <= limit_s {
            return Ok(());
        }
        Err(MechanicsError::StepTooLarge { method: method.name(), dt_s, limit_s, omega_rad_per_s })
    }

    /// The largest stable step at this frequency; infinite for a single free body.
    pub(crate) fn stable_s(&self, method: Method, omega_rad_per_s: f64) -> f64 {
        let decay_s = method.stable_decay() / self.decay_per_s;
        let oscillation = method.stable_oscillation();
        // Where decay and oscillation are integrated together, the smaller bound holds for both.
        let both = if self.decay_per_s > 0.0 { oscillation.min(method.stable_decay()) } else { oscillation };
        let oscillation = if method.is_symplectic() { oscillation } else { both };
        (oscillation / omega_rad_per_s).min(if decay_s.is_nan() { f64::INFINITY } else { decay_s })
    }
}
