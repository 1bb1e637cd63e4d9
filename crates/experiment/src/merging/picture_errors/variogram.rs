//! How alike the errors of a picture are at two places of a body's way.
//!
//! A body that has moved by d is seen with the pattern P(x + d) where it is, and with P(x) where it rested, which its reference keeps. The
//! variance of the difference is the pattern's variogram v(d) (G. Matheron, Econ. Geol. 58 (1963) 1246), and the identity of its increments,
//!
//! > cov(P(d) - P(0), P(e) - P(0)) = (v(d) + v(e) - v(d - e)) / 2,
//!
//! says how far two errors are one. Of a pattern that is white v is the same at all distances: half of the variance is P(0)'s and common to all of
//! the way. Of a smooth one v grows with the distance, and more is common.

use nalgebra::{DMatrix, DVector};

/// The variance of an error by the distance from the place at rest, relative to its mean over a body's way.
pub(super) struct Variogram {
    step_m: f64,
    /// At whole steps.
    at_steps: Vec<f64>,
}

/// Parts of an error that have less of its variance are left out.
const LEAST_PART: f64 = 1e-3;

impl Variogram {
    /// From ways of bodies, each as distances from rest and the variances there. A way counts by its variance, beside that of the same ways
    /// at other distances, so that it does not matter which ways go how far.
    pub(super) fn of(ways: &[Vec<(f64, f64)>], step_m: f64) -> Self {
        let step = |away_m: f64| (away_m.abs() / step_m).round() as usize;
        let n = ways.iter().flatten().map(|(away_m, _)| step(*away_m) + 1).max().unwrap_or(1);
        let (mut here, mut of_ways) = (vec![0.0; n], vec![0.0; n]);
        for way in ways {
            let mut sums = vec![(0.0, 0.0); n];
            for (away_m, variance_m2) in way {
                let (sum, count) = &mut sums[step(*away_m)];
                *sum += variance_m2;
                *count += 1.0;
            }
            let mean = way.iter().map(|(_, variance_m2)| variance_m2).sum::<f64>() / way.len().max(1) as f64;
            for (k, (sum, count)) in sums.into_iter().enumerate().filter(|(_, (_, count))| *count > 0.0) {
                here[k] += sum / count;
                of_ways[k] += mean;
            }
        }
        let mut at_steps = vec![0.0; n];
        for k in 1..n {
            at_steps[k] = if of_ways[k] > 0.0 { here[k] / of_ways[k] } else { at_steps[k - 1] };
        }
        Self { step_m, at_steps }
    }

    fn at(&self, away_m: f64) -> f64 {
        let step = (away_m.abs() / self.step_m).round() as usize;
        self.at_steps[step.min(self.at_steps.len() - 1)]
    }

    /// Independent parts, column by column, of errors of unit variance at some distances from rest; none where nothing has changed yet.
    pub(super) fn parts(&self, away_m: &[f64]) -> DMatrix<f64> {
        let n = away_m.len();
        let own: Vec<f64> = away_m.iter().map(|away_m| self.at(*away_m)).collect();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            let common = 0.5 * (own[i] + own[j] - self.at(away_m[i] - away_m[j]));
            let size = (own[i] * own[j]).sqrt();
            if size > 0.0 { (common / size).clamp(-1.0, 1.0) } else { 0.0 }
        });
        // What was found of few ways need not be a variogram: what is negative in its correlations is left out.
        let eigen = correlation.symmetric_eigen();
        let least = LEAST_PART * n as f64;
        let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > least).collect();
        let mut parts = DMatrix::from_fn(n, kept.len(), |i, k| {
            eigen.eigenvalues[kept[k]].sqrt() * eigen.eigenvectors[(i, kept[k])]
        });
        for mut row in parts.row_iter_mut() {
            let norm = row.norm();
            if norm > 0.0 {
                row /= norm;
            }
        }
        parts
    }
}

/// Between places at which errors have the given parts, by weights: of unit variance again.
pub(super) fn between(parts: &DMatrix<f64>, weights: &DVector<f64>) -> DVector<f64> {
    let sum = parts.transpose() * weights;
    let norm = sum.norm();
    if norm > 0.0 { sum / norm } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_M: f64 = 1e-3;

    /// Correlation of errors at two distances from rest, where variances along a way are these.
    fn correlation(variance: impl Fn(f64) -> f64, places_m: [f64; 2]) -> f64 {
        let way: Vec<(f64, f64)> =
            (1..=200).map(|k| f64::from(k) * 1e-4).map(|away_m| (away_m, variance(away_m))).collect();
        let nodes: Vec<f64> = (0..=20).map(|k| f64::from(k) * STEP_M).collect();
        let parts = Variogram::of(&[way], STEP_M).parts(&nodes);
        let row = |away_m: f64| parts.row((away_m / STEP_M).round() as usize);
        row(places_m[0]).dot(&row(places_m[1]))
    }

    #[test]
    fn half_of_a_white_pattern_is_common_and_all_of_a_smooth_one() {
        let places_m = [0.008, 0.016];
        assert!((correlation(|_| 1.0, places_m) - 0.5).abs() < 1e-6);
        // A pattern in proportion to the place is one error, and one that walks at random has what both ways have passed: sqrt(8 / 16). Variances over
        // a step are as that in its middle to 1e-3, and parts of a thousandth are left out.
        assert!((correlation(|d| d * d, places_m) - 1.0).abs() < 0.01);
        assert!((correlation(|d| d, places_m) - 0.5_f64.sqrt()).abs() < 0.02);
    }

    #[test]
    fn an_error_has_unit_variance_everywhere_but_at_rest() {
        let ways = [vec![(0.0, 0.0), (1e-3, 0.4), (2e-3, 1.0), (3e-3, 0.7)]];
        let parts = Variogram::of(&ways, STEP_M).parts(&[0.0, 1e-3, 2e-3, 3e-3]);
        assert!(parts.row(0).norm() < 1e-12);
        assert!((1..4).all(|k| (parts.row(k).norm() - 1.0).abs() < 1e-12));
        let half_way = DVector::from_vec(vec![0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0]);
        assert!((between(&parts, &half_way).norm() - 1.0).abs() < 1e-12);
    }
}
