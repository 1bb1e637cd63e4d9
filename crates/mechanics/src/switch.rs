use crate::{
    model::{Model, State},
    rk4::Rk4,
};

/// Halvings of the step that locate a switch; they leave an interval of 1e-12 of the step.
const HALVINGS: u32 = 40;

/// The part of the step `h` that ends right after the first switch of the striker's contact, or `None` when the contact
/// stays as it is.
///
/// Expects `ahead` at the end of the whole step; leaves it at the end of the part. Within the step the contact is held
/// as it is at the start, so the motion is smooth and the margin crosses zero cleanly. The switch is bracketed by steps
/// of the integrator itself: its time is exact for the computed motion, and the cut costs no order of accuracy.
pub(crate) fn cut_at_switch(
    rk4: &mut Rk4,
    model: &Model,
    from: &State,
    time_s: f64,
    h: f64,
    ahead: &mut State,
) -> Option<f64> {
    let mut end = first_contradiction(model, from, h, ahead)?;
    if end < h {
        rk4.advance(model, from, time_s, end, ahead);
        if !must_switch(model, ahead) {
            // The coarse look between the ends was mistaken.
            rk4.advance(model, from, time_s, h, ahead);
            if !must_switch(model, ahead) {
                return None;
            }
            end = h;
        }
    }
    let mut start = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (start + end);
        rk4.advance(model, from, time_s, middle, ahead);
        if must_switch(model, ahead) { end = middle } else { start = middle }
    }
    rk4.advance(model, from, time_s, end, ahead);
    Some(end)
}

/// Whether the contact, as it is held, contradicts its own condition.
fn must_switch(model: &Model, state: &State) -> bool {
    contradicts(model, state.touching, state.striker_overlap_m(), state.striker_closing_m_per_s())
}

fn contradicts(model: &Model, touching: bool, overlap_m: f64, closing_m_per_s: f64) -> bool {
    let margin_n = model.contact_margin_n(overlap_m, closing_m_per_s);
    if touching { margin_n < 0.0 } else { margin_n > 0.0 }
}

/// The first of the step's middle and end at which the contact must have switched.
///
/// The middle catches a touch that begins and ends within one step. It is judged by the cubic through both ends, which
/// needs no step of its own.
fn first_contradiction(model: &Model, from: &State, h: f64, ahead: &State) -> Option<f64> {
    let (overlap_0, closing_0) = (from.striker_overlap_m(), from.striker_closing_m_per_s());
    let (overlap_1, closing_1) = (ahead.striker_overlap_m(), ahead.striker_closing_m_per_s());
    let overlap_m = 0.5 * (overlap_0 + overlap_1) + h / 8.0 * (closing_0 - closing_1);
    let closing_m_per_s = 1.5 * (overlap_1 - overlap_0) / h - 0.25 * (closing_0 + closing_1);
    if contradicts(model, from.touching, overlap_m, closing_m_per_s) {
        return Some(0.5 * h);
    }
    must_switch(model, ahead).then_some(h)
}
