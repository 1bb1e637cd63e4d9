//! Digits of numbers that are told: an uncertainty has two, and its value as many places.

use chainwave_measurement::Estimate;

/// Decimals that give an uncertainty two digits; five where it has none.
pub(crate) fn decimals(sigma: f64) -> usize {
    const USUAL: usize = 5;
    const MOST: f64 = 12.0;
    match sigma.is_finite() && sigma > 0.0 {
        true => (1.0 - sigma.log10().floor()).clamp(0.0, MOST) as usize,
        false => USUAL,
    }
}

/// A value with its standard uncertainty, as `2.643 +- 0.012`.
pub(crate) fn with_sigma(Estimate { value, sigma }: Estimate) -> String {
    let digits = decimals(sigma);
    format!("{value:.digits$} +- {sigma:.digits$}")
}

/// A number of things, as `1 trial` and `2 trials`.
pub(crate) fn counted(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncertainty_has_two_digits() {
        assert_eq!([12.3, 0.99, 0.0123, 4e-8].map(decimals), [0, 2, 3, 9]);
        assert_eq!([0.0, f64::NAN].map(decimals), [5, 5]);
        assert_eq!(with_sigma(Estimate::new(42_001.34, 2.7521)), "42001.3 +- 2.8");
        assert_eq!(with_sigma(Estimate::new(0.042, 2.1e-6)), "0.0420000 +- 0.0000021");
    }

    #[test]
    fn one_thing_is_no_plural() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "trial")), ["0 trials", "1 trial", "2 trials"]);
    }
}
