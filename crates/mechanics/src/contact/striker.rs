//! A striker's one-sided contact: its push, and when it opens and closes.

use super::{contacts::Contact, spring::Spring};

/// What a contact sees of the masses on its two sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GapState {
    pub(crate) overlap_m: f64,
    /// Rate at which the overlap grows.
    pub(crate) closing_m_per_s: f64,
}

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

    /// The force of the closed contact, in newtons.
    pub(crate) fn push_n(&self, at: GapState) -> f64 {
        self.spring.force_n(at.overlap_m) + self.damping_kg_per_s * at.closing_m_per_s
    }

    /// Positive where the contact should be closed and negative where open, in newtons: the smaller of the contact force and a
    /// linear spring's force at the same overlap. It is continuous, so that its roots are the switches; a damped contact
    /// opens when the dashpot would pull, before the overlap ends.
    pub(crate) fn margin_n(&self, at: GapState) -> f64 {
        let spring_n = self.k_0_n_per_m * at.overlap_m;
        spring_n.min(self.push_n(at))
    }

    /// A lower bound of the contact force in compression, in newtons, without a power; none of a curve that may pull there.
    fn at_least_n(&self, at: GapState) -> f64 {
        if self.may_pull {
            return f64::NEG_INFINITY;
        }
        let GapState { overlap_m, closing_m_per_s } = at;
        let spring_n = self.k_0_n_per_m * overlap_m / (1.0 + overlap_m / self.softening_m);
        spring_n + self.damping_kg_per_s * closing_m_per_s
    }

    /// A force in newtons that falls to zero as a switch comes near, without a power.
    pub(crate) fn distance_n(&self, touching: bool, at: GapState) -> f64 {
        let spring_n = self.k_0_n_per_m * at.overlap_m;
        if touching { spring_n.min(self.at_least_n(at)) } else { -spring_n }
    }

    /// Whether the contact is so far from a switch at both ends of a step of `h_s` that the rates there do not lead to one in between.
    pub(crate) fn stays(&self, touching: bool, ends: [GapState; 2], h_s: f64) -> bool {
        let [start_m_per_s, end_m_per_s] = ends.map(|end| end.closing_m_per_s);
        let fastest_m_per_s = start_m_per_s.abs().max(end_m_per_s.abs());
        let change_n = self.damping_kg_per_s * (end_m_per_s - start_m_per_s).abs();
        let reach_n = self.k_0_n_per_m * h_s * fastest_m_per_s + if touching { change_n } else { 0.0 };
        ends.iter().all(|end| self.distance_n(touching, *end) > reach_n)
    }

    /// Whether [`StrikerContact::margin_n`] contradicts how the contact is held, without the force where it cannot matter.
    pub(crate) fn must_switch(&self, touching: bool, at: GapState) -> bool {
        let surely_open = at.overlap_m < 0.0;
        let surely_closed = at.overlap_m > 0.0 && self.at_least_n(at) > 0.0;
        match touching {
            true if surely_open => true,
            true if surely_closed => false,
            true => self.margin_n(at) < 0.0,
            false if surely_open => false,
            false if surely_closed => true,
            false => self.margin_n(at) > 0.0,
        }
    }
}
