//! Event location: the instant within a step at which a contact between bodies opens or closes.

use super::gap_interpolant::GapInterpolant;
use crate::contact::{spring::Spring, tension::Tension};
use crate::equations::{model::ChainModel, parameters::Chain, row::RowEnd, state::ChainState};
use crate::integrator::step::TimeStep;

/// Contacts that detach between bodies, or between the last one and a wall: their force bends where they open and close, and a step over
/// such a bend errs by more than its estimate, which takes forces to be smooth, can tell.
///
/// None where dashpots end with their contacts: there the force jumps, which estimates do see, and the steps close in on it by themselves.
#[derive(Debug, Default)]
pub(crate) struct Openings {
    contacts: Vec<OpeningContact>,
}

#[derive(Debug)]
struct OpeningContact {
    gap: usize,
    /// Overlap in metres at which it opens.
    limit_m: f64,
    spring: Spring,
    /// Of the masses on its two sides together, per kilogram.
    inverse_mass_per_kg: f64,
}

impl Openings {
    pub(crate) fn of(chain: &Chain, model: &ChainModel<'_>) -> Self {
        if chain.has_dashpots_that_end() {
            return Self::default();
        }
        let struck = |gap: usize| {
            RowEnd::BOTH
                .iter()
                .any(|end| model.strikers[end.index()].as_ref().is_some_and(|of| of.gap == gap))
        };
        let opening = |gap: usize| {
            let contact = model.contact(gap).filter(|contact| contact.tension == Tension::Detach)?;
            Some(OpeningContact {
                gap,
                limit_m: contact.limit_m(),
                spring: contact.spring(),
                inverse_mass_per_kg: model.inverse_mass_per_kg[gap] + model.inverse_mass_per_kg[gap + 1],
            })
        };
        Self { contacts: (0..model.n_masses()).filter(|gap| !struck(*gap)).filter_map(opening).collect() }
    }

    /// The part of a step at which the first of them opens or closes, where a step over that would err by `least_m` or more.
    pub(crate) fn first_within(
        &self,
        model: &ChainModel<'_>,
        ends: [&ChainState; 2],
        step: TimeStep,
        least_m: f64,
    ) -> Option<f64> {
        let active = self.contacts.iter().take_while(|contact| contact.gap < ends[0].active);
        let parts =
            active.filter(|contact| contact.may_pass(ends, step.h_s, least_m)).filter_map(|contact| {
                GapInterpolant::of_gap(model, ends, step, contact.gap).first_passage(contact.limit_m)
            });
        parts.min_by(f64::total_cmp)
    }
}

impl OpeningContact {
    /// Whether it is closed for a part of the step only, as the states and rates at the ends tell, and pushes so much there that missing
    /// the bend of its force would move its bodies by `least_m`.
    fn may_pass(&self, ends: [&ChainState; 2], h_s: f64, least_m: f64) -> bool {
        let closed_m = ends.map(|end| end.gap(self.gap).overlap_m - self.limit_m);
        let rates = ends.map(|end| end.gap(self.gap).closing_m_per_s);
        let turns = rates[0] * rates[1] < 0.0;
        let ahead_m = closed_m[0] + h_s * rates[0];
        let passes =
            (closed_m[0] > 0.0) != (closed_m[1] > 0.0) || (turns && (ahead_m > 0.0) != (closed_m[0] > 0.0));
        if !passes {
            return false;
        }
        let most_m = closed_m[0].max(closed_m[1]).max(if turns { ahead_m } else { 0.0 });
        let push_n = self.spring.force_n(self.limit_m + most_m) - self.spring.force_n(self.limit_m);
        push_n.abs() * self.inverse_mass_per_kg * h_s * h_s > least_m
    }
}
