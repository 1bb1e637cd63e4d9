//! One branch of a compression curve: what makes it one, its noise, and the readings before contact.

use chainwave_measurement::{median, robust_sigma_about_zero};

use super::branches::range;
use super::error::ContactFitError;

/// Readings on the loading branch that a fit needs: three parameters, and five more to know the scatter by.
pub(super) const LEAST_READINGS: usize = 8;
/// Different overlaps among them.
const LEAST_OVERLAPS: usize = 5;
/// Readings before contact that make an approach.
pub(super) const LEAST_APPROACH: usize = 5;
/// Overlaps in metres lie below this by far.
const LARGEST_OVERLAP_M: f64 = 1.0;
/// A slope is real from this many standard uncertainties.
const REAL_SLOPE: f64 = 5.0;
/// A drop of the force is real above this fraction of the curve's range of force, and above so many times the noise.
const REAL_DROP: (f64, f64) = (0.1, 6.0);
/// Before contact the slope is below this fraction of the slope thereafter, by so many standard uncertainties.
const APPROACH: (f64, f64) = (0.1, 4.0);
/// Rounding of sums over forces, relative to the largest.
const ROUNDING: f64 = 1e-12;

/// One branch, sorted by overlap.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    pub(super) overlap_m: Vec<f64>,
    pub(super) force_n: Vec<f64>,
    /// Mean noise of all forces over that of each; empty where all have the same.
    weights: Vec<f64>,
}

/// Refuses what cannot be a compression curve whatever its branches are.
pub(super) fn check_readings(overlap_m: &[f64], force_n: &[f64]) -> Result<(), ContactFitError> {
    if overlap_m.len() != force_n.len() {
        return Err(ContactFitError::Length { expected: overlap_m.len(), found: force_n.len() });
    }
    for (quantity, values) in [("overlap_m", overlap_m), ("force_n", force_n)] {
        if let Some((reading, found)) = values.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(ContactFitError::NotFinite { reading, quantity, found: *found });
        }
    }
    if let Some((reading, found)) = overlap_m.iter().enumerate().find(|(_, x)| x.abs() > LARGEST_OVERLAP_M) {
        return Err(ContactFitError::NotMetres { reading, found: *found });
    }
    expect_number("readings", overlap_m.len(), LEAST_READINGS)?;
    let (lowest_m, highest_m) = range(overlap_m.iter().copied());
    if highest_m <= lowest_m {
        return Err(ContactFitError::ConstantOverlap { found: lowest_m });
    }
    match highest_m <= 0.0 || highest_m < -lowest_m {
        true => Err(ContactFitError::Tension { lowest_m, highest_m }),
        false => Ok(()),
    }
}

fn expect_number(what: &'static str, found: usize, expected: usize) -> Result<(), ContactFitError> {
    if found < expected { Err(ContactFitError::TooFew { what, expected, found }) } else { Ok(()) }
}

impl Curve {
    /// The readings of one branch, checked: enough of them, and a force that grows with the overlap.
    pub(super) fn new(
        indices: &[usize],
        overlap_m: &[f64],
        force_n: &[f64],
    ) -> Result<Self, ContactFitError> {
        let mut sorted = indices.to_vec();
        sorted.sort_by(|left, right| overlap_m[*left].total_cmp(&overlap_m[*right]));
        let curve = Self {
            overlap_m: sorted.iter().map(|i| overlap_m[*i]).collect(),
            force_n: sorted.iter().map(|i| force_n[*i]).collect(),
            weights: Vec::new(),
        };
        curve.check_number()?;
        curve.check_slope()?;
        curve.check_drops()?;
        Ok(curve)
    }

    pub(super) fn len(&self) -> usize {
        self.overlap_m.len()
    }

    /// The curve less what lies below zero overlap; more than a trace of that was measured in tension.
    pub(super) fn without_tension(&self) -> Result<Self, ContactFitError> {
        const TRACE: f64 = 0.02;
        let (lowest_m, highest_m) = self.ends_m();
        if lowest_m < -TRACE * highest_m {
            return Err(ContactFitError::Tension { lowest_m, highest_m });
        }
        let curve = self.beyond(0.0);
        curve.check_number()?;
        Ok(curve)
    }

    /// The part beyond an overlap.
    pub(super) fn beyond(&self, overlap_m: f64) -> Self {
        let first = self.overlap_m.partition_point(|x| *x < overlap_m);
        self.chosen(|values| values.iter().skip(first).copied().collect())
    }

    /// At most about `n` of the readings, evenly chosen.
    pub(super) fn thinned(&self, n: usize) -> Self {
        self.chosen(|values| values.iter().copied().step_by(self.len().div_ceil(n)).collect())
    }

    fn chosen(&self, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self { overlap_m: of(&self.overlap_m), force_n: of(&self.force_n), weights: of(&self.weights) }
    }

    /// The same with these weights.
    pub(super) fn weighted(&self, weights: Vec<f64>) -> Self {
        Self { weights, ..self.clone() }
    }

    /// Mean noise of all forces over that of one.
    pub(super) fn weight(&self, reading: usize) -> f64 {
        self.weights.get(reading).copied().unwrap_or(1.0)
    }

    /// Smallest and largest overlap.
    pub(super) fn ends_m(&self) -> (f64, f64) {
        range(self.overlap_m.iter().copied())
    }

    /// What sums over forces err by.
    pub(super) fn rounding_n(&self) -> f64 {
        ROUNDING * self.force_n.iter().fold(0.0_f64, |most, f| most.max(f.abs()))
    }

    fn check_number(&self) -> Result<(), ContactFitError> {
        expect_number("readings on the loading branch", self.len(), LEAST_READINGS)?;
        let different = 1 + self.overlap_m.windows(2).filter(|pair| pair[1] > pair[0]).count();
        expect_number("different overlaps on the loading branch", different, LEAST_OVERLAPS)
    }

    fn check_slope(&self) -> Result<(), ContactFitError> {
        let sums = Sums::of(self);
        let line = sums.line(0, self.len());
        let degrees_of_freedom = (self.len() - 2) as f64;
        let residual_n = |(x, f): (&f64, &f64)| f - line.mean_n - line.slope_n_per_m * (x - line.mean_m);
        let squares: f64 =
            self.overlap_m.iter().zip(&self.force_n).map(|reading| residual_n(reading).powi(2)).sum();
        let noise_n = (squares / degrees_of_freedom).sqrt().max(self.rounding_n());
        if line.slope_n_per_m.abs() <= REAL_SLOPE * noise_n / line.spread_m {
            return Err(ContactFitError::ConstantForce { mean_n: line.mean_n, noise_n });
        }
        match line.slope_n_per_m < 0.0 {
            true => Err(ContactFitError::FallingForce { slope_n_per_m: -line.slope_n_per_m }),
            false => Ok(()),
        }
    }

    /// Refuses a force whose running median of three falls from its largest value so far.
    fn check_drops(&self) -> Result<(), ContactFitError> {
        let (lowest_n, highest_n) = range(self.force_n.iter().copied());
        let allowed_n = (REAL_DROP.0 * (highest_n - lowest_n)).max(REAL_DROP.1 * self.noise_n());
        let mut from_n = f64::NEG_INFINITY;
        let medians_n = self.force_n.windows(3).filter_map(|window| median(window.to_vec()));
        for (to_n, overlap_m) in medians_n.zip(&self.overlap_m[1..]) {
            from_n = from_n.max(to_n);
            if from_n - to_n > allowed_n {
                return Err(ContactFitError::DroppingForce { overlap_m: *overlap_m, from_n, to_n });
            }
        }
        Ok(())
    }

    /// Noise of one force from how far readings lie off the line between their neighbours: their median, so that kinks do not
    /// count; and at least that of the rounding to the steps in which forces were read.
    pub(super) fn noise_n(&self) -> f64 {
        let off_line = |i: usize| {
            let (x, f) = (&self.overlap_m[i - 1..=i + 1], &self.force_n[i - 1..=i + 1]);
            let span_m = x[2] - x[0];
            let weight = if span_m > 0.0 { (x[1] - x[0]) / span_m } else { 0.5 };
            let off_n = f[1] - (1.0 - weight) * f[0] - weight * f[2];
            off_n.abs() / (1.0 + (1.0 - weight).powi(2) + weight * weight).sqrt()
        };
        let off_lines_n = robust_sigma_about_zero((1..self.len() - 1).map(off_line)).unwrap_or(0.0);
        off_lines_n.max(self.step_n() / 12.0_f64.sqrt())
    }

    /// The least difference of neighbouring forces that differ: of a digital load cell, its step.
    fn step_n(&self) -> f64 {
        let rounding_n = self.rounding_n();
        let differences_n = self.force_n.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let least_n = differences_n.filter(|step_n| *step_n > rounding_n).fold(f64::INFINITY, f64::min);
        if least_n.is_finite() { least_n } else { 0.0 }
    }

    /// Number of readings before contact, 0 where there are none to be seen: the force there is flat, against the slope of
    /// equally many readings that follow. A law that softens never begins flat, and one that stiffens with F ~ overlap^3 not
    /// flat enough.
    pub(super) fn approach(&self) -> usize {
        let noise_n = self.noise_n();
        let sums = Sums::of(self);
        let flat = |m: usize| {
            let (before, after) = (sums.line(0, m), sums.line(m, (2 * m).min(self.len())));
            let known_to = APPROACH.1 * noise_n / before.spread_m;
            before.spread_m > 0.0
                && after.spread_m > 0.0
                && before.slope_n_per_m + known_to < APPROACH.0 * after.slope_n_per_m
        };
        (LEAST_APPROACH..=self.len().saturating_sub(LEAST_READINGS)).rev().find(|m| flat(*m)).unwrap_or(0)
    }
}

/// A line through some readings.
struct Line {
    mean_m: f64,
    mean_n: f64,
    slope_n_per_m: f64,
    /// Root of the sum of squared distances from the mean overlap.
    spread_m: f64,
}

/// Running sums of overlap, force, their product, and overlap squared, from which any line follows.
struct Sums(Vec<[f64; 4]>);

impl Sums {
    fn of(curve: &Curve) -> Self {
        let mut sums = vec![[0.0; 4]];
        let mut sum = [0.0; 4];
        for (x, f) in curve.overlap_m.iter().zip(&curve.force_n) {
            for (total, term) in sum.iter_mut().zip([*x, *f, x * f, x * x]) {
                *total += term;
            }
            sums.push(sum);
        }
        Self(sums)
    }

    /// The line through the readings `from..to`.
    fn line(&self, from: usize, to: usize) -> Line {
        let n = (to - from) as f64;
        let [x, f, product, square] = std::array::from_fn(|k| (self.0[to][k] - self.0[from][k]) / n);
        let variance = (square - x * x).max(0.0);
        Line {
            mean_m: x,
            mean_n: f,
            slope_n_per_m: (product - x * f) / variance,
            spread_m: (n * variance).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(n: usize, force_n: impl Fn(usize, f64) -> f64) -> Result<Curve, ContactFitError> {
        let overlap_m: Vec<f64> = (0..n).map(|i| 0.01 * i as f64 / n as f64).collect();
        let forces: Vec<f64> = overlap_m.iter().enumerate().map(|(i, x)| force_n(i, *x)).collect();
        Curve::new(&(0..n).collect::<Vec<_>>(), &overlap_m, &forces)
    }

    /// Noise of +-1 in a fixed order without a period.
    fn sign(i: usize) -> f64 {
        if (i * i + i / 3).is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    #[test]
    fn the_noise_does_not_know_the_curvature() {
        let found = curve(400, |i, x| 10.0 * x.sqrt() + 1e-3 * sign(i)).unwrap().noise_n();
        // Signs are no normal deviates, which the factor is for.
        assert!((0.5e-3..2e-3).contains(&found), "{found}");
    }

    #[test]
    fn an_approach_is_seen_and_a_slow_start_is_none() {
        let kinked = curve(200, |i, x| 500.0 * (x - 0.002).max(0.0) + 5e-3 * sign(i)).unwrap();
        let found = kinked.approach();
        assert!((36..50).contains(&found), "contact at reading 40: {found}");
        for power in [0.5, 1.0, 1.5, 3.0] {
            let started = curve(200, |i, x| 5.0 * (x / 0.01).powf(power) + 1e-3 * sign(i)).unwrap();
            assert_eq!(started.approach(), 0, "{power}");
        }
    }

    #[test]
    fn a_snap_is_a_drop_and_a_spike_is_not() {
        let snapped = curve(100, |i, x| if i < 97 { 500.0 * x } else { 0.1 });
        assert!(matches!(snapped, Err(ContactFitError::DroppingForce { .. })), "{snapped:?}");
        assert!(curve(100, |i, x| if i == 50 { 0.0 } else { 500.0 * x }).is_ok());
    }
}
