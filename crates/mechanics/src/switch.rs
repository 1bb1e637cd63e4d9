use crate::{
    integrator::{Rung, Step},
    model::{Model, StrikerContact},
    state::State,
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
    model: &Model<'_>,
    from: &State,
    step: Step,
    ahead: &mut State,
) -> Option<f64> {
    let contact = model.striker.as_ref()?;
    let mut end_s = first_contradiction(contact, from, step.h_s, ahead)?;
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
    model: &'a Model<'a>,
    contact: &'a StrikerContact,
    from: &'a State,
    step: Step,
    ahead: &'a mut State,
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
fn excess_n(contact: &StrikerContact, state: &State) -> f64 {
    let margin_n = contact.margin_n(state.striker_overlap_m(), state.striker_closing_m_per_s());
    if state.touching { -margin_n } else { margin_n }
}

/// The first of the step's middle and end at which the contact must have switched.
///
/// The middle catches a touch that begins and ends within one step. It is judged by the cubic through both ends, which
/// needs no step of its own.
fn first_contradiction(contact: &StrikerContact, from: &State, h_s: f64, ahead: &State) -> Option<f64> {
    let (overlap_0, closing_0) = (from.striker_overlap_m(), from.striker_closing_m_per_s());
    let (overlap_1, closing_1) = (ahead.striker_overlap_m(), ahead.striker_closing_m_per_s());
    let overlap_m = 0.5 * (overlap_0 + overlap_1) + h_s / 8.0 * (closing_0 - closing_1);
    let closing_m_per_s = 1.5 * (overlap_1 - overlap_0) / h_s - 0.25 * (closing_0 + closing_1);
    if contact.must_switch(from.touching, overlap_m, closing_m_per_s) {
        return Some(0.5 * h_s);
    }
    contact.must_switch(from.touching, overlap_1, closing_1).then_some(h_s)
}
