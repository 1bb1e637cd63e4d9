//! Correlations of a subset's images with the reference around it, at a few lags along each axis.

use pulp::Simd;

use crate::interpolation_error::alias::LAGS;
use crate::reference::image::ReferenceImage;
use crate::simd::{InBlocks, LANES, sum_of_lanes};

/// Blocks that are summed side by side.
const BLOCKS: usize = 4;
/// Lags up to which images are correlated: two filters are apart by so many at most.
const MARGIN: usize = 2 * LAGS;

/// The reference around a subset, less its level.
pub(crate) struct Surroundings {
    scene: Vec<f32>,
    width: usize,
    height: usize,
}

impl Surroundings {
    /// Around the subset whose first pixel is at `(column, row)` of the image.
    pub(crate) fn new(
        reference: &ReferenceImage,
        [column, row]: [i64; 2],
        [width, height]: [usize; 2],
    ) -> Self {
        let stride = width + 2 * MARGIN;
        let mut scene = vec![0.0; stride * (height + 2 * MARGIN)];
        for (line, y) in scene.chunks_exact_mut(stride).zip(row - MARGIN as i64..) {
            reference.copy_row(column - MARGIN as i64, y, line);
            line.iter_mut().for_each(|value| *value -= reference.level as f32);
        }
        // so that whole blocks of a spread image lie inside at every lag
        scene.resize(scene.len() + BLOCKS * LANES + MARGIN, 0.0);
        Self { scene, width, height }
    }

    fn stride(&self) -> usize {
        self.width + 2 * MARGIN
    }

    /// An image of the subset with zeros between its rows, as far apart as those of the surroundings.
    pub(crate) fn spread(&self, image: &[f32]) -> Vec<f32> {
        let n = (self.stride() * self.height).next_multiple_of(BLOCKS * LANES);
        let mut spread = vec![0.0; n];
        for (row, line) in image.chunks_exact(self.width).zip(spread.chunks_exact_mut(self.stride())) {
            line[..self.width].copy_from_slice(row);
        }
        spread
    }

    /// The sum of a spread image times the reference's pixels that lie by `lag` before, along x (0) or y (1).
    pub(crate) fn correlation(&self, spread: &[f32], axis: usize, lag: i64) -> f64 {
        let spacing = if axis == 0 { 1 } else { self.stride() as i64 };
        let start = (MARGIN * (self.stride() + 1)) as i64 - lag * spacing;
        Product { a: spread, b: &self.scene[start as usize..][..spread.len()] }.dispatch()
    }
}

/// The sum of products over whole groups of blocks.
struct Product<'a> {
    a: &'a [f32],
    b: &'a [f32],
}

impl InBlocks for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> f64 {
        let [a, b] = [self.a, self.b]
            .map(|values| S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0.as_chunks::<BLOCKS>().0);
        let mut sums = [[simd.splat_f32s(0.0); VECTORS]; BLOCKS];
        for (a, b) in a.iter().zip(b) {
            for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
                for i in 0..VECTORS {
                    sum[i] = simd.mul_add_f32s(a[i], b[i], sum[i]);
                }
            }
        }
        let total = |vectors: &[S::f32s; VECTORS]| {
            let mut lanes = [0.0; LANES];
            lanes.copy_from_slice(pulp::bytemuck::cast_slice(vectors));
            sum_of_lanes(lanes)
        };
        sums.iter().map(total).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Region;

    #[test]
    fn correlations_are_the_plain_sums_with_the_same_bits_everywhere() {
        let region = Region { x: 7, y: 3, width: 60, height: 50 };
        let value = |i: usize| ((i * 7919) % 211) as f32;
        let reference = ReferenceImage::new(region, (0..region.n_pixels()).map(value).collect(), 1);
        // at the image's edge, where it is mirrored, and inside
        for (first, [width, height]) in [([7, 4], [33, 21]), ([30, 20], [9, 25]), ([40, 40], [27, 13])] {
            let around = Surroundings::new(&reference, first, [width, height]);
            let image: Vec<f32> = (0..width * height).map(|i| value(3 * i) - 100.0).collect();
            let spread = around.spread(&image);
            for (axis, lag) in (0..2).flat_map(|axis| (-10..=10).map(move |lag| (axis, lag))) {
                let pixel = |i: usize| {
                    let (x, y) = (first[0] + (i % width) as i64, first[1] + (i / width) as i64);
                    let place = if axis == 0 { [x - lag, y] } else { [x, y - lag] };
                    reference.pixel(place[0], place[1]) - reference.level
                };
                let terms = || (0..image.len()).map(|i| f64::from(image[i]) * pixel(i));
                let [expected, size] = [terms().sum::<f64>(), terms().map(f64::abs).sum()];
                let found = around.correlation(&spread, axis, lag);
                assert!((found - expected).abs() < 1e-6 * size, "f32 sums of a dozen terms");
            }
            let product = || Product { a: &spread, b: &around.scene[..spread.len()] };
            assert_eq!(product().scalar().to_bits(), product().dispatch().to_bits());
        }
    }
}
