//! The power law by its stiffness, with derivatives: a form that goes on where the exponent is zero or negative.

use chainwave_mechanics::{MechanicsError, PowerLaw};

/// Exponents between which a law is sought, those of the laws that the chain model is tested for.
pub(super) const EXPONENTS: (f64, f64) = (0.01, 5.0);
/// Series terms of [`slope_term`]; with |z| < 1/2 the rest is below 1e-17.
const TERMS: u32 = 14;

/// The power law by its stiffness: F = k_0 delta_0 ((1 + y)^p - 1) / p with y = overlap / delta_0.
///
/// In this form the exponent may be zero (a logarithm) or negative, so a search and its intervals do not end where the
/// prefactor a = k_0 delta_0^(1 - p) / p ceases to exist. The logarithms of k_0 and delta_0 keep both positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    pub(super) ln_k_0: f64,
    pub(super) ln_delta_0: f64,
    pub(super) p: f64,
}

/// The force at an overlap and its derivatives.
pub(super) struct Force {
    pub(super) force_n: f64,
    pub(super) by_ln_k_0: f64,
    pub(super) by_ln_delta_0: f64,
    pub(super) by_p: f64,
    pub(super) stiffness_n_per_m: f64,
}

impl Law {
    pub(super) fn k_0_n_per_m(&self) -> f64 {
        self.ln_k_0.exp()
    }

    pub(super) fn delta_0_m(&self) -> f64 {
        self.ln_delta_0.exp()
    }

    /// The same law as the chain model uses it; exists for p above zero.
    pub(super) fn power_law(&self) -> Result<PowerLaw, MechanicsError> {
        PowerLaw::from_stiffness(self.k_0_n_per_m(), self.delta_0_m(), self.p)
    }

    /// Force and derivatives at an overlap; zero before contact (overlap below 0).
    pub(super) fn at(&self, overlap_m: f64) -> Force {
        let overlap_m = overlap_m.max(0.0);
        let (k_0, delta_0_m) = (self.k_0_n_per_m(), self.delta_0_m());
        let logarithm = (overlap_m / delta_0_m).ln_1p();
        let scale_n = k_0 * delta_0_m;
        let force_n = scale_n * power_term(self.p, logarithm);
        let stiffness_n_per_m = k_0 * ((self.p - 1.0) * logarithm).exp();
        Force {
            force_n,
            by_ln_k_0: force_n,
            by_ln_delta_0: force_n - stiffness_n_per_m * overlap_m,
            by_p: scale_n * logarithm * logarithm * slope_term(self.p * logarithm),
            stiffness_n_per_m,
        }
    }
}

/// (e^(p l) - 1) / p, which is l at p = 0.
pub(super) fn power_term(p: f64, logarithm: f64) -> f64 {
    match p.abs() < f64::MIN_POSITIVE {
        true => logarithm,
        false => (p * logarithm).exp_m1() / p,
    }
}

/// (z e^z - e^z + 1) / z^2, the sum over k of (k + 1) z^k / (k + 2)!, which is 1/2 at z = 0.
fn slope_term(z: f64) -> f64 {
    if z.abs() > 0.5 {
        return (z * z.exp() - z.exp_m1()) / (z * z);
    }
    let (mut sum, mut term) = (0.0, 0.5);
    for k in 0..TERMS {
        let k = f64::from(k);
        sum += (k + 1.0) * term;
        term *= z / (k + 3.0);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_power_law_of_the_chain_model() {
        for (a, delta_0_m, p) in [(60.1, 2.27e-3, 0.114), (1e4, 1e-3, 1.5), (30.0, 5e-3, 0.01)] {
            let power = PowerLaw::new(a, delta_0_m, p).unwrap();
            let law = Law { ln_k_0: power.k_0_n_per_m().ln(), ln_delta_0: delta_0_m.ln(), p };
            assert!((law.power_law().unwrap().a / a - 1.0).abs() < 1e-13);
            for overlap_m in [1e-9, 1e-4, 3e-3, 0.02] {
                // Logarithms of k_0 and delta_0 cost a few of the last digits.
                assert!((law.at(overlap_m).force_n / power.force_n(overlap_m) - 1.0).abs() < 1e-13);
                let stiffness = power.stiffness_n_per_m(overlap_m);
                assert!((law.at(overlap_m).stiffness_n_per_m / stiffness - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_force() {
        for p in [-0.3, 0.0, 1e-6, 0.114, 0.9, 1.0, 2.0] {
            let law = Law { ln_k_0: 7.3, ln_delta_0: -6.0, p };
            for overlap_m in [1e-5, 1e-3, 1e-2] {
                let h = 1e-5;
                let difference =
                    |up: Law, down: Law| (up.at(overlap_m).force_n - down.at(overlap_m).force_n) / (2.0 * h);
                let found = law.at(overlap_m);
                let by_k = difference(Law { ln_k_0: 7.3 + h, ..law }, Law { ln_k_0: 7.3 - h, ..law });
                let by_delta =
                    difference(Law { ln_delta_0: -6.0 + h, ..law }, Law { ln_delta_0: -6.0 - h, ..law });
                let by_p = difference(Law { p: p + h, ..law }, Law { p: p - h, ..law });
                // Central differences of step 1e-5: 1e-10 of the curvature, and rounding of 1e-16 / 1e-5 of the force.
                let tolerance = 1e-9 * found.force_n;
                assert!((found.by_ln_k_0 - by_k).abs() < tolerance, "{p} {overlap_m}");
                assert!((found.by_ln_delta_0 - by_delta).abs() < tolerance, "{p} {overlap_m}");
                assert!((found.by_p - by_p).abs() < tolerance, "{p} {overlap_m}");
            }
        }
    }

    #[test]
    fn the_slope_term_is_continuous_where_the_series_ends() {
        for z in [-0.5, 0.5] {
            let (inside, outside) = (slope_term(z), slope_term(z * (1.0 + 1e-12)));
            // A relative step of 1e-12, and 16 digits less the one that the closed form cancels.
            assert!((inside - outside).abs() < 1e-11, "{z}: {inside} {outside}");
        }
    }
}
