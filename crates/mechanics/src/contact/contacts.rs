//! What lies in one gap, and in all gaps of a chain: law, rule in tension, dashpot.

use super::{
    linear::LinearLaw, power::PowerLaw, power_kernel::PowerKernel, spring::Spring, table::TableLaw,
    tension::Tension,
};
use crate::{check, error::MechanicsError};

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
    /// A curve through points.
    Table(TableLaw),
}

/// The contacts of a chain.
#[derive(Debug, Clone, PartialEq)]
pub enum Contacts {
    /// The same in every gap.
    Same(Contact),
    /// One for each gap between bodies, from body 1 on. The striker meets the first gap's law, a wall the last one's.
    Each(Vec<Contact>),
    /// A striker that meets body 1 in a contact of its own, and the contacts in the gaps.
    Struck {
        /// Between striker and body 1; its dashpot is the striker's.
        striker: Contact,
        /// In the gaps between bodies.
        between: Box<Contacts>,
    },
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
    pub fn of_gap(&self, gap: usize) -> &Contact {
        match self {
            Self::Same(contact) => contact,
            Self::Each(contacts) => &contacts[gap.min(contacts.len() - 1)],
            Self::Struck { between, .. } => between.of_gap(gap),
        }
    }

    /// The contact between striker and body 1.
    pub fn of_striker(&self) -> &Contact {
        match self {
            Self::Struck { striker, .. } => striker,
            _ => self.of_gap(0),
        }
    }

    /// Every contact that is not like another, that of the striker included.
    pub(crate) fn all(&self) -> Vec<&Contact> {
        match self {
            Self::Same(contact) => vec![contact],
            Self::Each(contacts) => contacts.iter().collect(),
            Self::Struck { striker, between } => [vec![striker], between.all()].concat(),
        }
    }

    /// The contact of the first gap.
    pub fn first(&self) -> &Contact {
        self.of_gap(0)
    }

    /// Changes every contact, that of the striker included.
    pub fn for_each(&mut self, change: &mut dyn FnMut(&mut Contact)) {
        if let Self::Struck { striker, .. } = self {
            change(striker);
        }
        self.for_each_gap(change);
    }

    /// Changes every power law among the contacts.
    pub fn for_each_power_law(&mut self, mut change: impl FnMut(&mut PowerLaw)) {
        self.for_each(&mut |contact| {
            if let Law::Power(law) = &mut contact.law {
                change(law);
            }
        });
    }

    /// Changes the contact of every gap between bodies.
    pub fn for_each_gap(&mut self, change: &mut dyn FnMut(&mut Contact)) {
        match self {
            Self::Same(contact) => change(contact),
            Self::Each(contacts) => contacts.iter_mut().for_each(change),
            Self::Struck { between, .. } => between.for_each_gap(change),
        }
    }

    /// The same contacts, one for each of so many gaps, so that each can be changed alone; one at least, as a chain holds.
    #[must_use]
    pub fn one_by_one(self, n_gaps: usize) -> Self {
        match self {
            Self::Same(contact) => Self::Each(vec![contact; n_gaps.max(1)]),
            Self::Each(contacts) => Self::Each(contacts),
            Self::Struck { striker, between } => {
                Self::Struck { striker, between: Box::new(between.one_by_one(n_gaps)) }
            }
        }
    }

    /// The same contacts behind a striker that meets body 1 in a contact of its own, so many times as stiff as it was.
    #[must_use]
    pub fn struck_through(self, factor: f64) -> Self {
        let own = self.of_striker().clone();
        let striker = Contact { law: own.law.times(factor), ..own };
        let between = match self {
            Self::Struck { between, .. } => between,
            gaps => Box::new(gaps),
        };
        Self::Struck { striker, between }
    }

    /// Changes the contact of one gap, counted from 0, where each gap has its own ([`Contacts::one_by_one`]).
    pub fn change_gap(&mut self, gap: usize, change: impl FnOnce(&mut Contact)) {
        match self {
            Self::Same(_) => {}
            Self::Each(contacts) => {
                if let Some(contact) = contacts.get_mut(gap) {
                    change(contact);
                }
            }
            Self::Struck { between, .. } => between.change_gap(gap, change),
        }
    }

    /// Tangent stiffness of the first gap at zero overlap, in newtons per metre.
    pub fn k_0_n_per_m(&self) -> f64 {
        self.of_gap(0).stiffness_n_per_m(0.0)
    }

    pub(crate) fn check(&self, n_bodies: usize) -> Result<(), MechanicsError> {
        match self {
            Self::Same(contact) => contact.check("contact"),
            Self::Struck { striker, between } => {
                striker.check("contact of the striker")?;
                between.check(n_bodies)
            }
            Self::Each(contacts) => {
                check::length("contacts", (n_bodies - 1).max(1), contacts.len())?;
                let mut named = contacts.iter().enumerate();
                named.try_for_each(|(i, contact)| contact.check(&format!("contact of gap {}", i + 1)))
            }
        }
    }
}

impl Law {
    /// The law with so many times the force.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        match self {
            Self::Power(law) => Self::Power(PowerLaw { a: factor * law.a, ..*law }),
            Self::Linear(law) => Self::Linear(LinearLaw { k_n_per_m: factor * law.k_n_per_m }),
            Self::Table(law) => Self::Table(law.times(factor)),
        }
    }
}

impl Contact {
    /// Contact force in newtons and potential energy in joules at an overlap in metres.
    pub fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        self.spring().force_and_energy(overlap_m)
    }

    /// Potential energy in joules as a function of the overlap in metres, worked out for many evaluations.
    pub fn energy(&self) -> impl Fn(f64) -> f64 + Send + Sync + 'static {
        let spring = self.spring();
        move |overlap_m| spring.force_and_energy(overlap_m).1
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

    /// Whether the law pulls at some overlap above zero, as a bistable one may.
    pub(crate) fn pulls_in_compression(&self) -> bool {
        matches!(&self.law, Law::Table(law) if law.pulls_in_compression())
    }

    /// The end of a table's points that a gap with overlaps in this range fell off, if it did.
    pub(crate) fn fallen_off_m(&self, least_m: f64, most_m: f64) -> Option<f64> {
        let Law::Table(law) = &self.law else { return None };
        let least_m = if self.tension == Tension::Detach { f64::INFINITY } else { least_m };
        law.fallen_off_m(least_m, most_m)
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

    pub(crate) fn check(&self, name: &str) -> Result<(), MechanicsError> {
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
