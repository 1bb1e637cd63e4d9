//! Correlations of a subset's images with the reference around it, at a few lags along each axis.

use pulp::Simd;

use crate::interpolation_error::alias::LAGS;
use crate::prepared::steps::Steps;
use crate::reference::image::ReferenceImage;
use crate::simd::{InBlocks, LANES, load, total};

/// Lags up to which grey values are correlated: two filters are apart by so many at most.
pub(crate) const MARGIN: usize = 2 * LAGS;

/// The reference around a subset, less its level.
#[derive(Default)]
pub(crate) struct Surroundings {
    /// Around the rows of the subset: these with the pixels at all lags before and behind them, filled up by zeros so that whole blocks lie inside.
    along_rows: Scene,
    /// Around its columns: blocks of these, each with the pixels at all lags above and below.
    along_columns: Scene,
}

/// Pixels of which a block and what surrounds it along an axis lie in a window.
#[derive(Default)]
struct Scene {
    pixels: Vec<f32>,
    /// From one window to the next one to its right, and to the one below.
    steps: [usize; 2],
}

impl Surroundings {
    /// Moves to the subset whose first pixel is at `(column, row)` of the image.
    pub(crate) fn surround(
        &mut self,
        reference: &ReferenceImage,
        [column, row]: [i64; 2],
        [width, height]: [usize; 2],
    ) {
        let (n_blocks, n_lines) = (width.div_ceil(LANES), height + 2 * MARGIN);
        let n = n_blocks * LANES + 2 * MARGIN;
        self.along_rows.steps = [LANES, n];
        self.along_columns.steps = [n_lines * LANES, LANES];
        self.along_rows.pixels.resize(n * (height + 1), 0.0);
        self.along_columns.pixels.resize(n_blocks * n_lines * LANES, 0.0);
        // The rows of the subset, and behind them a line for those above and below.
        let (of_rows, spare) = self.along_rows.pixels.split_at_mut(n * height);
        for i in 0..n_lines {
            let place = i.checked_sub(MARGIN).filter(|row| *row < height);
            let line = place.map_or(&mut *spare, |row| &mut of_rows[row * n..][..n]);
            let (x, y) = (column - MARGIN as i64, row + i as i64 - MARGIN as i64);
            let (seen, filling) = line.split_at_mut(width + 2 * MARGIN);
            reference.copy_row(x, y, reference.level as f32, seen);
            // What another subset left there is multiplied by zeros, which makes nothing of numbers alone.
            filling.fill(0.0);
            for (block, values) in line[MARGIN..].as_chunks::<LANES>().0.iter().take(n_blocks).enumerate() {
                self.along_columns.pixels[(block * n_lines + i) * LANES..][..LANES].copy_from_slice(values);
            }
        }
    }

    /// The sums of the products of the reference's pixels with the grey values of the subset and with its steps.
    pub(crate) fn correlations(&self, steps: &Steps) -> Correlations {
        let mut all = Correlations { grey: [[0.0; MARGIN + 1]; 2], steps: [[[0.0; 2 * LAGS + 1]; 2]; 2] };
        self.along_rows.correlate::<1>(steps, 0, &mut all);
        self.along_columns.correlate::<LANES>(steps, 1, &mut all);
        all
    }
}

impl Scene {
    /// The correlations along an axis, on which pixels that are neighbours lie `SPACING` apart.
    fn correlate<const SPACING: usize>(&self, steps: &Steps, axis: usize, all: &mut Correlations) {
        all.put(axis, 0, Products::<2, 5, 0, SPACING> { scene: self, steps }.dispatch());
        all.put(axis, 2, Products::<2, 5, 2, SPACING> { scene: self, steps }.dispatch());
        all.put(axis, 4, Products::<2, 5, 4, SPACING> { scene: self, steps }.dispatch());
        all.put(axis, 6, Products::<5, 1, 6, SPACING> { scene: self, steps }.dispatch());
    }
}

/// Correlations of the reference around a subset with its images, by axis.
pub(crate) struct Correlations {
    /// With the grey values, the mean of those at each lag from 0 to [`MARGIN`] and at its opposite.
    pub(crate) grey: [[f64; MARGIN + 1]; 2],
    /// With the steps along x and y (outer), by the lag from -[`LAGS`] to [`LAGS`]: that of the reference's pixels that lie so far before.
    pub(crate) steps: [[[f64; 2 * LAGS + 1]; 2]; 2],
}

impl Correlations {
    /// Notes the sums at the lags from `first` on.
    fn put<const N_LAGS: usize, const N_SUMS: usize>(
        &mut self,
        axis: usize,
        first: usize,
        sums: [[f64; N_SUMS]; N_LAGS],
    ) {
        for (lag, sums) in (first..).zip(sums) {
            self.grey[axis][lag] = 0.5 * sums[0];
            if let [_, step_x, opposite_x, step_y, opposite_y] = sums.as_slice() {
                [self.steps[0][axis][LAGS + lag], self.steps[0][axis][LAGS - lag]] = [*step_x, *opposite_x];
                [self.steps[1][axis][LAGS + lag], self.steps[1][axis][LAGS - lag]] = [*step_y, *opposite_y];
            }
        }
    }
}

/// The sums of products at the `N_LAGS` lags from `FIRST` on, with the pixels at both sides: those with the grey values, and where there are
/// five sums, those with the steps along x of the pixels before and of those behind, and the same with the steps along y.
struct Products<'a, const N_LAGS: usize, const N_SUMS: usize, const FIRST: usize, const SPACING: usize> {
    scene: &'a Scene,
    steps: &'a Steps,
}

impl<const N_LAGS: usize, const N_SUMS: usize, const FIRST: usize, const SPACING: usize> InBlocks
    for Products<'_, N_LAGS, N_SUMS, FIRST, SPACING>
{
    type Output = [[f64; N_SUMS]; N_LAGS];

    /// A vector's columns down all rows after the other.
    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> [[f64; N_SUMS]; N_LAGS] {
        let Self { scene: Scene { pixels, steps: [right, down] }, steps } = self;
        let zero = simd.splat_f32s(0.0);
        let mut totals = [[[zero; VECTORS]; N_SUMS]; N_LAGS];
        for block in 0..steps.n_blocks() {
            for i in 0..VECTORS.min((steps.width - block * LANES).div_ceil(S::F32_LANES)) {
                let mut sums = [[zero; N_SUMS]; N_LAGS];
                let own = i * S::F32_LANES;
                let [greys, along_x, along_y] = steps.block(block);
                for (((grey, x), y), start) in
                    greys.iter().zip(along_x).zip(along_y).zip((block * right..).step_by(*down))
                {
                    let [grey, x, y] = [load::<S>(&grey[own..]), load::<S>(&x[own..]), load::<S>(&y[own..])];
                    let window = &pixels[start..][..2 * MARGIN * SPACING + LANES];
                    for lag in 0..N_LAGS {
                        let (middle, distance) = (MARGIN * SPACING + own, (FIRST + lag) * SPACING);
                        let before = load::<S>(&window[middle - distance..]);
                        let behind = load::<S>(&window[middle + distance..]);
                        let sums = &mut sums[lag];
                        sums[0] = simd.mul_add_f32s(grey, simd.add_f32s(before, behind), sums[0]);
                        if N_SUMS == 5 {
                            sums[1] = simd.mul_add_f32s(x, before, sums[1]);
                            sums[2] = simd.mul_add_f32s(x, behind, sums[2]);
                            sums[3] = simd.mul_add_f32s(y, before, sums[3]);
                            sums[4] = simd.mul_add_f32s(y, behind, sums[4]);
                        }
                    }
                }
                for (totals, sums) in totals.iter_mut().zip(sums) {
                    for (total, sum) in totals.iter_mut().zip(sums) {
                        total[i] = simd.add_f32s(total[i], sum);
                    }
                }
            }
        }
        let mut results = [[0.0; N_SUMS]; N_LAGS];
        for (results, totals) in results.iter_mut().zip(&totals) {
            for (result, block) in results.iter_mut().zip(totals) {
                *result = total::<S, VECTORS>(block);
            }
        }
        results
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PreparedSubset, Reference, Settings};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn correlations_are_the_plain_sums_with_the_same_bits_everywhere() {
        let region = Region { x: 7, y: 3, width: 60, height: 50 };
        let value = |i: usize| {
            let (x, y) = ((i % 60) as f32, (i / 60) as f32);
            (300.0 * (0.8 * x + 0.3 * y).sin() + 200.0 * (0.4 * x - 0.9 * y).cos()).round()
                + ((i * 7919) % 11) as f32
        };
        let reference = Reference::new(region, (0..region.n_pixels()).map(value).collect(), 1).unwrap();
        // at the image's edge, where it is mirrored, and inside
        for (first, [width, height]) in [([7, 4], [33, 21]), ([30, 20], [9, 25]), ([39, 39], [27, 13])] {
            let centre = [first[0] + width / 2, first[1] + height / 2].map(|place| place as f64);
            let subset = Subset::new("", centre[0], centre[1], width / 2, height / 2);
            let subset = PreparedSubset::new(&reference, &subset, &Settings::default()).unwrap();
            let steps = Steps::of(&subset);
            let image = reference.image();
            let mut around = Surroundings::default();
            around.surround(image, first.map(|place| place as i64), [width, height]);
            let found = around.correlations(&steps);
            let [along_x, along_y] = steps.by_pixel();
            let check = |image_of_subset: &[f32], axis: usize, lags: [i64; 2], found: f64| {
                let pixel = |i: usize, lag: i64| {
                    let (x, y) = ((first[0] + i % width) as i64, (first[1] + i / width) as i64);
                    let place = if axis == 0 { [x - lag, y] } else { [x, y - lag] };
                    image.pixel(place[0], place[1]) - image.level
                };
                let of_lags = |i: usize| 0.5 * (pixel(i, lags[0]) + pixel(i, lags[1]));
                let terms = || (0..width * height).map(|i| f64::from(image_of_subset[i]) * of_lags(i));
                let [expected, size] = [terms().sum::<f64>(), terms().map(f64::abs).sum()];
                assert!(
                    (found - expected).abs() < 1e-6 * size,
                    "f32 sums of a few dozen terms: {found} {expected}"
                );
            };
            for axis in 0..2 {
                for lag in 0..=MARGIN {
                    let opposite = -(lag as i64);
                    check(&subset.intensity, axis, [lag as i64, opposite], found.grey[axis][lag]);
                }
                for lag in 0..=2 * LAGS {
                    let lag_px = lag as i64 - LAGS as i64;
                    check(&along_x, axis, [lag_px; 2], found.steps[0][axis][lag]);
                    check(&along_y, axis, [lag_px; 2], found.steps[1][axis][lag]);
                }
            }
            let product = || Products::<2, 5, 3, LANES> { scene: &around.along_columns, steps: &steps };
            assert_eq!(product().scalar(), product().dispatch());
        }
    }
}
