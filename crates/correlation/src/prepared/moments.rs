//! Sums over a subset's pixels of the product of two images with the monomials of the place: what the normal equations
//! of a polynomial shape function consist of.

use pulp::Simd;

use crate::simd::{InBlocks, LANES, sum_of_lanes};

/// Monomials up to the fourth order in x and y.
pub(crate) const MAX_MONOMIALS: usize = 15;

/// The place of `x^i y^j` in the order 1, x, y, x^2, xy, y^2, x^3 and so on.
pub(crate) const fn monomial(i: usize, j: usize) -> usize {
    let order = i + j;
    order * (order + 1) / 2 + j
}

/// Exponents of x and y of the terms of a shape function.
pub(crate) const TERMS: [[usize; 2]; 6] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]];

/// The monomial one order below, and whether x or y (0 or 1) makes this one of it.
pub(crate) const fn parent(monomial: usize) -> (usize, usize) {
    let mut order = 1;
    while (order + 1) * (order + 2) / 2 <= monomial {
        order += 1;
    }
    let place = monomial - order * (order + 1) / 2;
    let before = order * (order - 1) / 2;
    if place == 0 { (before, 0) } else { (before + place - 1, 1) }
}

/// Column and row of each pixel relative to the centre, padded to whole vectors by zeros.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a> {
    pub(crate) columns: &'a [f32],
    pub(crate) rows: &'a [f32],
}

/// The sums over all pixels of `a b` times the first `n` monomials, and perhaps more: 1, 3, 6 or 15 are summed.
pub(crate) fn moments(places: Places<'_>, a: &[f32], b: &[f32], n: usize) -> [f64; MAX_MONOMIALS] {
    match n {
        1 => Moments::<1> { places, a, b }.dispatch(),
        2..=3 => Moments::<3> { places, a, b }.dispatch(),
        4..=6 => Moments::<6> { places, a, b }.dispatch(),
        _ => Moments::<MAX_MONOMIALS> { places, a, b }.dispatch(),
    }
}

struct Moments<'a, const N: usize> {
    places: Places<'a>,
    a: &'a [f32],
    b: &'a [f32],
}

impl<const N: usize> InBlocks for Moments<'_, N> {
    type Output = [f64; MAX_MONOMIALS];

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> [f64; MAX_MONOMIALS] {
        let zeros = [simd.splat_f32s(0.0); VECTORS];
        let mut sums = [zeros; N];
        let [a, b, columns, rows] = [self.a, self.b, self.places.columns, self.places.rows]
            .map(|values| S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0);
        for ((a, b), (x, y)) in a.iter().zip(b).zip(columns.iter().zip(rows)) {
            for i in 0..VECTORS {
                let mut terms = [simd.mul_f32s(a[i], b[i]); N];
                sums[0][i] = simd.add_f32s(sums[0][i], terms[0]);
                for term in 1..N {
                    let (before, axis) = const { PARENTS }[term];
                    terms[term] = simd.mul_f32s(terms[before], if axis == 0 { x[i] } else { y[i] });
                    sums[term][i] = simd.add_f32s(sums[term][i], terms[term]);
                }
            }
        }
        let mut totals = [0.0; MAX_MONOMIALS];
        for (total, vectors) in totals.iter_mut().zip(&sums) {
            let mut lanes = [0.0; LANES];
            lanes.copy_from_slice(pulp::bytemuck::cast_slice(vectors));
            *total = sum_of_lanes(lanes);
        }
        totals
    }
}

/// [`parent`] of each monomial but the first.
pub(crate) const PARENTS: [(usize, usize); MAX_MONOMIALS] = {
    let mut parents = [(0, 0); MAX_MONOMIALS];
    let mut i = 1;
    while i < MAX_MONOMIALS {
        parents[i] = parent(i);
        i += 1;
    }
    parents
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_the_plain_sums_with_the_same_bits_everywhere() {
        let n = 96;
        let value = |i: usize, k: usize| ((i * k) % 17) as f32 / 8.0 - 1.0;
        let image = |k: usize| (0..n).map(|i| if i < 90 { value(i, k) } else { 0.0 }).collect::<Vec<_>>();
        let (a, b, columns, rows) = (image(7), image(5), image(3), image(11));
        let places = Places { columns: &columns, rows: &rows };
        let found = moments(places, &a, &b, MAX_MONOMIALS);
        let scalar = Moments::<MAX_MONOMIALS> { places, a: &a, b: &b }.scalar();
        assert_eq!(found.map(f64::to_bits), scalar.map(f64::to_bits));
        for i in 0..=4_usize {
            for j in 0..=4 - i {
                let term = |k: usize| {
                    f64::from(a[k] * b[k])
                        * f64::from(columns[k]).powi(i as i32)
                        * f64::from(rows[k]).powi(j as i32)
                };
                let expected: f64 = (0..n).map(term).sum();
                assert!((found[monomial(i, j)] - expected).abs() < 1e-4, "f32 sums of six terms of about 1");
            }
        }
    }
}
