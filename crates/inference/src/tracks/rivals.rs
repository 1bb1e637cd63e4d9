//! Hypotheses that might hold as well as what is believed, and what the choice between them does to the results.

use chainwave_measurement::Estimate;
use nalgebra::DVector;

use super::hypothesis::Hypothesis;
use crate::least_squares::{Own, Unknowns};

/// A hypothesis whose chi squared is farther behind the best one's than this is a thousand times less likely, and no rival.
pub(super) const FAR_BEHIND: f64 = 14.0;

/// Where a hypothesis that might as well hold puts the unknowns.
#[derive(Debug, Clone)]
pub(super) struct Rival {
    /// `None` for the model without what is believed.
    pub(super) hypothesis: Option<Hypothesis>,
    /// Those of the fit that it has too: the first ones of the shared, and all recordings' own.
    pub(super) at: Unknowns,
    /// How much less likely it is than what is believed: minus twice the logarithm of the odds.
    pub(super) behind: f64,
}

/// Hypotheses that might as well hold.
#[derive(Debug, Default)]
pub(super) struct Rivals {
    /// In place of the last one that is believed.
    pub(super) instead: Vec<Rival>,
    /// Beside all that is believed: not told, and not excluded.
    pub(super) beside: Vec<Rival>,
    /// What bodies that are not quite alike would make of the unknowns.
    pub(super) scattered: Vec<Shift>,
}

impl Rivals {
    /// How far each hypothesis puts the unknowns from where the best one has them, times the root of its likelihood: the sum of the squares of what
    /// these make of a result is its variance among hypotheses (the between-model variance of J. A. Hoeting et al., Statist. Sci. 14 (1999)
    /// 382-417), about the best one's.
    pub(super) fn about(&self, at: &Unknowns) -> BetweenHypotheses {
        let all = || self.instead.iter().chain(&self.beside);
        // Counted from the likeliest, so that no weight is without bound.
        let least = all().map(|rival| rival.behind).fold(0.0, f64::min);
        let weight = |rival: &Rival| (0.5 * (least - rival.behind)).exp();
        let sum = (0.5 * least).exp() + all().map(weight).sum::<f64>();
        let shift = |rival: &Rival| Shift::between(at, &rival.at, weight(rival) / sum);
        BetweenHypotheses { shifts: all().map(shift).chain(self.scattered.iter().cloned()).collect() }
    }
}

/// How far other hypotheses put the unknowns of a fit, each by its likelihood.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BetweenHypotheses {
    shifts: Vec<Shift>,
}

/// How far one of them puts the unknowns, times the root of its likelihood.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shift {
    shared: Vec<f64>,
    own: Vec<Own>,
    /// The amplitudes of the usual errors, where it says something of them.
    usual: DVector<f64>,
}

impl Shift {
    /// By so much, of the unknowns that all recordings share and of each one's own.
    pub(super) fn by(shared: Vec<f64>, own: Vec<Own>) -> Self {
        Self { shared, own, usual: DVector::zeros(0) }
    }

    fn between(at: &Unknowns, other: &Unknowns, likelihood: f64) -> Self {
        let root = likelihood.sqrt();
        Self::by(
            at.shared.iter().zip(&other.shared).map(|(here, there)| root * (there - here)).collect(),
            at.own.iter().zip(&other.own).map(|(here, there)| root * (there - here)).collect(),
        )
    }

    /// What it makes of a recording's striker, in metres per second, and impact, in seconds, less the mean of all.
    pub(super) fn about_mean(&self, recording: usize) -> Own {
        self.own[recording] - self.mean_own()
    }

    fn mean_own(&self) -> Own {
        self.own.iter().sum::<Own>() / self.own.len().max(1) as f64
    }

    /// What it makes of a sum that has one standard deviation of each usual error with these weights.
    pub(super) fn of_usual(&self, weights: &DVector<f64>) -> f64 {
        self.usual.iter().zip(weights).map(|(shift, weight)| shift * weight).sum()
    }

    /// The same of a sum of shared unknowns.
    pub(super) fn of_shared(&self, weights: &DVector<f64>) -> f64 {
        self.shared.iter().zip(weights).map(|(shift, weight)| shift * weight).sum()
    }
}

impl BetweenHypotheses {
    pub(super) fn of_shifts(shifts: Vec<Shift>) -> Self {
        Self { shifts }
    }

    /// What a fit with such strikers and impacts in place of `here`, and such other usual errors, makes of them, of such a likelihood.
    pub(super) fn of_recordings([here, there]: [Vec<Own>; 2], usual: &DVector<f64>, likelihood: f64) -> Self {
        let [at, other] = [here, there].map(|own| Unknowns { shared: DVector::zeros(0), own });
        let usual = likelihood.sqrt() * usual;
        Self { shifts: vec![Shift { usual, ..Shift::between(&at, &other, likelihood) }] }
    }

    /// Both.
    pub(super) fn and(mut self, other: Self) -> Self {
        self.shifts.extend(other.shifts);
        self
    }

    /// The variance that they give a number, by what each makes of it.
    pub(super) fn variance(&self, of: impl Fn(&Shift) -> f64) -> f64 {
        self.shifts.iter().map(|shift| of(shift).powi(2)).sum()
    }

    /// The variance that they give one of the shared unknowns.
    pub(super) fn of_shared(&self, unknown: usize) -> f64 {
        self.variance(|shift| shift.shared.get(unknown).copied().unwrap_or(0.0))
    }

    /// The variances that they give the mean of the recordings' strikers and impacts.
    pub(super) fn of_mean(&self) -> [f64; 2] {
        [0, 1].map(|k| self.variance(|shift| shift.mean_own()[k]))
    }

    /// The variances that they give what a fit found of a recording, in the order of its estimates.
    pub(super) fn of_recording(&self, recording: usize, mean_m_per_s: f64) -> [f64; 4] {
        [
            self.variance(|shift| shift.own[recording][0]),
            self.variance(|shift| shift.own[recording][1]),
            self.variance(|shift| shift.about_mean(recording)[0] / mean_m_per_s),
            self.variance(|shift| shift.about_mean(recording)[1]),
        ]
    }
}

/// An estimate whose error has so much more variance.
pub(super) fn with_variance(found: Estimate, more: f64) -> Estimate {
    Estimate::new(found.value, found.sigma.hypot(more.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(shared: &[f64], own: &[[f64; 2]]) -> Unknowns {
        Unknowns {
            shared: DVector::from_column_slice(shared),
            own: own.iter().map(|[striker, impact]| Own::new(*striker, *impact)).collect(),
        }
    }

    #[test]
    fn hypotheses_count_by_their_likelihood_and_what_moves_all_recordings_alike_moves_no_difference() {
        let best = at(&[3.0, 0.2, 1.0], &[[2.0, 0.0], [2.0, 1.0]]);
        // As likely as what is believed, and without the third of the shared unknowns; all impacts are later by 4, and the first striker faster by 0.4.
        let rival = Rival {
            hypothesis: Some(Hypothesis::OtherEnd),
            at: at(&[5.0, 0.2], &[[2.4, 4.0], [2.0, 5.0]]),
            behind: 0.0,
        };
        let between = Rivals { instead: vec![rival], ..Rivals::default() }.about(&best);
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found}");
        close(between.of_shared(0), 0.5 * 4.0);
        close(between.of_shared(1), 0.0);
        close(between.of_shared(2), 0.0);
        close(between.variance(|shift| shift.about_mean(0)[0]), 0.5 * 0.04);
        close(between.variance(|shift| shift.about_mean(0)[0] + shift.about_mean(1)[0]), 0.0);
        close(between.variance(|shift| shift.about_mean(1)[1]), 0.0);
        let none = Rivals::default().about(&best);
        close(none.of_shared(0) + none.variance(|shift| shift.about_mean(0)[0]), 0.0);
    }
}
