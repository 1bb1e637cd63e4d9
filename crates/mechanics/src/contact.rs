mod linear;
mod power;
mod power_kernel;
mod power_lanes;
mod power_table;
mod table;

pub use linear::LinearLaw;
pub use power::PowerLaw;
pub(crate) use power_kernel::PowerKernel;
pub(crate) use power_lanes::{PowerColumns, PowerLanes};
pub(crate) use power_table::{Outside, PowerTable, TableLanes};
pub use table::TableLaw;

use crate::{MechanicsError, check, lanes::PADDING};

/// What lies in one gap: a law of force over overlap, its rule in tension, and a dashpot.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Force over overlap.
    pub law: Law,
    /// How the law goes on in tension, beyond its own range.
    pub tension: Tension,
    /// Damping between the two neighbours, in kilograms per second: a force of that times the rate of closing.
    pub damping_kg_per_s: f64,
}

/// Force over overlap.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// a (Delta + delta_0)^p - a delta_0^p.
    Power(PowerLaw),
    /// k Delta.
    Linear(LinearLaw),
    /// A monotone curve through points.
    Table(TableLaw),
}

/// How a law goes on in tension, where its own range ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tension {
    /// A power law goes on along its tangent below this overlap over delta_0, in (-1, 0); a table along that at its first
    /// point; a spring is linear anyhow.
    Tangent {
        /// Overlap over delta_0 where the tangent takes over.
        limit: f64,
    },
    /// The contact opens and carries nothing: beyond the end of its range (-delta_0 of a power law, 0 of a spring, the first
    /// point of a table) the force stays as it is there.
    Detach,
}

impl Default for Tension {
    /// The tangent from -0.9 delta_0. A chain of 26 bodies struck at 2.73 m/s reaches -0.3 while the wave runs down and -0.5
    /// once it has come back from a free end, so ordinary scenes stay inside the law; and there the tangent is already
    /// stiffer than a ring pulled by that much.
    fn default() -> Self {
        Self::Tangent { limit: -0.9 }
    }
}

/// The contacts of a chain.
#[derive(Debug, Clone, PartialEq)]
pub enum Contacts {
    /// The same in every gap.
    Same(Contact),
    /// One for each gap between bodies, from body 1 on. The striker meets the first gap's law, a wall the last one's.
    Each(Vec<Contact>),
}

impl From<Law> for Contact {
    /// The law with the usual rule in tension and no dashpot.
    fn from(law: Law) -> Self {
        Self { law, tension: Tension::default(), damping_kg_per_s: 0.0 }
    }
}

impl From<PowerLaw> for Contacts {
    fn from(law: PowerLaw) -> Self {
        Contact::from(Law::Power(law)).into()
    }
}

impl From<LinearLaw> for Contacts {
    fn from(law: LinearLaw) -> Self {
        Contact::from(Law::Linear(law)).into()
    }
}

impl From<Contact> for Contacts {
    fn from(contact: Contact) -> Self {
        Self::Same(contact)
    }
}

impl Contacts {
    /// The contact of a gap, counted from 0 between bodies 1 and 2; a gap before the first or behind the last is like it.
    pub(crate) fn of_gap(&self, gap: usize) -> &Contact {
        match self {
            Self::Same(contact) => contact,
            Self::Each(contacts) => &contacts[gap.min(contacts.len() - 1)],
        }
    }

    /// The contact of the first gap.
    pub fn first(&self) -> &Contact {
        self.of_gap(0)
    }

    /// Changes every power law among the contacts.
    pub fn for_each_power_law(&mut self, mut change: impl FnMut(&mut PowerLaw)) {
        let contacts = match self {
            Self::Same(contact) => std::slice::from_mut(contact),
            Self::Each(contacts) => contacts,
        };
        for contact in contacts {
            if let Law::Power(law) = &mut contact.law {
                change(law);
            }
        }
    }

    /// Tangent stiffness of the first gap at zero overlap, in newtons per metre.
    pub fn k_0_n_per_m(&self) -> f64 {
        self.of_gap(0).stiffness_n_per_m(0.0)
    }

    pub(crate) fn check(&self, n_bodies: usize) -> Result<(), MechanicsError> {
        match self {
            Self::Same(contact) => contact.check("contact"),
            Self::Each(contacts) => {
                check::length("contacts", (n_bodies - 1).max(1), contacts.len())?;
                let mut named = contacts.iter().enumerate();
                named.try_for_each(|(i, contact)| contact.check(&format!("contact of gap {}", i + 1)))
            }
        }
    }
}

impl Contact {
    /// Contact force in newtons and potential energy in joules at an overlap in metres.
    pub fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        self.spring().force_and_energy(overlap_m)
    }

    /// The law and its rule in tension, worked out for many evaluations.
    pub(crate) fn spring(&self) -> Spring {
        match &self.law {
            Law::Power(law) => Spring::Power(PowerKernel::new(law, self.tension)),
            Law::Linear(law) => Spring::Linear { law: *law, least_m: self.limit_m() },
            Law::Table(law) if self.tension == Tension::Detach => {
                Spring::Table { law: law.clone(), least_m: law.first_m() }
            }
            Law::Table(law) => Spring::Table { law: law.clone(), least_m: f64::NEG_INFINITY },
        }
    }

    /// Tangent stiffness dF/dDelta in newtons per metre at an overlap in metres.
    pub fn stiffness_n_per_m(&self, overlap_m: f64) -> f64 {
        match &self.law {
            Law::Power(law) => law.stiffness_under(self.tension, overlap_m),
            Law::Linear(_) if overlap_m < self.limit_m() => 0.0,
            Law::Linear(law) => law.k_n_per_m,
            Law::Table(law) if self.tension == Tension::Detach && overlap_m < law.first_m() => 0.0,
            Law::Table(law) => law.stiffness_n_per_m(overlap_m),
        }
    }

    /// The largest stiffness between two overlaps, in newtons per metre.
    pub(crate) fn stiffest_n_per_m(&self, least_m: f64, most_m: f64) -> f64 {
        match &self.law {
            Law::Table(law) => law.stiffest_n_per_m(least_m, most_m),
            // Monotone up to the tension limit, and constant or zero beyond.
            _ => [least_m.max(self.limit_m().next_up()), most_m]
                .map(|overlap_m| self.stiffness_n_per_m(overlap_m))
                .into_iter()
                .fold(0.0, f64::max),
        }
    }

    /// A length L in metres such that the force is at least k_0 Delta / (1 + Delta / L) in compression; zero where none is
    /// known. For a power law of exponent below 1 the tangent at Delta, which does so, passes above zero at zero overlap.
    pub(crate) fn softening_m(&self) -> f64 {
        match &self.law {
            Law::Power(law) => law.delta_0_m,
            Law::Linear(_) => f64::INFINITY,
            Law::Table(_) => 0.0,
        }
    }

    /// Overlap in metres below which the tension rule holds; minus infinity where there is none.
    pub(crate) fn limit_m(&self) -> f64 {
        match (&self.law, self.tension) {
            (Law::Power(law), tension) => PowerKernel::new(law, tension).limit_m(),
            (Law::Linear(_), Tension::Detach) => 0.0,
            (Law::Linear(_), Tension::Tangent { .. }) => f64::NEG_INFINITY,
            (Law::Table(law), _) => law.first_m(),
        }
    }

    fn check(&self, name: &str) -> Result<(), MechanicsError> {
        check::not_negative(format!("{name}: damping_kg_per_s"), self.damping_kg_per_s)?;
        if let Tension::Tangent { limit } = self.tension {
            let inside = limit > -1.0 && limit < 0.0;
            check::require(inside, format!("{name}: tension limit"), "a number between -1 and 0", limit)?;
        }
        match &self.law {
            Law::Power(law) => law.check(),
            Law::Linear(law) => law.check(),
            Law::Table(_) => Ok(()),
        }
    }
}

/// A law with its rule in tension.
#[derive(Debug, Clone)]
pub(crate) enum Spring {
    Power(PowerKernel),
    /// Below `least_m` the force stays as it is there.
    Linear {
        law: LinearLaw,
        least_m: f64,
    },
    /// Below `least_m` the force stays as it is there.
    Table {
        law: TableLaw,
        least_m: f64,
    },
}

impl Spring {
    /// Force in newtons at an overlap in metres.
    pub(crate) fn force_n(&self, overlap_m: f64) -> f64 {
        match self {
            Self::Power(kernel) => kernel.force_n(overlap_m),
            _ => self.force_and_energy(overlap_m).0,
        }
    }

    /// Forces in newtons at overlaps in metres.
    pub(crate) fn forces_n(&self, overlaps_m: [f64; PADDING]) -> [f64; PADDING] {
        match self {
            Self::Power(kernel) => kernel.forces_n(overlaps_m),
            _ => overlaps_m.map(|overlap_m| self.force_n(overlap_m)),
        }
    }

    /// Stiffness in newtons per metre at an overlap in metres with its force in newtons.
    #[inline(always)]
    pub(crate) fn stiffness_n_per_m(&self, overlap_m: f64, force_n: f64) -> f64 {
        match self {
            Self::Power(kernel) => kernel.stiffness_n_per_m(overlap_m, force_n),
            Self::Linear { least_m, .. } | Self::Table { least_m, .. } if overlap_m < *least_m => 0.0,
            Self::Linear { law, .. } => law.k_n_per_m,
            Self::Table { law, .. } => law.stiffness_n_per_m(overlap_m),
        }
    }

    /// Force in newtons and energy in joules at an overlap in metres.
    pub(crate) fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        match self {
            Self::Power(kernel) => kernel.force_and_energy(overlap_m),
            Self::Linear { law, least_m } => {
                let closed_m = overlap_m.max(*least_m);
                (law.k_n_per_m * closed_m, 0.5 * law.k_n_per_m * closed_m * closed_m)
            }
            Self::Table { law, least_m } => {
                let closed_m = overlap_m.max(*least_m);
                let (force_n, energy_j) = law.evaluate(closed_m);
                (force_n, energy_j + force_n * (overlap_m - closed_m))
            }
        }
    }
}
