//! Bounds of the chain's oscillation and decay (Gershgorin), and the stable step that follows from them.

use super::ledger::Ledger;
use crate::equations::{
    ground::Ground,
    parameters::Chain,
    row::{MassRow, RowEnd},
};
use crate::{
    contact::{contacts::Contact, tension::Tension},
    error::MechanicsError,
    integrator::method::Method,
};

/// How fast a chain can oscillate and decay, which bounds the time step.
#[derive(Debug, Clone)]
pub(crate) struct Pace<'a> {
    row: MassRow<'a>,
    /// The row's inverse masses; zero where the motion is imposed.
    inverse_mass_per_kg: Vec<f64>,
    /// The largest stiffness of what holds the row's masses to ground.
    ground_n_per_m: Vec<f64>,
    /// Upper bound of the decay rate.
    pub(crate) decay_per_s: f64,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let row = MassRow::of(chain);
        let inverse = |m: f64| if m > 0.0 { m.recip() } else { 0.0 };
        let inverse_mass_per_kg = row.masses_kg().into_iter().map(inverse).collect();
        let ground = Ground::of(chain, &row);
        let held = |mass: usize| ground.as_ref().map_or(0.0, |ground| ground.stiffest_n_per_m(mass));
        let ground_n_per_m = (0..row.n_masses()).map(held).collect();
        let mut pace = Self { row, inverse_mass_per_kg, ground_n_per_m, decay_per_s: 0.0 };
        let ground = row.ground_kg_per_s();
        let dashpot = |gap: usize| {
            let end = RowEnd::BOTH.into_iter().find(|end| row.struck_gap(*end) == Some(gap));
            let striker = end.and_then(|end| row.striker(end));
            striker.map_or_else(|| row.contact(gap).damping_kg_per_s, |striker| striker.damping_kg_per_s)
        };
        pace.decay_per_s = pace.largest_row(dashpot, |mass| ground[mass]);
        pace
    }

    /// Gershgorin's bound of the eigenvalues of M^-1 times a matrix of couplings behind the masses and to ground.
    fn largest_row(&self, coupling: impl Fn(usize) -> f64, ground: impl Fn(usize) -> f64) -> f64 {
        let n_gaps = self.row.n_links();
        let mut before = 0.0;
        let mut largest = 0.0_f64;
        for (mass, inverse_mass) in self.inverse_mass_per_kg.iter().enumerate() {
            let behind = if mass < n_gaps { coupling(mass) } else { 0.0 };
            largest = largest.max(inverse_mass * (2.0 * (before + behind) + ground(mass)));
            before = behind;
        }
        largest
    }

    /// Fastest oscillation with all gaps at rest and every body as stiffly held as its curve holds it anywhere, in radians per second.
    pub(crate) fn omega_at_rest(&self) -> f64 {
        let of_contact = |contact: &Contact| contact.stiffness_n_per_m(0.0);
        let same_n_per_m = self.row.same_contact().map(of_contact);
        let stiffness = |gap: usize| same_n_per_m.unwrap_or_else(|| of_contact(self.row.contact(gap)));
        self.largest_row(stiffness, |mass| self.ground_n_per_m[mass]).sqrt()
    }

    /// Fastest oscillation with every gap as stiff as it ever was.
    pub(crate) fn omega_reached(&self, ledger: &Ledger) -> f64 {
        let stiffest = |gap: usize| {
            let [least_m, most_m] = self.range_m(ledger, gap);
            self.row.contact(gap).stiffest_n_per_m(least_m, most_m)
        };
        self.largest_row(stiffest, |mass| self.ground_n_per_m[mass]).sqrt()
    }

    /// The largest overlap, or distance from rest in tension, that any gap ever had, in metres.
    pub(crate) fn largest_overlap_m(&self, ledger: &Ledger) -> f64 {
        let all = (0..self.row.n_links()).flat_map(|gap| self.range_m(ledger, gap));
        all.fold(0.0, |largest, overlap_m| largest.max(overlap_m.abs()))
    }

    /// The first gap (1 between bodies 1 and 2) whose table of forces was left at an end from where the force falls away, and that end in
    /// metres.
    pub(crate) fn fallen_off(&self, ledger: &Ledger) -> Option<(usize, f64)> {
        (0..self.row.n_links()).find_map(|gap| {
            let [least_m, most_m] = self.range_m(ledger, gap);
            let end_m = self.row.contact(gap).fallen_off_m(least_m, most_m)?;
            Some((gap + 1 - self.row.first_body(), end_m))
        })
    }

    /// Whether a contact between bodies that detaches ever opened.
    pub(crate) fn has_opened(&self, ledger: &Ledger) -> bool {
        let opened = |gap: usize| {
            let contact = self.row.contact(gap);
            contact.tension == Tension::Detach && self.range_m(ledger, gap)[0] < contact.limit_m()
        };
        (0..self.row.n_links()).any(opened)
    }

    /// Smallest and largest overlap of a gap, in metres; a striker that has left does not count.
    fn range_m(&self, ledger: &Ledger, gap: usize) -> [f64; 2] {
        let [least_m, most_m] = ledger.range_m(gap);
        let is_struck = RowEnd::BOTH.into_iter().any(|end| self.row.struck_gap(end) == Some(gap));
        [if is_struck { least_m.max(0.0) } else { least_m }, most_m]
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
