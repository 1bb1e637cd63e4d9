//! Which shape function a subset needs: the simplest that its matches cannot reject.
//!
//! A match with the affine shape function gives the displacement gradient with its covariance, and one Gauss-Newton
//! step of the quadratic one from there gives the curvature with its own. That each of them is zero is tested by
//! `W = d^T cov(d)^-1 d` (A. Wald, Trans. Am. Math. Soc. 54 (1943) 426-482), of which W/k has the F distribution with k
//! = 4 or 6 and N - P degrees of freedom. The covariance is that of [`crate::uncertainty`], which knows that
//! interpolated noise is correlated; a test by the sums of squared residuals alone would take correlated noise for
//! structure. The level is 1 % for all matches of a subset together: of n of them the least p counts n times
//! (Bonferroni), which holds whatever they share, such as the noise of the reference.

use chainwave_measurement::Lost;
use nalgebra::{DMatrix, DVector};

use crate::icgn::outcome::Match;
use crate::uncertainty::{Residual, degrees_of_freedom, scales};
use crate::warp::Warp;
use crate::{PreparedSubset, Reference, Settings, Shape, Window, Workspace};

/// What the matches of a subset say of its shape function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeEvidence {
    /// The simplest shape function that is not rejected at [`ShapeEvidence::SIGNIFICANCE_LEVEL`].
    pub shape: Shape,
    /// Probability of a displacement gradient like the one found, were there none.
    pub p_translation: f64,
    /// Probability of a curvature like the one found, were there none.
    pub p_affine: f64,
    /// Matches behind this.
    pub n_matches: usize,
}

impl ShapeEvidence {
    /// Share of subsets whose simpler shape function is rejected though it is right.
    pub const SIGNIFICANCE_LEVEL: f64 = 0.01;

    /// Without a match there is nothing to choose by, and the usual shape function stays.
    const NONE: Self = Self { shape: Shape::Affine, p_translation: 1.0, p_affine: 1.0, n_matches: 0 };
}

/// Tests the shape functions of one subset in one match after the other.
pub(crate) struct ShapeTest {
    quadratic: Result<PreparedSubset, Lost>,
    /// Least probability of a match, for translation and for affine.
    least: [f64; 2],
    n_matches: usize,
}

impl ShapeTest {
    pub(crate) fn new(
        reference: &Reference,
        subset: &chainwave_measurement::Subset,
        settings: &Settings,
    ) -> Self {
        let settings = Settings { shape: Shape::Quadratic, ..settings.clone() };
        Self { quadratic: PreparedSubset::new(reference, subset, &settings), least: [1.0; 2], n_matches: 0 }
    }

    /// Adds a match of the affine subset: what it left out is no part of the test.
    pub(crate) fn add(
        &mut self,
        affine: &PreparedSubset,
        window: &Window,
        found: &Match,
        workspace: &mut Workspace,
    ) {
        let visible = match found.is_whole {
            true => None,
            false => match affine.visible_at(window, found, workspace) {
                Some(visible) => Some(visible),
                None => return,
            },
        };
        let part = |subset: &PreparedSubset| visible.as_ref().and_then(|visible| subset.only(visible).ok());
        let whole = |subset| found.is_whole.then_some(subset);
        let quadratic = self.quadratic.as_ref().ok();
        let (part_of_affine, part_of_quadratic) = (part(affine), quadratic.and_then(part));
        let affine = part_of_affine.as_ref().or(whole(affine));
        let quadratic = part_of_quadratic.as_ref().or(quadratic.and_then(whole));
        let warp = &found.warp();
        let of_gradient = affine.and_then(|affine| gradient_test(affine, window, warp, workspace));
        let Some(of_gradient) = of_gradient else { return };
        // A texture that does not show a curvature cannot ask for it.
        let of_curvature = quadratic.and_then(|subset| curvature_test(subset, window, warp, workspace));
        self.least[0] = self.least[0].min(of_gradient);
        self.least[1] = self.least[1].min(of_curvature.unwrap_or(1.0));
        self.n_matches += 1;
    }

    pub(crate) fn evidence(&self) -> ShapeEvidence {
        if self.n_matches == 0 {
            return ShapeEvidence::NONE;
        }
        let [p_translation, p_affine] = self.least.map(|p| (p * self.n_matches as f64).min(1.0));
        let shape = if p_affine < ShapeEvidence::SIGNIFICANCE_LEVEL {
            Shape::Quadratic
        } else if p_translation < ShapeEvidence::SIGNIFICANCE_LEVEL {
            Shape::Affine
        } else {
            Shape::Translation
        };
        ShapeEvidence { shape, p_translation, p_affine, n_matches: self.n_matches }
    }
}

/// The probability of a gradient as large as that of a match, were there none.
fn gradient_test(
    affine: &PreparedSubset,
    window: &Window,
    warp: &Warp,
    workspace: &mut Workspace,
) -> Option<f64> {
    let (_, residual) = affine.compare(window, warp, workspace)?;
    p_of_zero(affine, warp, &residual, &[1, 2, 4, 5], &warp.gradient)
}

/// The probability of a curvature as large as that of a step from an affine match, were there none.
fn curvature_test(
    quadratic: &PreparedSubset,
    window: &Window,
    warp: &Warp,
    workspace: &mut Workspace,
) -> Option<f64> {
    let (found, residual) = quadratic.compare(window, warp, workspace)?;
    p_of_zero(quadratic, warp, &residual, &[3, 4, 5, 9, 10, 11], &found.step.curvature)
}

/// The probability of some parameters' values, were they zero.
fn p_of_zero(
    subset: &PreparedSubset,
    warp: &Warp,
    residual: &Residual,
    parameters: &[usize],
    values: &[f64],
) -> Option<f64> {
    let [signal, noise] = scales(subset, warp, residual);
    let covariance = DMatrix::from_fn(values.len(), values.len(), |i, j| {
        let (p, q) = (parameters[i], parameters[j]);
        signal * subset.covariance.signal[p][q] + noise * subset.covariance.noise[p][q]
    });
    let values = DVector::from_row_slice(values);
    let wald = values.dot(&covariance.cholesky()?.solve(&values));
    Some(f_tail(values.len() / 2, degrees_of_freedom(subset) as f64, wald))
}

/// The probability that a sum of squares over `2 half` degrees of freedom, in units of a variance that is known from
/// `others` further ones, exceeds `square`: I_y(others/2, half) with y = others/(others + square), which is a finite sum
/// for a whole `half` (M. Abramowitz, I. Stegun, 26.6.4 and 26.5.6).
fn f_tail(half: usize, others: f64, square: f64) -> f64 {
    let (a, y) = (0.5 * others, others / (others + square));
    let (mut term, mut sum) = (1.0, 1.0);
    for j in 1..half {
        term *= (a + (j - 1) as f64) / j as f64 * (1.0 - y);
        sum += term;
    }
    (sum * y.powf(a)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_that_of_the_tables() {
        // F(4, 20) exceeds 4.43 and F(6, 10) exceeds 5.39 in 1 % of cases; F(4, inf) exceeds 2.372 in 5 %.
        for (half, others, f, p) in [(2, 20.0, 4.431, 0.01), (3, 10.0, 5.386, 0.01), (2, 1e7, 2.372, 0.05)] {
            let found = f_tail(half, others, f * 2.0 * half as f64);
            assert!((found / p - 1.0).abs() < 2e-3, "tables have four digits: {found} {p}");
        }
        assert!((f_tail(3, 100.0, 0.0) - 1.0).abs() < 1e-15);
        assert!(f_tail(2, 1000.0, 1e9) < 1e-100);
    }
}
