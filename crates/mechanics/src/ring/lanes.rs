use std::ops::{Add, Mul, Neg, Sub};

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

    /// The same value for every ring.
    #[inline(always)]
    pub(crate) fn all(simd: S, value: f64) -> Self {
        Self { simd, values: simd.splat_f64s(value) }
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

    /// The polynomial of the given coefficients, highest first.
    #[inline(always)]
    pub(crate) fn polynomial<const N: usize>(self, coefficients: [f64; N]) -> Self {
        let mut sum = Self::all(self.simd, coefficients[0]);
        for coefficient in &coefficients[1..] {
            sum = sum.mul_add(self, Self::all(self.simd, *coefficient));
        }
        sum
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self::new(self.simd, self.simd.abs_f64s(self.values))
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

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(self.simd, self.simd.neg_f64s(self.values))
    }
}
