//! The interpolation kernels: B-splines and MOMS, and the weights of their taps.
//!
//! A kernel of degree n is the B-spline of that degree plus multiples of its even derivatives: a MOMS, which reproduces
//! every polynomial of degree n as the B-spline does, at the same cost (T. Blu, P. Thevenaz, M. Unser: MOMS, IEEE
//! Trans. Image Process. 10 (2001) 1069-1080). That paper chooses the multiples for the least error of the image. A
//! displacement is blind to most of that error: it sees only the part that is odd under a mirroring of the image.
//! With the kernel's spectrum `sinc^(n+1) P(w)`, the spectrum's first alias at 2 pi turns a component of low frequency
//! w into an odd error of order `w^(n+2)`, proportional to the derivative of `P(w)/w^(n+1)` at `w = 2 pi`. For degree
//! 3 that is zero where the multiple of the second derivative is `1/(2 pi^2)`; 1/18 does as well over the frequencies
//! that speckles have, and puts the pole at -1/2. For degree 5 the multiples 11/200 and 1/2000 were found in the same
//! way by a search over speckles of 3.5 to 6 px.
//!
//! Bias over phases by the spectrum of Gaussian speckle whose autocorrelation is 3.7, 4.5 and 6.3 px wide at half
//! height, peak to peak (in the manner of Y. Su et al., Opt. Express 23 (2015) 19242-19260):
//! cubic B-spline 4.9, 2.0, 0.49 mpx; cubic o-MOMS 3.4, 1.3, 0.29; cubic here 1.2, 0.28, 0.07; quintic B-spline 0.83,
//! 0.20, 0.02; quintic o-MOMS 0.49, 0.10, 0.01; septic B-spline 0.21, 0.03, 0.001; quintic here 0.21, 0.02, 0.002.

use pulp::Simd;

/// A kernel of `TAPS` coefficients along one axis.
pub(crate) trait Kernel<const TAPS: usize> {
    /// Multiples of the B-spline's second and fourth derivative that are added to it.
    const DERIVATIVES: [f64; 2];

    /// The weights of the taps.
    const WEIGHTS: Weights = Weights::new(&pieces::<TAPS>(Self::DERIVATIVES));
}

/// The B-spline of degree `TAPS - 1`.
pub(crate) struct BSpline;
/// The MOMS of degree `TAPS - 1` with little bias.
pub(crate) struct Moms;

impl<const TAPS: usize> Kernel<TAPS> for BSpline {
    const DERIVATIVES: [f64; 2] = [0.0; 2];
}

impl Kernel<4> for Moms {
    const DERIVATIVES: [f64; 2] = [1.0 / 18.0, 0.0];
}

impl Kernel<6> for Moms {
    const DERIVATIVES: [f64; 2] = [11.0 / 200.0, 1.0 / 2000.0];
}

/// Half of the most taps.
const MAX_HALF: usize = 3;

/// The weights of the taps at the fraction t of a pixel as polynomials in `s = t - 1/2`. The tap j and its mirror
/// image are `even[j](s^2) + s odd[j](s^2)` and the same with a minus, so one evaluation gives both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weights {
    even: [[f32; MAX_HALF]; MAX_HALF],
    odd: [[f32; MAX_HALF]; MAX_HALF],
}

impl Weights {
    const fn new<const TAPS: usize>(pieces: &[[f64; TAPS]; TAPS]) -> Self {
        let mut even = [[0.0; MAX_HALF]; MAX_HALF];
        let mut odd = [[0.0; MAX_HALF]; MAX_HALF];
        let mut tap = 0;
        while 2 * tap < TAPS {
            let mut order = 0;
            while order < TAPS {
                let mut coefficient = 0.0;
                let mut power = order;
                while power < TAPS {
                    coefficient += pieces[tap][power] * binomial(power, order) * power_of(0.5, power - order);
                    power += 1;
                }
                let to = if order % 2 == 0 { &mut even[tap] } else { &mut odd[tap] };
                to[order / 2] = coefficient as f32;
                order += 1;
            }
            tap += 1;
        }
        Self { even, odd }
    }

    /// The weights of the taps at a fraction of a pixel.
    #[inline(always)]
    pub(crate) fn at<const TAPS: usize>(&self, t: f32) -> [f32; TAPS] {
        let half = TAPS / 2;
        let s = t - 0.5;
        let square = s * s;
        let mut weights = [0.0; TAPS];
        for tap in 0..half {
            let (mut even, mut odd) = (self.even[tap][half - 1], self.odd[tap][half - 1]);
            for power in (0..half - 1).rev() {
                even = even.mul_add(square, self.even[tap][power]);
                odd = odd.mul_add(square, self.odd[tap][power]);
            }
            weights[tap] = odd.mul_add(s, even);
            weights[TAPS - 1 - tap] = odd.mul_add(-s, even);
        }
        weights
    }
}

impl Weights {
    /// [`Weights::at`] for a vector of fractions.
    #[inline(always)]
    pub(crate) fn at_all<S: Simd, const TAPS: usize>(&self, simd: S, t: S::f32s) -> [S::f32s; TAPS] {
        let half = TAPS / 2;
        let s = simd.sub_f32s(t, simd.splat_f32s(0.5));
        let square = simd.mul_f32s(s, s);
        let mut weights = [s; TAPS];
        for tap in 0..half {
            let constant = |value: f32| simd.splat_f32s(value);
            let (mut even, mut odd) = (constant(self.even[tap][half - 1]), constant(self.odd[tap][half - 1]));
            for power in (0..half - 1).rev() {
                even = simd.mul_add_f32s(even, square, constant(self.even[tap][power]));
                odd = simd.mul_add_f32s(odd, square, constant(self.odd[tap][power]));
            }
            weights[tap] = simd.mul_add_f32s(odd, s, even);
            weights[TAPS - 1 - tap] = simd.mul_add_f32s(odd, simd.neg_f32s(s), even);
        }
        weights
    }
}

/// The polynomial pieces of a kernel: entry `[tap][power]` is the coefficient of `t^power` in the weight of the
/// coefficient at `floor(x) + 1 - TAPS/2 + tap`, where `t = x - floor(x)`.
///
/// Weight of tap j of the B-spline of degree n: `1/n! sum_k (-1)^k C(n+1, k) (t + n - j - k)^n` over `k` from 0 to
/// `n - j` (M. Unser, A. Aldroubi, M. Eden: B-spline signal processing, IEEE Trans. Signal Process. 41 (1993) 821-848,
/// eq. 2.2).
const fn pieces<const TAPS: usize>(derivatives: [f64; 2]) -> [[f64; TAPS]; TAPS] {
    let mut table = [[0.0; TAPS]; TAPS];
    let mut tap = 0;
    while tap < TAPS {
        let mut spline = [0.0; TAPS];
        let mut power = 0;
        while power < TAPS {
            spline[power] = spline_coefficient(TAPS - 1, tap, power);
            power += 1;
        }
        power = 0;
        while power < TAPS {
            table[tap][power] = spline[power];
            let mut order = 1;
            while order <= 2 && power + 2 * order < TAPS {
                let from = power + 2 * order;
                let slope = factorial(from) / factorial(power);
                table[tap][power] += derivatives[order - 1] * slope * spline[from];
                order += 1;
            }
            power += 1;
        }
        tap += 1;
    }
    table
}

const fn spline_coefficient(degree: usize, tap: usize, power: usize) -> f64 {
    let mut sum = 0.0;
    let mut k = 0;
    while k + tap <= degree {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let shift = (degree - tap - k) as f64;
        sum += sign * binomial(degree + 1, k) * binomial(degree, power) * power_of(shift, degree - power);
        k += 1;
    }
    sum / factorial(degree)
}

const fn power_of(base: f64, exponent: usize) -> f64 {
    let mut result = 1.0;
    let mut i = 0;
    while i < exponent {
        result *= base;
        i += 1;
    }
    result
}

const fn factorial(n: usize) -> f64 {
    let mut result = 1.0;
    let mut i = 2;
    while i <= n {
        result *= i as f64;
        i += 1;
    }
    result
}

const fn binomial(n: usize, k: usize) -> f64 {
    factorial(n) / (factorial(k) * factorial(n - k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_weights_are_the_known_ones() {
        for t in [0.0_f32, 0.3, 0.5, 1.0] {
            let weights: [f32; 4] = <BSpline as Kernel<4>>::WEIGHTS.at(t);
            let u = 1.0 - t;
            let inner = |t: f32| (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
            let expected = [u * u * u / 6.0, inner(t), inner(u), t * t * t / 6.0];
            for (found, expected) in weights.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-7, "two units in the last place of f32");
            }
        }
    }

    #[test]
    fn weights_sum_to_one() {
        fn check<K: Kernel<TAPS>, const TAPS: usize>() {
            for t in [0.0, 0.37, 0.9] {
                let sum: f32 = K::WEIGHTS.at::<TAPS>(t).iter().sum();
                assert!((sum - 1.0).abs() < 1e-6, "{TAPS} taps: {sum}");
            }
        }
        check::<BSpline, 2>();
        check::<BSpline, 4>();
        check::<BSpline, 6>();
        check::<Moms, 4>();
        check::<Moms, 6>();
    }
}
