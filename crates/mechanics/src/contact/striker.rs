//! A striker's one-sided contact: its push, and when it opens and closes.

use super::{contacts::Contact, spring::Spring};

/// The one-sided contact of a striker.
#[derive(Debug)]
pub(crate) struct StrikerContact {
    /// Gap of the row of masses that it lies in.
    pub(crate) gap: usize,
    spring: Spring,
    k_0_n_per_m: f64,
    /// See [`Contact::softening_m`].
    softening_m: f64,
    /// Whether its spring pulls at some overlap above zero.
    may_pull: bool,
    pub(crate) damping_kg_per_s: f64,
}

impl StrikerContact {
    /// In a gap of the row, with a contact's law and the striker's own dashpot.
    pub(crate) fn new(gap: usize, contact: &Contact, damping_kg_per_s: f64) -> Self {
        Self {
            gap,
            spring: contact.spring(),
            k_0_n_per_m: contact.stiffness_n_per_m(0.0),
            softening_m: contact.softening_m(),
            may_pull: contact.pulls_in_compression(),
            damping_kg_per_s,
        }
    }

    /// What its spring holds at an overlap in metres, in joules.
    pub(crate) fn energy_j(&self, overlap_m: f64) -> f64 {
        self.spring.force_and_energy(overlap_m).1
    }

    /// The force of the closed contact at an overlap in metres and a rate of closing in metres per second, in newtons.
    pub(crate) fn push_n(&self, overlap_m: f64, closing_m_per_s: f64) -> f64 {
        self.spring.force_n(overlap_m) + self.damping_kg_per_s * closing_m_per_s
    }

    /// Positive where the contact should be closed and negative where open, in newtons: the smaller of the contact force and a
    /// linear spring's force at the same overlap. It is continuous, so that its roots are the switches; a damped contact
    /// opens when the dashpot would pull, before the overlap ends.
    pub(crate) fn margin_n(&self, overlap_m: f64, closing_m_per_s: f64) -> f64 {
        let spring_n = self.k_0_n_per_m * overlap_m;
        spring_n.min(self.push_n(overlap_m, closing_m_per_s))
    }

    /// A lower bound of the contact force in compression, in newtons, without a power; none of a curve that may pull there.
    fn at_least_n(&self, overlap_m: f64, closing_m_per_s: f64) -> f64 {
        if self.may_pull {
            return f64::NEG_INFINITY;
        }
        let spring_n = self.k_0_n_per_m * overlap_m / (1.0 + overlap_m / self.softening_m);
        spring_n + self.damping_kg_per_s * closing_m_per_s
    }

    /// A force in newtons that falls to zero as a switch comes near, without a power.
    pub(crate) fn distance_n(&self, touching: bool, (overlap_m, closing_m_per_s): (f64, f64)) -> f64 {
        let spring_n = self.k_0_n_per_m * overlap_m;
        if touching { spring_n.min(self.at_least_n(overlap_m, closing_m_per_s)) } else { -spring_n }
    }

    /// Whether the contact is so far from a switch at both ends of a step, given its overlap and closing there, that the rates
    /// at the ends do not lead to one in between.
    pub(crate) fn stays(&self, touching: bool, ends: [(f64, f64); 2], h_s: f64) -> bool {
        let fastest_m_per_s = ends[0].1.abs().max(ends[1].1.abs());
        let change_n = self.damping_kg_per_s * (ends[1].1 - ends[0].1).abs();
        let reach_n = self.k_0_n_per_m * h_s * fastest_m_per_s + if touching { change_n } else { 0.0 };
        ends.iter().all(|end| self.distance_n(touching, *end) > reach_n)
    }

    /// Whether [`StrikerContact::margin_n`] contradicts how the contact is held, without the force where it cannot matter.
    pub(crate) fn must_switch(&self, touching: bool, overlap_m: f64, closing_m_per_s: f64) -> bool {
        let surely_open = overlap_m < 0.0;
        let surely_closed = overlap_m > 0.0 && self.at_least_n(overlap_m, closing_m_per_s) > 0.0;
        match touching {
            true if surely_open => true,
            true if surely_closed => false,
            true => self.margin_n(overlap_m, closing_m_per_s) < 0.0,
            false if surely_open => false,
            false if surely_closed => true,
            false => self.margin_n(overlap_m, closing_m_per_s) > 0.0,
        }
    }
}
