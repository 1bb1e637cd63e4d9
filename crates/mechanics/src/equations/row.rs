//! The chain's masses in a row: the striker in front where there is one, the bodies, and the far striker where there is one.

use super::parameters::{Chain, Drive, FarEnd, FarStriker, Striker};
use crate::contact::contacts::{Contact, Contacts};

/// An end of the row at which a striker may stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RowEnd {
    /// In front of body 1.
    Near,
    /// Behind the last body.
    Far,
}

impl RowEnd {
    pub(crate) const BOTH: [Self; 2] = [Self::Near, Self::Far];

    /// The end's place in a pair.
    pub(crate) fn index(self) -> usize {
        match self {
            Self::Near => 0,
            Self::Far => 1,
        }
    }
}

/// Which mass of the row is what, and what lies between them. Gap `i` of the row lies behind mass `i`; the last one leads to the
/// wall, or to nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MassRow<'a> {
    chain: &'a Chain,
    striker: Option<&'a Striker>,
    far_striker: Option<&'a FarStriker>,
}

impl<'a> MassRow<'a> {
    pub(crate) fn of(chain: &'a Chain) -> Self {
        let striker = match &chain.drive {
            Drive::Striker(striker) => Some(striker),
            Drive::Imposed(_) | Drive::Free { .. } => None,
        };
        Self { chain, striker, far_striker: chain.far_striker() }
    }

    /// Bodies and strikers.
    pub(crate) fn n_masses(&self) -> usize {
        self.chain.n_bodies() + usize::from(self.striker.is_some()) + usize::from(self.far_striker.is_some())
    }

    /// Where body 1 stands in the row, which is also where gap 1 of the chain lies.
    pub(crate) fn first_body(&self) -> usize {
        usize::from(self.striker.is_some())
    }

    /// Gaps of the row that lead somewhere.
    pub(crate) fn n_links(&self) -> usize {
        self.n_masses() - usize::from(!self.has_wall())
    }

    pub(crate) fn has_wall(&self) -> bool {
        matches!(self.chain.far_end, FarEnd::Fixed)
    }

    /// The gap between an end's striker and the body it strikes, where there is a striker.
    pub(crate) fn struck_gap(&self, end: RowEnd) -> Option<usize> {
        match end {
            RowEnd::Near => self.striker.map(|_| 0),
            RowEnd::Far => self.far_striker.map(|_| self.n_masses() - 2),
        }
    }

    /// The striker of an end: its mass, speed and dashpot.
    pub(crate) fn striker(&self, end: RowEnd) -> Option<&'a Striker> {
        match end {
            RowEnd::Near => self.striker,
            RowEnd::Far => self.far_striker.map(|far| &far.striker),
        }
    }

    /// What lies behind a mass of the row.
    pub(crate) fn contact(&self, gap: usize) -> &'a Contact {
        let contacts = &self.chain.contact;
        if self.struck_gap(RowEnd::Far) == Some(gap) {
            let own = self.far_striker.and_then(|far| far.contact.as_ref());
            return own.unwrap_or_else(|| contacts.of_gap(gap - self.first_body()));
        }
        match gap.checked_sub(self.first_body()) {
            Some(gap) => contacts.of_gap(gap),
            None => contacts.of_striker(),
        }
    }

    /// The contact of every gap, where they are the same.
    pub(crate) fn same_contact(&self) -> Option<&'a Contact> {
        let has_own = self.far_striker.is_some_and(|far| far.contact.is_some());
        match &self.chain.contact {
            Contacts::Same(contact) if !has_own => Some(contact),
            _ => None,
        }
    }

    /// Masses in kilograms; zero where the motion is imposed, so that the mass neither accelerates nor counts as energy.
    pub(crate) fn masses_kg(&self) -> Vec<f64> {
        self.with_strikers(&self.chain.mass_kg, |striker| striker.mass_kg)
    }

    /// Dashpots to ground in kilograms per second.
    pub(crate) fn ground_kg_per_s(&self) -> Vec<f64> {
        self.with_strikers(&self.chain.damping_kg_per_s, |striker| striker.ground_damping_kg_per_s)
    }

    /// Springs to ground in newtons per metre, where there are any.
    pub(crate) fn ground_n_per_m(&self) -> Option<Vec<f64>> {
        let of_bodies = &self.chain.ground_stiffness_n_per_m;
        let holds = of_bodies.iter().any(|k_n_per_m| *k_n_per_m > 0.0);
        holds.then(|| self.with_strikers(of_bodies, |_| 0.0))
    }

    fn with_strikers(&self, bodies: &[f64], of_striker: impl Fn(&Striker) -> f64) -> Vec<f64> {
        let mut row: Vec<f64> = self.striker.into_iter().map(&of_striker).collect();
        row.extend(bodies);
        row.extend(self.far_striker.map(|far| of_striker(&far.striker)));
        if let Drive::Imposed(_) = self.chain.drive {
            row[0] = 0.0;
        }
        row
    }
}
