//! Sums over a subset's pixels of the product of two images with the monomials of the place: what the normal equations
//! of a polynomial shape function consist of.

use pulp::Simd;

use crate::simd::{InBlocks, first_ones, load, total};

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

/// The rectangle of a subset's pixels.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Column and row of each pixel relative to the centre, filled up as all images are ([`crate::simd::padded`]).
    pub(crate) columns: &'a [f32],
    pub(crate) rows: &'a [f32],
}

/// The sums over all pixels of products of two images with a monomial, by monomial; those of higher orders than were asked for are 0.
pub(crate) type Moments = [f64; MAX_MONOMIALS];

/// The moments up to an order (0, 1, 2 or 4) of the products of an image with others.
pub(crate) fn moments<const N: usize>(
    places: Places<'_>,
    image: &[f32],
    others: [&[f32]; N],
    order: usize,
) -> [Moments; N] {
    match order {
        0 => Summation::<N, 1, 1> { places, image, others }.dispatch(),
        1 => Summation::<N, 2, 3> { places, image, others }.dispatch(),
        2 => Summation::<N, 3, 6> { places, image, others }.dispatch(),
        _ => Summation::<N, 5, MAX_MONOMIALS> { places, image, others }.dispatch(),
    }
}

/// The moments with powers below `POWERS`, of which so many monomials consist.
struct Summation<'a, const N: usize, const POWERS: usize, const MONOMIALS: usize> {
    places: Places<'a>,
    image: &'a [f32],
    others: [&'a [f32]; N],
}

impl<const N: usize, const POWERS: usize, const MONOMIALS: usize> InBlocks
    for Summation<'_, N, POWERS, MONOMIALS>
{
    type Output = [Moments; N];

    /// A vector's columns are summed down all rows, times powers of the row, and these sums multiplied with powers of the column.
    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> [Moments; N] {
        let Self { places: Places { width, height, columns, rows }, image, others } = self;
        let zero = simd.splat_f32s(0.0);
        let mut totals = [[[zero; VECTORS]; MONOMIALS]; N];
        for (i, first) in (0..width).step_by(S::F32_LANES).enumerate() {
            let inside = first_ones::<S>(width - first);
            let mut sums = [[zero; POWERS]; N];
            for row in 0..height {
                let at = row * width + first;
                let value = simd.mul_f32s(inside, load::<S>(&image[at..]));
                let y = simd.splat_f32s(rows[row * width]);
                for (sums, other) in sums.iter_mut().zip(others) {
                    let mut term = simd.mul_f32s(value, load::<S>(&other[at..]));
                    sums[0] = simd.add_f32s(sums[0], term);
                    for sum in &mut sums[1..] {
                        term = simd.mul_f32s(term, y);
                        *sum = simd.add_f32s(*sum, term);
                    }
                }
            }
            let x = load::<S>(&columns[first..]);
            for (totals, sums) in totals.iter_mut().zip(sums) {
                for (y_power, mut term) in sums.into_iter().enumerate() {
                    for x_power in 0..POWERS - y_power {
                        let total = &mut totals[monomial(x_power, y_power)][i % VECTORS];
                        *total = simd.add_f32s(*total, term);
                        term = simd.mul_f32s(term, x);
                    }
                }
            }
        }
        let mut moments = [[0.0; MAX_MONOMIALS]; N];
        for (moments, totals) in moments.iter_mut().zip(&totals) {
            for (moment, vectors) in moments.iter_mut().zip(totals) {
                *moment = total::<S, VECTORS>(vectors);
            }
        }
        moments
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
    use crate::simd::padded;

    #[test]
    fn moments_are_the_plain_sums_with_the_same_bits_everywhere() {
        for (width, height) in [(1, 1), (7, 12), (16, 3), (33, 5)] {
            let n = width * height;
            let value = |i: usize, k: usize| ((i * k) % 17) as f32 / 8.0 - 1.0;
            let image = |k: usize| padded((0..n).map(|i| value(i, k)));
            let columns = padded((0..n).map(|i| (i % width) as f32 / width as f32 - 0.4));
            let rows = padded((0..n).map(|i| (i / width) as f32 / height as f32 - 0.6));
            let places = Places { width, height, columns: &columns, rows: &rows };
            let (a, b, c) = (image(7), image(5), image(3));
            let found = moments(places, &a, [&b, &c], 4);
            let scalar = Summation::<2, 5, MAX_MONOMIALS> { places, image: &a, others: [&b, &c] }.scalar();
            assert_eq!(found, scalar);
            for (i, j) in (0..=4_usize).flat_map(|i| (0..=4 - i).map(move |j| (i, j))) {
                for (found, other) in found.iter().zip([&b, &c]) {
                    let term = |k: usize| {
                        f64::from(a[k] * other[k])
                            * f64::from(columns[k]).powi(i as i32)
                            * f64::from(rows[k]).powi(j as i32)
                    };
                    let expected: f64 = (0..n).map(term).sum();
                    assert!(
                        (found[monomial(i, j)] - expected).abs() < 1e-5,
                        "f32 sums of a dozen terms below 1"
                    );
                }
            }
        }
    }
}
