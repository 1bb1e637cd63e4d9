//! Exponents that a curve cannot reject, by the profile of the sum of squares.

use super::curve::Curve;
use super::law::EXPONENTS;
use super::outcome::{LawOnProfile, Profile};
use super::search::{Minimum, Unknowns, descend, off_n};

/// Laws on the profile that are reported.
const N_LAWS: usize = 7;
/// Halvings of the interval in which the profile crosses its threshold: to a thousandth of the interval.
const HALVINGS: usize = 10;
/// Growth of the steps outwards.
const GROWTH: f64 = 1.6;

/// A curve, what is unknown beside p, and the best law.
pub(super) struct Profiler<'a> {
    pub(super) curve: &'a Curve,
    pub(super) unknowns: Unknowns,
    pub(super) best: Minimum,
    /// Sum of squares up to which a law is not rejected.
    pub(super) threshold: f64,
}

impl Profiler<'_> {
    /// The exponents that the data cannot reject, each with its own best law.
    pub(super) fn profile(&self, first_step: f64) -> Profile {
        let (low, high) = (self.edge(-first_step), self.edge(first_step));
        let (p_low, p_high) = (low.parameters.law.p, high.parameters.law.p);
        let mut laws = Vec::with_capacity(N_LAWS);
        let mut from = low;
        for k in 0..N_LAWS {
            let p = p_low + (p_high - p_low) * k as f64 / (N_LAWS - 1) as f64;
            if let Some(minimum) = self.at(p, &from) {
                from = minimum;
                laws.extend(self.law(&minimum));
            }
        }
        Profile {
            low: p_low,
            high: p_high,
            open_below: p_low <= EXPONENTS.0,
            open_above: p_high >= EXPONENTS.1,
            laws,
        }
    }

    /// Steps outwards from the best exponent until the data reject it, and closes in on the crossing.
    fn edge(&self, first_step: f64) -> Minimum {
        let best_p = self.best.parameters.law.p;
        let (mut inside, mut step) = (self.best, first_step);
        let mut rejected = loop {
            let p = (best_p + step).clamp(EXPONENTS.0, EXPONENTS.1);
            let Some(minimum) = self.at(p, &inside).filter(|minimum| self.holds(minimum)) else { break p };
            let at_the_end = p <= EXPONENTS.0 || p >= EXPONENTS.1;
            inside = minimum;
            if at_the_end && (step < 0.0) == (p <= EXPONENTS.0) {
                return inside;
            }
            step *= GROWTH;
        };
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside.parameters.law.p + rejected);
            match self.at(middle, &inside).filter(|minimum| self.holds(minimum)) {
                Some(minimum) => inside = minimum,
                None => rejected = middle,
            }
        }
        inside
    }

    fn holds(&self, minimum: &Minimum) -> bool {
        minimum.sum_of_squares <= self.threshold
    }

    /// The best law of a given exponent, sought from a neighbour's.
    fn at(&self, p: f64, neighbour: &Minimum) -> Option<Minimum> {
        let mut start = neighbour.parameters;
        start.law.p = p;
        descend(self.curve, Unknowns { p: false, ..self.unknowns }, start)
    }

    fn law(&self, minimum: &Minimum) -> Option<LawOnProfile> {
        let law = minimum.parameters.law.power_law().ok()?;
        let rms_n = (off_n(self.curve, &minimum.parameters).norm_squared() / self.curve.len() as f64).sqrt();
        Some(LawOnProfile { law, rms_n })
    }
}
