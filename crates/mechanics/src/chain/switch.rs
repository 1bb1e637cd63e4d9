//! Event location: the instant at which the striker's contact opens or closes within a step.

use super::{course::Course, model::ChainModel, state::ChainState};
use crate::{
    contact::striker::StrikerContact,
    integrator::{rung::Rung, step::Step},
};

/// Part of the step within which a switch is located.
const PRECISION: f64 = 1e-12;
/// Trials after which the location is as good as it will get.
const MAX_TRIALS: u32 = 100;

/// The part of the step that ends right after the first switch of the striker's contact, or `None` when the contact stays
/// as it is.
///
/// Expects `ahead` at the end of the whole step; leaves it at the end of the part. Within the step the contact is held
/// as it is at the start, so the motion is smooth and the margin crosses zero cleanly. The switch is bracketed by steps
/// of the integrator itself: its time is exact for the computed motion, and the cut costs no order of accuracy.
pub(crate) fn cut_at_switch(
    rung: &mut Rung,
    model: &ChainModel<'_>,
    from: &ChainState,
    step: Step,
    ahead: &mut ChainState,
) -> Option<f64> {
    let contact = model.striker.as_ref()?;
    let mut end_s = first_contradiction(model, contact, from, step.h_s, ahead)?;
    let mut search = Search { rung, model, contact, from, step, ahead };
    if end_s < step.h_s && search.excess_n(end_s) <= 0.0 {
        // The coarse look between the ends was mistaken.
        if search.excess_n(step.h_s) <= 0.0 {
            return None;
        }
        end_s = step.h_s;
    }
    Some(search.locate(end_s))
}

/// Trials of the step with several lengths.
struct Search<'a> {
    rung: &'a mut Rung,
    model: &'a ChainModel<'a>,
    contact: &'a StrikerContact,
    from: &'a ChainState,
    step: Step,
    ahead: &'a mut ChainState,
}

impl Search<'_> {
    /// By how much the contact contradicts its own condition `part_s` after the start, in newtons.
    fn excess_n(&mut self, part_s: f64) -> f64 {
        self.rung.advance(self.model, self.from, Step { h_s: part_s, ..self.step }, self.ahead);
        excess_n(self.contact, self.ahead)
    }

    /// The contradiction's beginning in (0, `end_s`], by the Illinois variant of the rule of false position (M. Dowell, P.
    /// Jarratt, BIT 11 (1971) 168-174), with a halving now and then against slow cases.
    fn locate(&mut self, end_s: f64) -> f64 {
        let (mut start_s, mut start_n) = (0.0, excess_n(self.contact, self.from).min(0.0));
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

/// Positive where the contact, as it is held, contradicts its own condition, in newtons.
fn excess_n(contact: &StrikerContact, state: &ChainState) -> f64 {
    let margin_n = contact.margin_n(state.striker_overlap_m(), state.striker_closing_m_per_s());
    if state.touching { -margin_n } else { margin_n }
}

/// Places within a step at which its course is looked at.
const LOOKS: u32 = 16;

/// The first place found in a step at which the contact must have switched.
///
/// A touch may begin and end within one step, and a parting too. So unless the contact stays far from a switch, the overlap's
/// course between the ends is looked at, in several places and where it came nearest to a switch between them.
fn first_contradiction(
    model: &ChainModel<'_>,
    contact: &StrikerContact,
    from: &ChainState,
    h_s: f64,
    ahead: &ChainState,
) -> Option<f64> {
    let touching = from.touching;
    let ends = [from, ahead].map(|state| (state.striker_overlap_m(), state.striker_closing_m_per_s()));
    if contact.stays(touching, ends, h_s) {
        return None;
    }
    let course = Course::of_gap(model, [from, ahead], h_s, 0);
    let at = |part: f64| (course.overlap_m(part), course.rate_m_per_s(part));
    let switched = |part: f64| {
        let (overlap_m, closing_m_per_s) = at(part);
        contact.must_switch(touching, overlap_m, closing_m_per_s)
    };
    let places = (1..LOOKS).map(|i| f64::from(i) / f64::from(LOOKS));
    if let Some(part) = places.clone().find(|part| switched(*part)) {
        return Some(part * h_s);
    }
    let (overlap_m, closing_m_per_s) = ends[1];
    if contact.must_switch(touching, overlap_m, closing_m_per_s) {
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
