use std::f64::consts::LN_2;

use crate::PowerLaw;

/// Terms of the binomial series of the energy; at the series' limit the rest is below 1e-16 of the sum.
const TERMS: usize = 12;
/// Terms that the force needs below its own, smaller limit.
const FORCE_TERMS: usize = 8;
/// Where the force leaves its series, in y = Delta / delta_0 (times p, where p > 1).
const FORCE_LIMIT: f64 = 1.0 / 128.0;
/// Where the energy leaves its series: above it, the closed form loses less than two digits.
const ENERGY_LIMIT: f64 = 0.05;

/// The power law with all that depends on its parameters alone worked out, for the inner loop.
///
/// With y = Delta / delta_0 the force is f_0 E(y), E = (1 + y)^p - 1, and the energy f_0 delta_0 G(y), where G is the
/// integral of E. Each has a form for each range of y that loses no digits:
///
/// - small y: the binomial series of E and, term by term, of G;
/// - else, while |p ln(1 + y)| < ln 2: E = expm1(p log1p(y)), where below y = -1/2 the logarithm is taken of
///   (Delta + delta_0) / delta_0, a difference that is exact;
/// - else the power minus 1, which no longer cancels;
/// - G = ((1 + y) E - p y) / (1 + p), from integration by parts. Against the textbook form it keeps the factor p that
///   both terms share, so that only the factor y is lost to cancellation, and it costs no second power.
#[derive(Debug, Clone)]
pub(crate) struct PowerKernel {
    p: f64,
    delta_0_m: f64,
    inverse_delta_0_per_m: f64,
    f_0_n: f64,
    force_limit: f64,
    energy_limit: f64,
    force_series: [f64; TERMS],
    energy_series: [f64; TERMS],
    tangent: Tangent,
}

/// The continuation in tension: E and G at the limit, and the slope of E there.
#[derive(Debug, Clone, Copy)]
struct Tangent {
    y: f64,
    force: f64,
    energy: f64,
    slope: f64,
}

impl PowerKernel {
    /// The kernel of a law that goes on along its tangent from [`PowerLaw::TENSION_LIMIT`].
    pub(crate) fn new(law: &PowerLaw) -> Self {
        Self::continued_from(law, PowerLaw::TENSION_LIMIT)
    }

    /// The kernel of a law that goes on along its tangent from `y_limit`, in (-1, 0).
    fn continued_from(law: &PowerLaw, y_limit: f64) -> Self {
        let p = law.p;
        let force_series = binomial_series(p);
        let steepness = p.max(1.0);
        let mut kernel = Self {
            p,
            delta_0_m: law.delta_0_m,
            inverse_delta_0_per_m: law.delta_0_m.recip(),
            f_0_n: law.f_0_n(),
            force_limit: FORCE_LIMIT / steepness,
            energy_limit: ENERGY_LIMIT / steepness,
            force_series,
            energy_series: std::array::from_fn(|k| force_series[k] / (k as f64 + 2.0)),
            tangent: Tangent { y: y_limit, force: 0.0, energy: 0.0, slope: 0.0 },
        };
        let s = 1.0 + y_limit;
        let force = kernel.power_minus_one(y_limit, s);
        let energy = kernel.relative_energy(y_limit, s, force);
        kernel.tangent = Tangent { y: y_limit, force, energy, slope: p * s.powf(p - 1.0) };
        kernel
    }

    /// Contact force in newtons at an overlap in metres.
    #[inline]
    pub(crate) fn force_n(&self, overlap_m: f64) -> f64 {
        let y = overlap_m * self.inverse_delta_0_per_m;
        if y < self.tangent.y {
            return self.f_0_n * self.tangent.force_at(y);
        }
        self.f_0_n * self.relative_force(y, overlap_m)
    }

    /// Force in newtons and energy in joules at an overlap in metres.
    #[inline]
    pub(crate) fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        let y = overlap_m * self.inverse_delta_0_per_m;
        let (force, energy) = if y < self.tangent.y {
            (self.tangent.force_at(y), self.tangent.energy_at(y))
        } else {
            let force = self.relative_force(y, overlap_m);
            (force, self.relative_energy(y, self.shifted(overlap_m), force))
        };
        (self.f_0_n * force, self.f_0_n * self.delta_0_m * energy)
    }

    /// Overlap in metres below which the tangent holds.
    pub(crate) fn tension_limit_m(&self) -> f64 {
        self.tangent.y * self.delta_0_m
    }

    /// 1 + y without the rounding of y.
    #[inline]
    fn shifted(&self, overlap_m: f64) -> f64 {
        (overlap_m + self.delta_0_m) * self.inverse_delta_0_per_m
    }

    /// E(y) inside the law's range.
    #[inline]
    fn relative_force(&self, y: f64, overlap_m: f64) -> f64 {
        if y.abs() < self.force_limit {
            return y * horner(&self.force_series[..FORCE_TERMS], y);
        }
        self.power_minus_one(y, self.shifted(overlap_m))
    }

    /// E(y) away from y = 0, with s = 1 + y.
    #[inline]
    fn power_minus_one(&self, y: f64, s: f64) -> f64 {
        let logarithm = if y < -0.5 { s.ln() } else { y.ln_1p() };
        let exponent = self.p * logarithm;
        if exponent.abs() < LN_2 { exponent.exp_m1() } else { s.powf(self.p) - 1.0 }
    }

    /// G(y) from E(y), with s = 1 + y.
    #[inline]
    fn relative_energy(&self, y: f64, s: f64, force: f64) -> f64 {
        if y.abs() < self.energy_limit {
            return y * y * horner(&self.energy_series, y);
        }
        (s * force - self.p * y) / (1.0 + self.p)
    }
}

impl Tangent {
    #[inline]
    fn force_at(&self, y: f64) -> f64 {
        self.force + self.slope * (y - self.y)
    }

    #[inline]
    fn energy_at(&self, y: f64) -> f64 {
        let beyond = y - self.y;
        self.energy + beyond * (self.force + 0.5 * self.slope * beyond)
    }
}

/// Coefficients of y, y^2, ... in (1 + y)^p - 1.
fn binomial_series(p: f64) -> [f64; TERMS] {
    let mut coefficient = 1.0;
    std::array::from_fn(|k| {
        coefficient *= (p - k as f64) / (k as f64 + 1.0);
        coefficient
    })
}

/// The polynomial of the given coefficients, lowest first, at `y`.
#[inline]
fn horner(coefficients: &[f64], y: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, &coefficient| sum * y + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force and energy at 50 digits (mpmath) for the exact values of the doubles given: p, overlap, force, energy, with
    /// a = 60.1 and delta_0 = 2.27e-3.
    const REFERENCE: &str = include_str!("../tests/contact_reference.csv");

    fn rows() -> impl Iterator<Item = [f64; 4]> {
        REFERENCE.lines().skip(1).map(|line| {
            let mut values = line.split(',').map(|value| value.parse::<f64>().unwrap());
            std::array::from_fn(|_| values.next().unwrap())
        })
    }

    /// The bounds are the project's targets. About 6 roundings stand behind a force; the energy's closed form loses a
    /// factor 2 / y <= 40 where it takes over from the series.
    #[test]
    fn force_and_energy_keep_their_digits_over_24_decades() {
        let mut n_rows = 0;
        for [p, overlap_m, force_n, energy_j] in rows() {
            let law = PowerLaw::new(60.1, 2.27e-3, p).unwrap();
            let kernel = PowerKernel::continued_from(&law, -1.0 + 5e-13);
            let (force, energy) = kernel.force_and_energy(overlap_m);
            assert!(
                (force / force_n - 1.0).abs() <= 2e-15,
                "p {p}, overlap {overlap_m}: force {force}, {force_n}"
            );
            assert!(
                (energy / energy_j - 1.0).abs() <= 1e-13,
                "p {p}, overlap {overlap_m}: {energy}, {energy_j}"
            );
            assert!((force - kernel.force_n(overlap_m)).abs() == 0.0);
            n_rows += 1;
        }
        assert!(n_rows > 100);
    }

    #[test]
    fn exponent_one_is_a_linear_spring() {
        let kernel = PowerKernel::new(&PowerLaw::new(1500.0, 2e-3, 1.0).unwrap());
        for overlap_m in [-1.0, -1e-3, 1e-9, 1e-4, 3e-3, 1.0] {
            let (force, energy) = kernel.force_and_energy(overlap_m);
            assert!((force / (1500.0 * overlap_m) - 1.0).abs() < 1e-14);
            assert!((energy / (750.0 * overlap_m * overlap_m) - 1.0).abs() < 1e-13);
        }
    }
}
