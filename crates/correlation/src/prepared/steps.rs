//! What a unit of each pixel's grey value displaces the centre of a subset by.

use pulp::Simd;

use crate::Shape;
use crate::prepared::linearised::Linearised;
use crate::simd::{InBlocks, LANES, first_ones, load, total};

/// How many pixels share the noise of one through the filter of the gradients: two along each axis, nearly.
const CORRELATED_PX: f64 = 4.0;

/// The displacements of the centre along x and y that a unit of each pixel's grey value makes, M^-1 Z' ([`crate::PreparedSubset`]), and the
/// grey values themselves.
#[derive(Default)]
pub(crate) struct Steps {
    pub(crate) width: usize,
    height: usize,
    /// The grey values, the steps along x and those along y: blocks of columns, each row by row, the last one filled up by
    /// zeros to whole vectors.
    images: [Vec<[f32; LANES]>; 3],
    sums: Sums,
}

/// Sums over the pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sums {
    /// Squares and fourth powers of the steps along x and y.
    squares: [f64; 2],
    fourth: [f64; 2],
    /// Products xx, xy and yy of two steps times the grey value.
    by_light: [f64; 3],
}

impl Steps {
    pub(crate) fn of(subset: &Linearised) -> Self {
        let mut steps = Self::default();
        steps.make(subset);
        steps
    }

    /// Makes those of a subset in place of others.
    pub(crate) fn make(&mut self, subset: &Linearised) {
        (self.width, self.height) = (subset.width, subset.height);
        let n = self.n_blocks() * self.height;
        self.images.iter_mut().for_each(|image| image.resize(n, [0.0; LANES]));
        let (recipes, images) = ([0, 1].map(|axis| Recipe::of(subset, axis)), &mut self.images);
        self.sums = match subset.settings.shape {
            Shape::Quadratic => Stepping::<3> { subset, recipes, images }.dispatch(),
            _ => Stepping::<2> { subset, recipes, images }.dispatch(),
        };
    }

    pub(crate) fn n_blocks(&self) -> usize {
        self.width.div_ceil(LANES)
    }

    /// The grey values, the steps along x and those along y in all rows of a block of columns.
    #[inline(always)]
    pub(crate) fn block(&self, block: usize) -> [&[[f32; LANES]]; 3] {
        self.images.each_ref().map(|image| &image[block * self.height..][..self.height])
    }

    /// The steps along x and y, pixel by pixel.
    pub(crate) fn by_pixel(&self) -> [Vec<f32>; 2] {
        let place = |i: usize| [i / self.width, i % self.width];
        let places = || (0..self.width * self.height).map(place);
        let value = |image: &[[f32; LANES]], [row, column]: [usize; 2]| {
            image[column / LANES * self.height + row][column % LANES]
        };
        [1, 2].map(|image| places().map(|place| value(&self.images[image], place)).collect())
    }

    /// How many pixels tell a displacement along x and y, by the participation of their squares; some share their gradients' noise.
    pub(crate) fn n_independent(&self) -> [f64; 2] {
        let Sums { squares, fourth, .. } = self.sums;
        [0, 1].map(|axis| squares[axis] * squares[axis] / fourth[axis] / CORRELATED_PX)
    }

    /// The sums over the pixels of two steps, xx, xy and yy, times the grey value.
    pub(crate) fn by_light(&self) -> [f64; 3] {
        self.sums.by_light
    }
}

/// What the steps along an axis are made of: the gradients times polynomials of the place, less multiples of 1 and of the grey values.
#[derive(Debug, Clone, Copy)]
struct Recipe {
    /// The coefficients of 1, x, y, x^2, xy, y^2 for the gradient along x and the one along y.
    polynomials: [[f32; 6]; 2],
    mean: f32,
    slope: f32,
}

impl Recipe {
    fn of(subset: &Linearised, axis: usize) -> Self {
        let row = &subset.inverse[axis * subset.settings.shape.n_terms()];
        let projected =
            |i: usize| subset.projections.iter().zip(row).map(|(p, m)| p[i] * m).sum::<f64>() as f32;
        let (mean, slope) = (projected(0), projected(1));
        Self { polynomials: subset.step_polynomials(axis), mean, slope }
    }

    /// The factors of 1, y and y^2 in both polynomials, at some columns.
    #[inline(always)]
    fn at_columns<S: Simd>(&self, simd: S, x: S::f32s) -> [[S::f32s; 3]; 2] {
        let mut factors = [[x; 3]; 2];
        for (factors, q) in factors.iter_mut().zip(&self.polynomials) {
            let q = q.map(|q| simd.splat_f32s(q));
            *factors = [
                simd.mul_add_f32s(simd.mul_add_f32s(q[3], x, q[1]), x, q[0]),
                simd.mul_add_f32s(q[4], x, q[2]),
                q[5],
            ];
        }
        factors
    }
}

/// The steps of polynomials with `POWERS` powers of y (2, or 3 with y^2), a vector's columns down all rows after the other.
struct Stepping<'a, const POWERS: usize> {
    subset: &'a Linearised,
    recipes: [Recipe; 2],
    /// Room for the images.
    images: &'a mut [Vec<[f32; LANES]>; 3],
}

impl<const POWERS: usize> InBlocks for Stepping<'_, POWERS> {
    type Output = Sums;

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> Sums {
        let Self { subset, recipes, images: [greys, along_x, along_y] } = self;
        let Linearised { width, height, columns, rows, .. } = subset;
        let zero = simd.splat_f32s(0.0);
        let mut totals = [[zero; VECTORS]; 7];
        for (first, i) in (0..*width).step_by(S::F32_LANES).zip((0..VECTORS).cycle()) {
            let (inside, x) = (first_ones::<S>(width - first), load::<S>(&columns[first..]));
            let factors = [recipes[0].at_columns(simd, x), recipes[1].at_columns(simd, x)];
            let mut sums = [zero; 7];
            for row in 0..*height {
                let at = row * width + first;
                let y = simd.splat_f32s(rows[row * width]);
                let weight = simd.mul_f32s(inside, load::<S>(&subset.weights[at..]));
                let grey = simd.mul_f32s(inside, load::<S>(&subset.intensity[at..]));
                let slopes = [load::<S>(&subset.gradient_x[at..]), load::<S>(&subset.gradient_y[at..])];
                let mut steps = [zero; 2];
                for axis in 0..2 {
                    let mut along = zero;
                    for (slope, factors) in slopes.iter().zip(&factors[axis]) {
                        let mut factor = factors[POWERS - 1];
                        for power in (0..POWERS - 1).rev() {
                            factor = simd.mul_add_f32s(factor, y, factors[power]);
                        }
                        along = simd.mul_add_f32s(*slope, factor, along);
                    }
                    let (slope, mean) =
                        (simd.splat_f32s(recipes[axis].slope), simd.splat_f32s(recipes[axis].mean));
                    let absorbed = simd.mul_add_f32s(slope, grey, mean);
                    steps[axis] = simd.mul_f32s(weight, simd.sub_f32s(along, absorbed));
                }
                let [x, y] = steps;
                let [xx, xy, yy] = [simd.mul_f32s(x, x), simd.mul_f32s(x, y), simd.mul_f32s(y, y)];
                sums[0] = simd.add_f32s(sums[0], xx);
                sums[1] = simd.add_f32s(sums[1], yy);
                for (sum, [a, b]) in
                    sums[2..].iter_mut().zip([[xx, xx], [yy, yy], [xx, grey], [xy, grey], [yy, grey]])
                {
                    *sum = simd.mul_add_f32s(a, b, *sum);
                }
                let to = first / LANES * height + row;
                for (image, value) in
                    [&mut *greys, &mut *along_x, &mut *along_y].into_iter().zip([grey, x, y])
                {
                    S::as_mut_simd_f32s(&mut image[to]).0[i] = value;
                }
            }
            for (total, sum) in totals.iter_mut().zip(sums) {
                total[i] = simd.add_f32s(total[i], sum);
            }
        }
        let mut sums = [0.0; 7];
        for (sum, block) in sums.iter_mut().zip(&totals) {
            *sum = total::<S, VECTORS>(block);
        }
        let [xx, yy, fourth_x, fourth_y, by_light @ ..] = sums;
        Sums { squares: [xx, yy], fourth: [fourth_x, fourth_y], by_light }
    }
}
