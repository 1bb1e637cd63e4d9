//! Probabilities of being as far off by chance.

/// Degrees of freedom beyond which the sums below would underflow, and a normal approximation is good to 1e-4.
const MANY: usize = 200;

/// Probability that a standard normal number lies beyond `z`.
pub(crate) fn normal_beyond(z: f64) -> f64 {
    0.5 * libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Probability that chi squared with `n` degrees of freedom lies beyond `x`: for even n a Poisson sum, for odd n the like sum over
/// half numbers (Abramowitz and Stegun 26.4.4, 26.4.5); for many, Wilson and Hilferty's cube root.
pub(crate) fn chi_squared_beyond(x: f64, n: usize) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    if n > MANY {
        let ninth = 2.0 / (9.0 * n as f64);
        return normal_beyond(((x / n as f64).cbrt() - 1.0 + ninth) / ninth.sqrt());
    }
    let half = 0.5 * x;
    let odd = n % 2 == 1;
    // The first term of the sum and what stands before it; each next term is the last times half over its index.
    let (mut term, mut index, mut sum) = match odd {
        true => (2.0 * (half / std::f64::consts::PI).sqrt() * (-half).exp(), 0.5, libm::erfc(half.sqrt())),
        false => ((-half).exp(), 0.0, 0.0),
    };
    for _ in 0..n / 2 {
        sum += term;
        index += 1.0;
        term *= half / index;
    }
    sum.min(1.0)
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
            (3.841_46, 1, 0.05),
            (5.991_46, 2, 0.05),
            (7.814_73, 3, 0.05),
            (11.070_5, 5, 0.05),
            (37.652_5, 25, 0.05),
        ] {
            assert!(close(chi_squared_beyond(x, n), p, 1e-4), "{x} {n}");
        }
        // Where the sums end and the approximation begins.
        let (below, above) = (chi_squared_beyond(230.0, 200), chi_squared_beyond(231.05, 201));
        assert!((below - above).abs() < 2e-3, "{below} {above}");
        assert!(chi_squared_beyond(0.0, 3) >= 1.0);
    }
}
