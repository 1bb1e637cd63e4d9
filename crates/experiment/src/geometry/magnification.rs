//! How views are magnified against each other: by the bodies that two of them show, and by what is stated of how views differ.

use chainwave_measurement::{Estimate, median};
use nalgebra::{DMatrix, DVector};

/// A pair of views, and the second's magnification over the first's, less one.
pub(crate) type PairSize = ([u32; 2], Estimate);

/// Deviations from which on views are said to be magnified differently.
const DETECTION_SIGMAS: f64 = 3.0;
/// Rounds in which views that are tied one to the next find their magnifications.
const ROUNDS: usize = 500;

/// The magnification of views, relative to what they have in common.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Magnifications {
    /// Each view's number and its magnification over the common one, less one.
    pub(crate) views: Vec<(u32, Estimate)>,
    /// Independent errors of these, each by view, of one standard deviation.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Standard uncertainty of what all views have in common.
    common_sigma: f64,
}

impl Magnifications {
    /// From pairs alone, of views that these tie over their median; none where no pair contradicts one scale for all.
    pub(crate) fn told(pairs: &[PairSize]) -> Self {
        let is_told = |(_, size): &PairSize| size.value.abs() > DETECTION_SIGMAS * size.sigma;
        if !pairs.iter().any(is_told) {
            return Self::default();
        }
        let views = sorted(pairs.iter().flat_map(|(views, _)| *views).collect());
        let mut sizes = vec![0.0; views.len()];
        let place = |view: u32| views.iter().position(|other| *other == view).unwrap_or(0);
        for _ in 0..ROUNDS {
            for index in 0..views.len() {
                let told =
                    pairs.iter().filter_map(|([one, other], size)| match (place(*one), place(*other)) {
                        (one, other) if one == index => Some(sizes[other] - size.value),
                        (one, other) if other == index => Some(sizes[one] + size.value),
                        _ => None,
                    });
                let (n, sum) = told.fold((0.0, 0.0), |(n, sum), size| (n + 1.0, sum + size));
                sizes[index] = sum / n;
            }
        }
        // A chain of views hands its errors on.
        let sigma =
            pairs.iter().map(|(_, size)| size.sigma).fold(0.0, f64::max) * (0.5 * views.len() as f64).sqrt();
        let alone =
            |index: usize| (0..views.len()).map(|other| if other == index { sigma } else { 0.0 }).collect();
        let mut errors: Vec<Vec<f64>> = (0..views.len()).map(alone).collect();
        let mut found: Vec<(u32, Estimate)> = Vec::with_capacity(views.len());
        let groups = tied(&views, pairs);
        let mut common_sigma = f64::INFINITY;
        for group in sorted(groups.clone()) {
            // Nothing says how views that are not tied differ.
            let members: Vec<usize> = (0..views.len()).filter(|index| groups[*index] == group).collect();
            let of_group: Vec<f64> = members.iter().map(|index| sizes[*index]).collect();
            let middle = median(of_group.clone()).unwrap_or(0.0);
            let of_member = |index: &usize| (views[*index], Estimate::new(sizes[*index] - middle, sigma));
            found.extend(members.iter().map(of_member));
            // The stated scale was found in one view or in some of them: what views have in common is off it as their mean is.
            let in_common = error_of_mean(&of_group);
            let of_view = |index: usize| if groups[index] == group { in_common } else { 0.0 };
            errors.push((0..views.len()).map(of_view).collect());
            common_sigma = common_sigma.min(in_common);
        }
        found.sort_by_key(|(view, _)| *view);
        Self { common_sigma, errors, views: found }
    }

    /// From pairs, where each view is stated to differ from the common scale by `view_sigma` (relative): the least squares of both. A view
    /// that shares no body with another stays where it is stated to be, as uncertain as that.
    pub(crate) fn stated(views: Vec<u32>, pairs: &[PairSize], view_sigma: f64) -> Self {
        let views = sorted(views);
        let n = views.len();
        let place = |view: u32| views.iter().position(|other| *other == view);
        let mut normal = DMatrix::from_diagonal_element(n, n, view_sigma.powi(-2));
        let mut right = DVector::zeros(n);
        for ([one, other], size) in pairs {
            let (Some(one), Some(other)) = (place(*one), place(*other)) else { continue };
            let weight = size.sigma.powi(-2);
            for (i, of_i) in [(one, -1.0), (other, 1.0)] {
                right[i] += weight * of_i * size.value;
                for (j, of_j) in [(one, -1.0), (other, 1.0)] {
                    normal[(i, j)] += weight * of_i * of_j;
                }
            }
        }
        // A diagonal above zero and squares: positive definite.
        let Some(factor) = normal.cholesky() else { return Self::default() };
        let found = factor.solve(&right);
        // With N = L L^T the covariance is L^-T L^-1: the columns of L^-T are independent errors.
        let inverse = factor.l().try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
        let errors: Vec<Vec<f64>> = inverse.row_iter().map(|row| row.iter().copied().collect()).collect();
        let sigma = |view: usize| errors.iter().map(|error| error[view].powi(2)).sum::<f64>().sqrt();
        let of_view = |index: usize| (views[index], Estimate::new(found[index], sigma(index)));
        // Of the covariance C as much is common to all as 1 / (1^T C^-1 1): ties add nothing to that sum.
        let common_sigma = view_sigma / (n as f64).sqrt();
        Self { views: (0..n).map(of_view).collect(), errors, common_sigma }
    }

    /// The magnification of a view; that of all views, exactly, where nothing is known of it.
    pub(crate) fn of(&self, view: u32) -> Estimate {
        let found = self.views.iter().find(|(number, _)| *number == view);
        found.map_or(Estimate::new(0.0, 0.0), |(_, size)| *size)
    }

    /// What one of the independent errors is of a view; none of a view of which nothing is known.
    pub(crate) fn error_of(&self, view: u32, error: &[f64]) -> f64 {
        self.views
            .iter()
            .zip(error)
            .find(|((number, _), _)| *number == view)
            .map_or(0.0, |(_, of_view)| *of_view)
    }

    /// Whether one of the views is magnified otherwise than the rest beyond doubt.
    pub(crate) fn differ(&self) -> bool {
        self.views.iter().any(|(_, size)| size.value.abs() > DETECTION_SIGMAS * size.sigma)
    }

    /// Standard uncertainty of what all views have in common.
    pub(crate) fn common_sigma(&self) -> f64 {
        self.common_sigma
    }

    /// Views and the standard uncertainty of what each has for itself.
    pub(crate) fn own_sigmas(&self) -> impl Iterator<Item = (u32, f64)> {
        let own = |index: usize| {
            let all: f64 = self.errors.iter().map(|error| error[index].powi(2)).sum();
            (all - self.common_sigma.powi(2)).max(0.0).sqrt()
        };
        self.views.iter().enumerate().map(move |(index, (view, _))| (*view, own(index)))
    }
}

/// The least number of a view that each is tied to by pairs, one to the next.
fn tied(views: &[u32], pairs: &[PairSize]) -> Vec<u32> {
    let mut groups = views.to_vec();
    let place = |view: u32| views.iter().position(|other| *other == view).unwrap_or(0);
    for ([one, other], _) in pairs {
        let [one, other] = [groups[place(*one)], groups[place(*other)]];
        groups.iter_mut().filter(|group| **group == one.max(other)).for_each(|group| *group = one.min(other));
    }
    groups
}

/// Standard error of the mean, by the scatter.
fn error_of_mean(sizes: &[f64]) -> f64 {
    let n = sizes.len() as f64;
    let mean = sizes.iter().sum::<f64>() / n;
    let squares: f64 = sizes.iter().map(|size| (size - mean).powi(2)).sum();
    (squares / (n - 1.0).max(1.0) / n).sqrt()
}

fn sorted(mut views: Vec<u32>) -> Vec<u32> {
    views.sort_unstable();
    views.dedup();
    views
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    #[test]
    fn a_view_without_ties_is_as_uncertain_as_it_is_stated() {
        let found = Magnifications::stated(vec![3, 1, 1], &[], 2e-3);
        for view in [1, 3] {
            let size = found.of(view);
            assert!(size.value.abs() < 1e-18 && (size.sigma / 2e-3 - 1.0).abs() < 1e-12);
        }
        assert!(!found.differ());
    }

    #[test]
    fn what_views_have_in_common_is_as_uncertain_as_they_scatter() {
        let pairs = [([1, 2], Estimate::new(6e-3, 3e-4)), ([2, 3], Estimate::new(-3e-3, 3e-4))];
        let found = Magnifications::told(&pairs);
        // Sizes of 0, 6 and 3 thousandths scatter by 3 about their mean, which is known to 3 / sqrt(3).
        let common = 3e-3 / 3.0_f64.sqrt();
        let of_view = found.of(2).sigma;
        assert!((found.common_sigma() / common - 1.0).abs() < 1e-6);
        assert!(found.own_sigmas().all(|(_, own)| (own / of_view - 1.0).abs() < 1e-6));
        // Beside each other, views do not feel it.
        assert!((found.of(2).value - found.of(1).value - 6e-3).abs() < 1e-9);
        let in_common = found.errors.last().unwrap();
        assert!(in_common.iter().all(|error| (error / common - 1.0).abs() < 1e-6));
    }

    #[test]
    fn views_that_nothing_ties_to_others_have_errors_of_their_own() {
        let pairs = [([1, 2], Estimate::new(6e-3, 3e-4)), ([3, 4], Estimate::new(0.0, 3e-4))];
        let found = Magnifications::told(&pairs);
        // Either of the two may be the one that is off: their mean is known to half their difference; nothing is said of the others.
        let total = |view: usize| found.errors.iter().map(|error| error[view].powi(2)).sum::<f64>().sqrt();
        assert!((found.of(2).value - found.of(1).value - 6e-3).abs() < 1e-9);
        assert!((0..2).all(|view| total(view) >= 3e-3) && (2..4).all(|view| total(view) < 1e-3));
        assert!(found.of(3).value.abs() < 1e-12 && found.common_sigma().abs() < 1e-12);
        assert!(found.own_sigmas().all(|(view, own)| (own > 2.9e-3) == (view <= 2)));
    }

    #[test]
    fn ties_and_statement_share_what_they_know() {
        // Two views, one tie of sigma s, each stated to v: the difference has variance 1/(1/s^2 + 1/(2 v^2)), the sum 2 v^2.
        let (s, v) = (5e-4, 2e-3);
        let found = Magnifications::stated(vec![1, 2], &[([1, 2], Estimate::new(4e-3, s))], v);
        let shrunk = 4e-3 * 2.0 * v * v / (2.0 * v * v + s * s);
        assert!((found.of(2).value - found.of(1).value - shrunk).abs() < 1e-12);
        let variance = |combine: [f64; 2]| -> f64 {
            found.errors.iter().map(|e| (combine[0] * e[0] + combine[1] * e[1]).powi(2)).sum()
        };
        assert!((variance([-1.0, 1.0]) / (1.0 / (s.powi(-2) + 0.5 * v.powi(-2))) - 1.0).abs() < 1e-9);
        assert!((variance([1.0, 1.0]) / (2.0 * v * v) - 1.0).abs() < 1e-9);
        // Half the sum is common, and half the difference each view's own.
        assert!((found.common_sigma() / (v / 2.0_f64.sqrt()) - 1.0).abs() < 1e-12);
        let own = 0.5 / (s.powi(-2) + 0.5 * v.powi(-2)).sqrt();
        assert!(found.own_sigmas().all(|(_, found)| (found / own - 1.0).abs() < 1e-9));
    }

    #[test]
    fn intervals_hold_where_views_scatter_as_stated() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut normal =
            |sigma: f64| -> f64 { sigma * Distribution::<f64>::sample(&StandardNormal, &mut random) };
        let (mut held, mut n) = (0.0, 0.0);
        for _ in 0..400 {
            let truth: Vec<f64> = (0..6).map(|_| normal(3e-3)).collect();
            let pairs: Vec<PairSize> = (1..5)
                .map(|view| {
                    let size = truth[view] - truth[view - 1] + normal(1e-3);
                    ([view as u32, view as u32 + 1], Estimate::new(size, 1e-3))
                })
                .collect();
            let found = Magnifications::stated((1..=6).collect(), &pairs, 3e-3);
            for (view, truth) in (1..).zip(&truth) {
                held += f64::from(u8::from(found.of(view).covers_95(*truth)));
                n += 1.0;
            }
        }
        // 400 experiments whose views share errors: no fewer than 400 independent ones, 0.95 +- 3 x 0.011.
        let share: f64 = held / n;
        assert!((share - 0.95).abs() < 0.033, "{share}");
    }
}
