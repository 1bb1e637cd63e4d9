//! Quintic Hermite interpolant of one gap's overlap within a step.

use crate::equations::{model::ChainModel, state::ChainState};
use crate::integrator::step::TimeStep;

/// The overlap of a gap within a step: the quintic that has its value and its first two derivatives at both ends, so to sixth
/// order in the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GapInterpolant {
    /// By powers of the part of the step, in metres.
    coefficients_m: [f64; 6],
    h_s: f64,
}

/// A value with its first two derivatives by the part of the step.
type ValueAndDerivatives = [f64; 3];

/// Corrections of a turn's place by Newton's method; at a turn the overlap changes with the square of what is left.
const CORRECTIONS: u32 = 5;
/// Part of a step so near to its ends that what happens there counts as happening at the end.
const EDGE: f64 = 1e-4;
/// Halvings by which a passage is located: to far less than [`EDGE`].
const HALVINGS: u32 = 40;

impl GapInterpolant {
    /// Between the states at the ends of a step.
    pub(crate) fn of_gap(model: &ChainModel<'_>, ends: [&ChainState; 2], step: TimeStep, gap: usize) -> Self {
        let TimeStep { time_s, h_s } = step;
        let by_forces = model.closing_m_per_s2(ends, gap);
        let driven = [time_s, time_s + h_s].map(|time_s| model.driven_m_per_s2(time_s, gap));
        let bends_m_per_s2 = [0, 1].map(|end| by_forces[end] + driven[end]);
        let [before, after] =
            [(ends[0], bends_m_per_s2[0]), (ends[1], bends_m_per_s2[1])].map(|(end, bend)| {
                let overlap_m = end.x_m[gap] - end.x_m[gap + 1];
                [overlap_m, h_s * (end.v_m_per_s[gap] - end.v_m_per_s[gap + 1]), h_s * h_s * bend]
            });
        Self::between(before, after, h_s)
    }

    fn between(
        [start, v_0, a_0]: ValueAndDerivatives,
        [end, v_1, a_1]: ValueAndDerivatives,
        h_s: f64,
    ) -> Self {
        let change = end - start;
        let cube = 10.0 * change - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1;
        let fourth = -15.0 * change + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1;
        let fifth = 6.0 * change - 3.0 * (v_0 + v_1) - 0.5 * (a_0 - a_1);
        Self { coefficients_m: [start, v_0, 0.5 * a_0, cube, fourth, fifth], h_s }
    }

    /// Overlap in metres at a part of the step.
    pub(crate) fn overlap_m(&self, part: f64) -> f64 {
        self.coefficients_m.iter().rev().fold(0.0, |sum, coefficient| sum * part + coefficient)
    }

    /// Rate of closing in metres per second at a part of the step.
    pub(crate) fn rate_m_per_s(&self, part: f64) -> f64 {
        self.slope(part) / self.h_s
    }

    fn slope(&self, part: f64) -> f64 {
        let [_, c_1, c_2, c_3, c_4, c_5] = self.coefficients_m;
        c_1 + part * (2.0 * c_2 + part * (3.0 * c_3 + part * (4.0 * c_4 + part * 5.0 * c_5)))
    }

    fn bend(&self, part: f64) -> f64 {
        let [_, _, c_2, c_3, c_4, c_5] = self.coefficients_m;
        2.0 * c_2 + part * (6.0 * c_3 + part * (12.0 * c_4 + part * 20.0 * c_5))
    }

    /// The part of the step at which a gap turns that closes at one end and opens at the other.
    pub(crate) fn turn(&self) -> f64 {
        let (first, last) = (self.slope(0.0), self.slope(1.0));
        let mut part = first / (first - last);
        for _ in 0..CORRECTIONS {
            let next = part - self.slope(part) / self.bend(part);
            part = if next > 0.0 && next < 1.0 { next } else { part };
        }
        part
    }

    /// The part of the step at which the overlap first passes a level, but for its very ends.
    pub(crate) fn first_passage(&self, level_m: f64) -> Option<f64> {
        let is_above = |part: f64| self.overlap_m(part) > level_m;
        let at_first = is_above(EDGE);
        let turn =
            (self.slope(EDGE) * self.slope(1.0) < 0.0).then(|| self.turn()).filter(|turn| *turn > EDGE);
        let passed = turn.into_iter().chain([1.0 - EDGE]).find(|part| is_above(*part) != at_first)?;
        let halved = (0..HALVINGS).fold([EDGE, passed], |[before, behind], _| {
            let middle = 0.5 * (before + behind);
            if is_above(middle) == at_first { [middle, behind] } else { [before, middle] }
        });
        Some(halved[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_of_a_quintic_is_found() {
        // x = 1 + 2 t - t^2 - t^3 + t^5 / 10 turns where 2 - 2 t - 3 t^2 + t^4 / 2 = 0, in [0, 1] near t = 0.56.
        let x = |t: f64| 1.0 + t * (2.0 - t * (1.0 + t * (1.0 - t * t / 10.0)));
        let slope = |t: f64| 2.0 - t * (2.0 + t * (3.0 - t * t / 2.0));
        let bend = |t: f64| -2.0 - t * (6.0 - 2.0 * t * t);
        let turn = (0..20).fold(0.56, |t, _| t - slope(t) / bend(t));
        for (start, end) in [(0.0, 1.0), (0.5, 0.7), (0.55, 0.9)] {
            let h = end - start;
            let course = |t: f64| [x(t), h * slope(t), h * h * bend(t)];
            let found = GapInterpolant::between(course(start), course(end), h);
            let part = found.turn();
            assert!((start + part * h - turn).abs() < 1e-9);
            // A few roundings of numbers near 2.
            assert!((found.overlap_m(part) - x(turn)).abs() < 2e-15, "{start} {end}");
            assert!((found.rate_m_per_s(0.5) - slope(0.5 * (start + end))).abs() < 1e-14);
        }
    }
}
