//! Force and energy of the power law for single gaps, to the last digits.

use pulp::{Simd, WithSimd};

use super::{
    power::PowerLaw,
    power_lanes::{COLUMNS, PowerLanes},
    tension::Tension,
};
use crate::lanes::{Lanes, PADDING};

/// The power law with all that depends on its parameters alone worked out; [`PowerLanes`] is its formula.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerKernel {
    p: f64,
    pub(super) delta_0_m: f64,
    pub(super) inverse_delta_0_per_m: f64,
    pub(super) f_0_n: f64,
    limit_m: f64,
    /// dE/dDelta below the limit.
    slope_per_m: f64,
    /// Overlap below which the contact has opened and E stays at -1; minus infinity where it never opens.
    open_below_m: f64,
}

impl PowerKernel {
    pub(crate) fn new(law: &PowerLaw, tension: Tension) -> Self {
        let (limit, slope, open_below_m) = match tension {
            Tension::Tangent { limit } => (limit, law.p * (1.0 + limit).powf(law.p - 1.0), f64::NEG_INFINITY),
            // The next number above -delta_0: there itself the logarithm does not exist.
            Tension::Detach => (-1.0, 0.0, (-law.delta_0_m).next_up()),
        };
        Self {
            p: law.p,
            delta_0_m: law.delta_0_m,
            inverse_delta_0_per_m: law.delta_0_m.recip(),
            f_0_n: law.f_0_n(),
            limit_m: limit * law.delta_0_m,
            slope_per_m: slope / law.delta_0_m,
            open_below_m,
        }
    }

    /// Overlap in metres below which the tension rule holds.
    pub(crate) fn limit_m(&self) -> f64 {
        self.limit_m
    }

    /// Contact force in newtons at an overlap in metres.
    pub(crate) fn force_n(&self, overlap_m: f64) -> f64 {
        self.forces_n([overlap_m; PADDING])[0]
    }

    /// Contact forces in newtons at overlaps in metres.
    pub(crate) fn forces_n(&self, overlaps_m: [f64; PADDING]) -> [f64; PADDING] {
        chainwave_vectors::dispatch(KernelForces { kernel: self, overlaps_m })
    }

    /// Stiffness in newtons per metre at an overlap in metres with its force in newtons, without a power.
    #[inline(always)]
    pub(crate) fn stiffness_n_per_m(&self, overlap_m: f64, force_n: f64) -> f64 {
        if overlap_m < self.open_below_m {
            return 0.0;
        }
        if overlap_m < self.limit_m {
            return self.f_0_n * self.slope_per_m;
        }
        self.p * (force_n + self.f_0_n) / (overlap_m + self.delta_0_m)
    }

    /// Force in newtons and energy in joules at an overlap in metres.
    pub(crate) fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        chainwave_vectors::dispatch(OneGap { kernel: self, overlap_m })
    }

    /// E at an overlap in metres inside the law's range.
    pub(super) fn power_minus_one(&self, overlap_m: f64) -> f64 {
        chainwave_vectors::dispatch(OnePower { kernel: self, overlap_m })
    }

    #[inline(always)]
    pub(super) fn columns(&self) -> [f64; COLUMNS] {
        [
            self.p,
            self.delta_0_m,
            self.inverse_delta_0_per_m,
            self.f_0_n,
            self.limit_m,
            self.slope_per_m,
            self.open_below_m,
        ]
    }
}

impl PowerLaw {
    /// Contact force in newtons, positive in compression, at an overlap in metres.
    pub fn force_n(&self, overlap_m: f64) -> f64 {
        PowerKernel::new(self, Tension::default()).force_n(overlap_m)
    }

    /// Potential energy in joules, the integral of the force from zero overlap.
    pub fn energy_j(&self, overlap_m: f64) -> f64 {
        PowerKernel::new(self, Tension::default()).force_and_energy(overlap_m).1
    }
}

struct OneGap<'a> {
    kernel: &'a PowerKernel,
    overlap_m: f64,
}

impl WithSimd for OneGap<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f64, f64) {
        let law = PowerLanes::splat(simd, self.kernel.columns());
        let (force, energy) = law.force_and_energy(Lanes::<S, 1>::splat(simd, self.overlap_m));
        (force.first(), energy.first())
    }
}

struct KernelForces<'a> {
    kernel: &'a PowerKernel,
    overlaps_m: [f64; PADDING],
}

impl WithSimd for KernelForces<'_> {
    type Output = [f64; PADDING];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; PADDING] {
        let Self { kernel, mut overlaps_m } = self;
        let law = PowerLanes::<S, 1>::splat(simd, kernel.columns());
        for vector in S::as_mut_simd_f64s(&mut overlaps_m).0 {
            [*vector] = law.force(Lanes::new(simd, [*vector])).values();
        }
        overlaps_m
    }
}

struct OnePower<'a> {
    kernel: &'a PowerKernel,
    overlap_m: f64,
}

impl WithSimd for OnePower<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let law = PowerLanes::splat(simd, self.kernel.columns());
        law.power_minus_one(Lanes::<S, 1>::splat(simd, self.overlap_m)).first()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force and energy at 50 digits (mpmath) for the exact values of the doubles given: p, overlap, force, energy, with
    /// a = 60.1 and delta_0 = 2.27e-3.
    const REFERENCE: &str = include_str!("../../tests/contact_reference.csv");

    fn rows() -> impl Iterator<Item = [f64; 4]> {
        REFERENCE.lines().skip(1).map(|line| {
            let mut values = line.split(',').map(|value| value.parse::<f64>().unwrap());
            std::array::from_fn(|_| values.next().unwrap())
        })
    }

    /// The bounds are the project's targets. About 8 roundings stand behind a force; the energy's closed form loses a
    /// factor 2 / y <= 40 where it takes over from the series.
    #[test]
    fn force_and_energy_keep_their_digits_over_24_decades() {
        let mut n_rows = 0;
        for [p, overlap_m, force_n, energy_j] in rows() {
            let law = PowerLaw { p, ..PowerLaw::ELLIPTICAL_RING };
            let kernel = PowerKernel::new(&law, Tension::Tangent { limit: -1.0 + 5e-13 });
            let (force, energy) = kernel.force_and_energy(overlap_m);
            assert!(
                (force / force_n - 1.0).abs() <= 2e-15,
                "p {p}, overlap {overlap_m}: force {force}, {force_n}"
            );
            assert!(
                (energy / energy_j - 1.0).abs() <= 1e-13,
                "p {p}, overlap {overlap_m}: {energy}, {energy_j}"
            );
            n_rows += 1;
        }
        assert!(n_rows > 100);
    }

    #[test]
    fn stiffness_follows_from_the_force() {
        for tension in [Tension::default(), Tension::Detach] {
            let law = PowerLaw::ELLIPTICAL_RING;
            let kernel = PowerKernel::new(&law, tension);
            for overlap_m in [-3e-3, -2.2e-3, -2e-3, -1e-6, 0.0, 1e-12, 1e-3, 1e-2] {
                let found = kernel.stiffness_n_per_m(overlap_m, kernel.force_n(overlap_m));
                let truth = law.stiffness_under(tension, overlap_m);
                // Ten roundings, which near -delta_0 the sum with it makes forty of.
                assert!((found - truth).abs() <= 1e-14 * truth, "{tension:?} {overlap_m}: {found} {truth}");
            }
        }
    }

    /// Every instruction set that this machine has gives the same bits.
    #[test]
    fn vectors_of_any_width_give_the_same_bits() {
        struct Sweep<'a>(&'a PowerKernel);
        impl WithSimd for Sweep<'_> {
            type Output = Vec<(u64, u64)>;
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
                let law = PowerLanes::splat(simd, self.0.columns());
                let overlaps = (-400..2000).map(|i| 1e-5 * f64::from(i) + 1e-9);
                overlaps
                    .map(|overlap_m| law.force_and_energy(Lanes::<S, 1>::splat(simd, overlap_m)))
                    .map(|(force, energy)| (force.first().to_bits(), energy.first().to_bits()))
                    .collect()
            }
        }
        for (p, tension) in [(0.114, Tension::default()), (1.5, Tension::Detach), (3.0, Tension::default())] {
            let kernel = PowerKernel::new(&PowerLaw { p, ..PowerLaw::ELLIPTICAL_RING }, tension);
            let plain = Sweep(&kernel).with_simd(pulp::Scalar);
            assert_eq!(chainwave_vectors::dispatch(Sweep(&kernel)), plain);
            #[cfg(target_arch = "x86_64")]
            if let Some(avx2) = pulp::x86::V3::try_new() {
                assert_eq!(Simd::vectorize(avx2, Sweep(&kernel)), plain);
            }
        }
    }

    #[test]
    fn a_contact_that_detaches_carries_nothing_once_it_is_open() {
        for p in [0.01, 0.114, 1.5] {
            let law = PowerLaw { p, ..PowerLaw::ELLIPTICAL_RING };
            let kernel = PowerKernel::new(&law, Tension::Detach);
            for overlap_m in [-2.27e-3, -2.3e-3, -1.0] {
                let (force, energy) = kernel.force_and_energy(overlap_m);
                assert!((force / -law.f_0_n() - 1.0).abs() < 1e-15, "{p}");
                // What the spring gave up to the point where it opens, f_0 delta_0 p / (1 + p), and the work of -f_0.
                let given_j = law.f_0_n() * (2.27e-3 * p / (1.0 + p) - (overlap_m + 2.27e-3));
                assert!((energy / given_j - 1.0).abs() < 1e-14, "{p} {overlap_m} {energy} {given_j}");
            }
        }
    }

    #[test]
    fn exponent_one_is_a_linear_spring() {
        let kernel = PowerKernel::new(&PowerLaw::new(1500.0, 2e-3, 1.0).unwrap(), Tension::default());
        for overlap_m in [-1.0, -1e-3, 1e-9, 1e-4, 3e-3, 1.0] {
            let (force, energy) = kernel.force_and_energy(overlap_m);
            assert!((force / (1500.0 * overlap_m) - 1.0).abs() < 1e-14);
            assert!((energy / (750.0 * overlap_m * overlap_m) - 1.0).abs() < 1e-13);
        }
    }
}
