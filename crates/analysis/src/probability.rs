//! Probabilities of being as far off by chance.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, StudentsT};

/// Probability that a standard normal number lies beyond `z`.
pub fn normal_beyond(z: f64) -> f64 {
    0.5 * libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Probability that chi squared with `n` degrees of freedom lies beyond `x`.
pub fn chi_squared_beyond(x: f64, n: f64) -> f64 {
    ChiSquared::new(n).map_or(1.0, |law| law.sf(x.max(0.0)))
}

/// Probability that the ratio of two estimates of one variance, from `above` and `below` degrees of freedom, lies beyond `x` (Fisher's F).
pub fn variance_ratio_beyond(x: f64, above: f64, below: f64) -> f64 {
    FisherSnedecor::new(above, below).map_or(1.0, |law| law.sf(x.max(0.0)))
}

/// The factor that makes of `deviations` of a normal distribution the interval of equal probability for an error whose size is itself
/// known from `degrees_of_freedom` degrees of freedom only (Student's t); without bound where nothing is known of it.
pub fn student(deviations: f64, degrees_of_freedom: f64) -> f64 {
    let upper = 1.0 - normal_beyond(deviations);
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::INFINITY, |law| law.inverse_cdf(upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tabulated_values() {
        // Abramowitz and Stegun, table 26.8, and the normal integral.
        let close = |found: f64, expected: f64, tolerance: f64| (found / expected - 1.0).abs() < tolerance;
        assert!(close(normal_beyond(1.959_963_984_540_054), 0.025, 1e-12));
        for (x, n, p) in [
            (3.841_46, 1.0, 0.05),
            (5.991_46, 2.0, 0.05),
            (7.814_73, 3.0, 0.05),
            (11.070_5, 5.0, 0.05),
            (37.652_5, 25.0, 0.05),
        ] {
            assert!(close(chi_squared_beyond(x, n), p, 1e-4), "{x} {n}");
        }
        for (degrees_of_freedom, t) in [(1.0, 12.706_2), (4.0, 2.776_45), (14.0, 2.144_79), (120.0, 1.979_93)]
        {
            let found = student(1.959_963_984_540_054, degrees_of_freedom);
            assert!(close(found, t, 1e-5), "{degrees_of_freedom} {found}");
        }
        // Three deviations are 99.73 % of a normal distribution; the tables' t for that.
        assert!(close(student(3.0, 10.0), 3.957, 1e-3));
        // Abramowitz and Stegun, table 26.9.
        for (x, above, below, p) in
            [(4.964_6, 1.0, 10.0, 0.05), (2.978_2, 10.0, 10.0, 0.05), (1.649_1, 30.0, 60.0, 0.05)]
        {
            assert!(close(variance_ratio_beyond(x, above, below), p, 3e-2), "{x} {above} {below}");
        }
        assert!(student(1.96, 0.0).is_infinite());
        assert!(chi_squared_beyond(0.0, 3.0) >= 1.0);
    }
}
