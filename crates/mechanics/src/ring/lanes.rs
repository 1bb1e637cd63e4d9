use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

/// A vector of values, one for each of several rings, with the instruction set that handles it.
///
/// Products are added with one rounding on every instruction set, so all give the same bits; where the machine has no
/// such instruction, the same is computed slowly.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    pub(crate) values: S::f64s,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, values: S::f64s) -> Self {
        Self { simd, values }
    }

    /// The first values of a slice that is long enough.
    #[inline(always)]
    pub(crate) fn load(simd: S, values: &[f64]) -> Self {
        Self::new(simd, S::as_simd_f64s(values).0[0])
    }

    /// Writes the values to the front of a slice that is long enough.
    #[inline(always)]
    pub(crate) fn store(self, values: &mut [f64]) {
        S::as_mut_simd_f64s(values).0[0] = self.values;
    }

    /// The same value for every ring.
    #[inline(always)]
    pub(crate) fn all(simd: S, value: f64) -> Self {
        Self { simd, values: simd.splat_f64s(value) }
    }

    /// Two values, each the same for every ring.
    #[inline(always)]
    pub(crate) fn pair(simd: S, values: [f64; 2]) -> [Self; 2] {
        [Self::all(simd, values[0]), Self::all(simd, values[1])]
    }

    /// self * factor + term
    #[inline(always)]
    pub(crate) fn mul_add(self, factor: Self, term: Self) -> Self {
        Self::new(self.simd, self.simd.mul_add_f64s(self.values, factor.values, term.values))
    }

    /// term - self * factor
    #[inline(always)]
    pub(crate) fn mul_sub_from(self, factor: Self, term: Self) -> Self {
        Self::new(self.simd, self.simd.negate_mul_add_f64s(self.values, factor.values, term.values))
    }

    /// The polynomial of seven coefficients, lowest first, given this value's square. By Estrin's scheme: its products
    /// depend on each other in a tree, which a processor works through in half the time of Horner's chain.
    #[inline(always)]
    pub(crate) fn polynomial_7(self, square: Self, coefficients: [f64; 7]) -> Self {
        let [c0, c1, c2, c3, c4, c5, c6] = coefficients;
        let fourth = square * square;
        let low = self.linear(c3, c2).mul_add(square, self.linear(c1, c0));
        let high = Self::all(self.simd, c6).mul_add(square, self.linear(c5, c4));
        high.mul_add(fourth, low)
    }

    /// The polynomial of four coefficients, lowest first, in the same way.
    #[inline(always)]
    pub(crate) fn polynomial_4(self, square: Self, coefficients: [f64; 4]) -> Self {
        let [c0, c1, c2, c3] = coefficients;
        self.linear(c3, c2).mul_add(square, self.linear(c1, c0))
    }

    /// slope * self + term
    #[inline(always)]
    fn linear(self, slope: f64, term: f64) -> Self {
        self.mul_add(Self::all(self.simd, slope), Self::all(self.simd, term))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self::new(self.simd, self.simd.sqrt_f64s(self.values))
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.max_f64s(self.values, other.values))
    }

    /// The largest of the rings' values.
    #[inline(always)]
    pub(crate) fn largest(self) -> f64 {
        self.simd.reduce_max_f64s(self.values)
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.add_f64s(self.values, other.values))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.sub_f64s(self.values, other.values))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.values, other.values))
    }
}

impl<S: Simd> Div for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.div_f64s(self.values, other.values))
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(self.simd, self.simd.neg_f64s(self.values))
    }
}
