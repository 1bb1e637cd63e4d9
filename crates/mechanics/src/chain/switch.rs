//! Event location: the instant at which a striker's contact opens or closes within a step.

use super::gap_interpolant::GapInterpolant;
use crate::equations::{model::ChainModel, row::RowEnd, state::ChainState};
use crate::{
    contact::striker::{GapState, StrikerContact},
    integrator::{rung::Rung, step::TimeStep},
};

/// Part of the step within which a switch is located.
const PRECISION: f64 = 1e-12;
/// Trials after which the location is as good as it will get.
const MAX_TRIALS: u32 = 100;

/// The part of the step that ends right after the first switch of a striker's contact, and whose it is, or `None` when all
/// contacts stay as they are.
///
/// Expects `ahead` at the end of the whole step; leaves it at the end of the part. Within the step the contacts are held
/// as they are at the start, so the motion is smooth and the margin crosses zero cleanly. The switch is bracketed by steps
/// of the integrator itself: its time is exact for the computed motion, and the cut costs no order of accuracy. What the other
/// contact does after the first switch is for the next step.
pub(crate) fn cut_at_switch(
    rung: &mut Rung,
    model: &ChainModel<'_>,
    from: &ChainState,
    step: TimeStep,
    ahead: &mut ChainState,
) -> Option<(f64, RowEnd)> {
    let suspects = RowEnd::BOTH.map(|end| {
        let contact = HeldContact { model, contact: model.strikers[end.index()].as_ref()?, end };
        Some((contact, contact.first_contradiction(from, step, ahead)?))
    });
    let mut found: Option<(f64, RowEnd)> = None;
    for (held, end_s) in suspects.into_iter().flatten() {
        let mut search = SwitchSearch { rung: &mut *rung, held, from, step, ahead: &mut *ahead };
        let part_s = search.first_switch(end_s);
        found = [found, part_s.map(|part_s| (part_s, held.end))]
            .into_iter()
            .flatten()
            .min_by(|one, other| one.0.total_cmp(&other.0));
    }
    if suspects.iter().all(Option::is_some) {
        let part_s = found.map_or(step.h_s, |(part_s, _)| part_s);
        rung.advance(model, from, TimeStep { h_s: part_s, ..step }, ahead);
    }
    found
}

/// A striker's contact in its chain.
#[derive(Debug, Clone, Copy)]
struct HeldContact<'a> {
    model: &'a ChainModel<'a>,
    contact: &'a StrikerContact,
    end: RowEnd,
}

/// Trials of the step with several lengths.
struct SwitchSearch<'a> {
    rung: &'a mut Rung,
    held: HeldContact<'a>,
    from: &'a ChainState,
    step: TimeStep,
    ahead: &'a mut ChainState,
}

impl SwitchSearch<'_> {
    /// The part of the step at which the contact switches, where a look at its course saw it switched after `end_s`.
    fn first_switch(&mut self, mut end_s: f64) -> Option<f64> {
        if end_s < self.step.h_s && self.excess_n(end_s) <= 0.0 {
            // The coarse look between the ends was mistaken.
            if self.excess_n(self.step.h_s) <= 0.0 {
                return None;
            }
            end_s = self.step.h_s;
        }
        Some(self.locate(end_s))
    }

    /// By how much the contact contradicts its own condition `part_s` after the start, in newtons.
    fn excess_n(&mut self, part_s: f64) -> f64 {
        self.rung.advance(self.held.model, self.from, TimeStep { h_s: part_s, ..self.step }, self.ahead);
        self.held.excess_n(self.ahead)
    }

    /// The contradiction's beginning in (0, `end_s`], by the Illinois variant of the rule of false position (M. Dowell, P.
    /// Jarratt, BIT 11 (1971) 168-174), with a halving now and then against slow cases.
    fn locate(&mut self, end_s: f64) -> f64 {
        let (mut start_s, mut start_n) = (0.0, self.held.excess_n(self.from).min(0.0));
        let (mut end_s, mut end_n) = (end_s, self.excess_n(end_s));
        let mut last_was_end = None;
        for trial in 1..MAX_TRIALS {
            if end_s - start_s <= PRECISION * self.step.h_s {
                break;
            }
            let by_chord_s = start_s + (end_s - start_s) * start_n / (start_n - end_n);
            let edge_s = 0.4 * PRECISION * self.step.h_s;
            let at_s = match trial % 4 == 0 || !by_chord_s.is_finite() {
                true => 0.5 * (start_s + end_s),
                false => by_chord_s.clamp(start_s + edge_s, end_s - edge_s),
            };
            let at_n = self.excess_n(at_s);
            let is_end = at_n > 0.0;
            if is_end {
                (end_s, end_n) = (at_s, at_n);
                start_n *= if last_was_end == Some(true) { 0.5 } else { 1.0 };
            } else {
                (start_s, start_n) = (at_s, at_n);
                end_n *= if last_was_end == Some(false) { 0.5 } else { 1.0 };
            }
            last_was_end = Some(is_end);
        }
        self.excess_n(end_s);
        end_s
    }
}

/// Places within a step at which its course is looked at.
const LOOKS: u32 = 16;

impl HeldContact<'_> {
    /// Positive where the contact, as it is held, contradicts its own condition, in newtons.
    fn excess_n(&self, state: &ChainState) -> f64 {
        let gap = self.contact.gap;
        let margin_n = self.contact.margin_n(state.gap(gap));
        if state.touching[self.end.index()] { -margin_n } else { margin_n }
    }

    /// The first place found in a step at which the contact must have switched.
    ///
    /// A touch may begin and end within one step, and a parting too. So unless the contact stays far from a switch, the overlap's
    /// course between the ends is looked at, in several places and where it came nearest to a switch between them.
    fn first_contradiction(&self, from: &ChainState, step: TimeStep, ahead: &ChainState) -> Option<f64> {
        let Self { model, contact, end } = *self;
        let TimeStep { h_s, .. } = step;
        let touching = from.touching[end.index()];
        let ends = [from, ahead].map(|state| state.gap(contact.gap));
        if contact.stays(touching, ends, h_s) {
            return None;
        }
        let course = GapInterpolant::of_gap(model, [from, ahead], step, contact.gap);
        let at = |part: f64| GapState {
            overlap_m: course.overlap_m(part),
            closing_m_per_s: course.rate_m_per_s(part),
        };
        let switched = |part: f64| contact.must_switch(touching, at(part));
        let places = (1..LOOKS).map(|i| f64::from(i) / f64::from(LOOKS));
        if let Some(part) = places.clone().find(|part| switched(*part)) {
            return Some(part * h_s);
        }
        if contact.must_switch(touching, ends[1]) {
            return Some(h_s);
        }
        let distance = |part: f64| contact.distance_n(touching, at(part));
        let nearest = places.map(|part| (part, distance(part))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let space = 1.0 / f64::from(LOOKS);
        let (before, after) = (distance(nearest.0 - space), distance(nearest.0 + space));
        let bend = before - 2.0 * nearest.1 + after;
        let vertex = nearest.0 + 0.5 * space * (before - after) / bend;
        (bend > 0.0 && vertex > 0.0 && vertex < 1.0 && switched(vertex)).then_some(vertex * h_s)
    }
}
