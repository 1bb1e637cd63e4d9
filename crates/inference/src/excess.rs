//! What residuals that are larger than stated do to uncertainties: one rule for all fits.

/// Degrees of freedom: residuals, priors among them, less unknowns; an unknown and its prior may both be left out.
pub(crate) fn degrees_of_freedom(n_residuals: usize, n_unknowns: usize) -> usize {
    n_residuals.saturating_sub(n_unknowns).max(1)
}

/// Sum of squared residuals over the degrees of freedom: near 1 where the model and the stated errors explain what was measured.
pub(crate) fn reduced_chi_squared(squares: f64, degrees_of_freedom: usize) -> f64 {
    squares / degrees_of_freedom as f64
}

/// Factor on variances. Residuals larger than stated widen the intervals; smaller ones do not narrow them.
pub(crate) fn excess(reduced_chi_squared: f64) -> f64 {
    reduced_chi_squared.max(1.0)
}

/// The same on standard uncertainties.
pub(crate) fn inflation(reduced_chi_squared: f64) -> f64 {
    excess(reduced_chi_squared).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_residuals_widen_and_smaller_ones_do_not_narrow() {
        let of = |squares: f64| inflation(reduced_chi_squared(squares, degrees_of_freedom(12, 3)));
        for (squares, expected) in [(36.0, 2.0), (9.0, 1.0), (1.0, 1.0)] {
            assert!((of(squares) - expected).abs() < f64::EPSILON, "{squares}");
        }
        assert_eq!(degrees_of_freedom(2, 3), 1);
    }
}
