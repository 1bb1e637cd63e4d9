//! The power law a ((Delta + delta_0)^p - delta_0^p): parameters and stiffness.

use super::tension::Tension;
use crate::{check, error::MechanicsError};

/// The power law of one gap, F(Delta) = a (Delta + delta_0)^p - f_0 with f_0 = a delta_0^p and overlap Delta.
///
/// It softens in compression for p < 1, is linear for p = 1 and stiffens for p > 1. The power has no real value below
/// Delta = -delta_0, and for p < 1 its stiffness grows without bound on the way there; [`Tension`] says how the law goes
/// on. The methods here follow [`Tension::default`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// Prefactor in N/m^p.
    pub a: f64,
    /// Offset of the overlap, in metres.
    pub delta_0_m: f64,
    /// Exponent.
    pub p: f64,
}

impl PowerLaw {
    /// The law fitted to one ring of the paper's chain, compressed pole to pole by up to 10 mm: 6 mN rms are left over (page "Physics" of
    /// the book). What is simulated without a law of its own, samples, tests and benches, takes this one.
    pub const ELLIPTICAL_RING: Self = Self { a: 60.1, delta_0_m: 2.27e-3, p: 0.114 };

    /// A law from its three parameters.
    ///
    /// # Errors
    /// [`MechanicsError::NotPhysical`] unless all three, and the force f_0 and stiffness k_0 that follow from them, are
    /// finite and above zero.
    pub fn new(a: f64, delta_0_m: f64, p: f64) -> Result<Self, MechanicsError> {
        let law = Self { a, delta_0_m, p };
        law.check()?;
        Ok(law)
    }

    /// The law of exponent `p` and offset `delta_0_m` whose stiffness at zero overlap is `k_0_n_per_m`.
    ///
    /// # Errors
    /// As for [`PowerLaw::new`].
    pub fn from_stiffness(k_0_n_per_m: f64, delta_0_m: f64, p: f64) -> Result<Self, MechanicsError> {
        Self::new(k_0_n_per_m * delta_0_m.powf(1.0 - p) / p, delta_0_m, p)
    }

    /// Tangent stiffness dF/dDelta in newtons per metre.
    pub fn stiffness_n_per_m(&self, overlap_m: f64) -> f64 {
        self.stiffness_under(Tension::default(), overlap_m)
    }

    /// Tangent stiffness dF/dDelta in newtons per metre under a tension rule.
    pub(crate) fn stiffness_under(&self, tension: Tension, overlap_m: f64) -> f64 {
        let y = overlap_m / self.delta_0_m;
        match tension {
            Tension::Detach if y <= -1.0 => 0.0,
            Tension::Detach => self.k_0_n_per_m() * (1.0 + y).powf(self.p - 1.0),
            Tension::Tangent { limit } => self.k_0_n_per_m() * (1.0 + y.max(limit)).powf(self.p - 1.0),
        }
    }

    /// The force f_0 = a delta_0^p that the law subtracts, in newtons.
    pub fn f_0_n(&self) -> f64 {
        self.a * self.delta_0_m.powf(self.p)
    }

    /// Tangent stiffness at zero overlap, k_0 = a p delta_0^(p - 1), in newtons per metre.
    pub fn k_0_n_per_m(&self) -> f64 {
        self.p * self.f_0_n() / self.delta_0_m
    }

    /// Refuses parameters that give no usable law; the fields are open, so a law is checked again before it is used.
    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        check::positive("contact a", self.a)?;
        check::positive("contact delta_0_m", self.delta_0_m)?;
        check::positive("contact p", self.p)?;
        check::positive("contact force f_0 = a delta_0^p", self.f_0_n())?;
        check::positive("contact stiffness k_0 = a p delta_0^(p - 1)", self.k_0_n_per_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The power law fitted to the ring's curve: within 6 mN rms, and 30 mN more for parameters of three digits.
    #[test]
    fn the_fitted_law_gives_the_rings_curve() {
        for (overlap_m, force_n) in [(0.51e-3, 0.70), (1.01e-3, 1.28), (3.0e-3, 3.04), (10.01e-3, 6.40)] {
            assert!((PowerLaw::ELLIPTICAL_RING.force_n(overlap_m) - force_n).abs() < 0.03);
        }
    }

    #[test]
    fn stiffness_and_force_are_the_derivatives_of_force_and_energy() {
        let law = PowerLaw::ELLIPTICAL_RING;
        for overlap_m in [-2.2e-3, -2.0e-3, -1e-3, 0.0, 1e-4, 5e-3] {
            let h = 1e-7;
            let slope = (law.force_n(overlap_m + h) - law.force_n(overlap_m - h)) / (2.0 * h);
            let power = (law.energy_j(overlap_m + h) - law.energy_j(overlap_m - h)) / (2.0 * h);
            // Central differences of step h/delta_0 = 4e-5, whose error near the limit is (h / 0.1 delta_0)^2.
            assert!((slope / law.stiffness_n_per_m(overlap_m) - 1.0).abs() < 1e-6, "{overlap_m} {slope}");
            assert!((power - law.force_n(overlap_m)).abs() < 1e-6, "{overlap_m} {power}");
        }
    }

    #[test]
    fn the_law_is_smooth_where_the_tangent_takes_over() {
        let law = PowerLaw::ELLIPTICAL_RING;
        let limit_m = -0.9 * law.delta_0_m;
        let step_m = 1e-9;
        let (below, above) = (limit_m - step_m, limit_m + step_m);
        // Across a step of 2 nm force and energy change by stiffness and force times the step, up to its square.
        let k = law.stiffness_n_per_m(limit_m);
        assert!((law.force_n(above) - law.force_n(below) - 2.0 * step_m * k).abs() < 1e-9);
        let work = 2.0 * step_m * law.force_n(limit_m);
        assert!((law.energy_j(above) - law.energy_j(below) - work).abs() < 1e-15);
        assert!(law.force_n(-1.0).is_finite() && law.energy_j(-1.0).is_finite());
    }

    #[test]
    fn a_law_from_its_stiffness_has_it() {
        let law = PowerLaw::from_stiffness(1474.0, 2.9e-3, 0.1).unwrap();
        assert!((law.k_0_n_per_m() / 1474.0 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn parameters_without_a_law_are_refused() {
        for (a, delta_0_m, p) in [
            (0.0, 1e-3, 0.1),
            (60.0, -1e-3, 0.1),
            (60.0, 1e-3, 0.0),
            (f64::NAN, 1e-3, 0.1),
            (1e300, 1e-12, 1e-3),
        ] {
            assert!(matches!(PowerLaw::new(a, delta_0_m, p), Err(MechanicsError::NotPhysical { .. })));
        }
    }
}
