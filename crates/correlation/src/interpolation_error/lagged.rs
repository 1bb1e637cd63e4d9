//! Correlations of a subset's images with the reference around it, at a few lags along each axis.

use pulp::Simd;

use crate::interpolation_error::alias::LAGS;
use crate::reference::image::ReferenceImage;
use crate::simd::{InBlocks, LANES, sum_of_lanes};

/// Blocks that are summed side by side.
const BLOCKS: usize = 4;
/// Lags up to which images are correlated: two filters are apart by so many at most.
pub(crate) const MARGIN: usize = 2 * LAGS;

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
        }
        let level = reference.level as f32;
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || scene.iter_mut().for_each(|value| *value -= level),
        );
        // so that whole blocks of a spread image lie inside at every lag
        scene.resize(scene.len() + BLOCKS * LANES + MARGIN, 0.0);
        Self { scene, width, height }
    }

    fn stride(&self) -> usize {
        self.width + 2 * MARGIN
    }

    /// An image of the subset with zeros between its rows, as far apart as those of the surroundings.
    fn spread(&self, image: &[f32]) -> Vec<f32> {
        let n = (self.stride() * self.height).next_multiple_of(BLOCKS * LANES);
        let mut spread = vec![0.0; n];
        for (row, line) in image.chunks_exact(self.width).zip(spread.chunks_exact_mut(self.stride())) {
            line[..self.width].copy_from_slice(row);
        }
        spread
    }

    /// The sums of the products of the reference's pixels with images of the subset: its intensity, and the steps along x and y.
    pub(crate) fn correlations(&self, intensity: &[f32], steps: &[Vec<f32>; 2]) -> Correlations {
        let [step_x, step_y] = steps.each_ref().map(|step| self.spread(step));
        let intensity = self.spread(intensity);
        let mut all =
            Correlations { intensity: [[0.0; 2 * MARGIN + 1]; 2], steps: [[[0.0; 2 * LAGS + 1]; 2]; 2] };
        let near = LAGS as i64;
        for axis in 0..2 {
            for first in (-near..near).step_by(2) {
                let sums = self.products([&intensity, &step_x, &step_y], axis, [first, first + 1]);
                all.put(axis, first, sums);
            }
            all.put(axis, near, self.products([&intensity, &step_x, &step_y], axis, [near]));
            for first in [-2 * near, near + 1] {
                let sums = self.products([&intensity], axis, [0, 1, 2, 3, 4].map(|lag| first + lag));
                all.put(axis, first, sums);
            }
        }
        all
    }

    /// The sums of spread images times the reference's pixels that lie by each lag before, along x (0) or y (1).
    fn products<const IMAGES: usize, const N: usize>(
        &self,
        images: [&[f32]; IMAGES],
        axis: usize,
        lags: [i64; N],
    ) -> [[f64; N]; IMAGES] {
        let spacing = if axis == 0 { 1 } else { self.stride() as i64 };
        let scenes = lags.map(|lag| {
            let start = (MARGIN * (self.stride() + 1)) as i64 - lag * spacing;
            &self.scene[start as usize..][..images[0].len()]
        });
        Products { images, scenes }.dispatch()
    }
}

/// Correlations of the reference around a subset with its images, by axis and by lag from the lowest on.
pub(crate) struct Correlations {
    /// With the intensity, at lags up to [`MARGIN`].
    pub(crate) intensity: [[f64; 2 * MARGIN + 1]; 2],
    /// With the steps along x and y (outer), at lags up to [`LAGS`].
    pub(crate) steps: [[[f64; 2 * LAGS + 1]; 2]; 2],
}

impl Correlations {
    fn put<const IMAGES: usize, const N: usize>(
        &mut self,
        axis: usize,
        first: i64,
        sums: [[f64; N]; IMAGES],
    ) {
        let [of_intensity, of_steps @ ..] = sums.as_slice() else { return };
        let at = |margin: usize| (first + margin as i64) as usize;
        self.intensity[axis][at(MARGIN)..][..N].copy_from_slice(of_intensity);
        for (all, of_step) in self.steps.iter_mut().zip(of_steps) {
            all[axis][at(LAGS)..][..N].copy_from_slice(of_step);
        }
    }
}

/// The sums of products of some images and some scenes, over whole groups of blocks.
struct Products<'a, const IMAGES: usize, const SCENES: usize> {
    images: [&'a [f32]; IMAGES],
    scenes: [&'a [f32]; SCENES],
}

impl<const IMAGES: usize, const SCENES: usize> InBlocks for Products<'_, IMAGES, SCENES> {
    type Output = [[f64; SCENES]; IMAGES];

    /// One block of each group after the other, so that few sums are under way, and stay in registers.
    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> [[f64; SCENES]; IMAGES] {
        let mut images: [&[[[S::f32s; VECTORS]; BLOCKS]]; IMAGES] = [&[]; IMAGES];
        let mut scenes: [&[[[S::f32s; VECTORS]; BLOCKS]]; SCENES] = [&[]; SCENES];
        let n = self.images[0].len() / (BLOCKS * LANES);
        for (to, values) in images.iter_mut().zip(self.images) {
            *to = &S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0.as_chunks::<BLOCKS>().0[..n];
        }
        for (to, values) in scenes.iter_mut().zip(self.scenes) {
            *to = &S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0.as_chunks::<BLOCKS>().0[..n];
        }
        let mut results = [[0.0; SCENES]; IMAGES];
        for block in 0..BLOCKS {
            let mut sums = [[[simd.splat_f32s(0.0); VECTORS]; SCENES]; IMAGES];
            for at in 0..n {
                for i in 0..VECTORS {
                    for scene in 0..SCENES {
                        let pixels = scenes[scene][at][block][i];
                        for image in 0..IMAGES {
                            let sum = &mut sums[image][scene][i];
                            *sum = simd.mul_add_f32s(images[image][at][block][i], pixels, *sum);
                        }
                    }
                }
            }
            for image in 0..IMAGES {
                for scene in 0..SCENES {
                    let mut lanes = [0.0; LANES];
                    lanes.copy_from_slice(pulp::bytemuck::cast_slice(&sums[image][scene]));
                    results[image][scene] += sum_of_lanes(lanes);
                }
            }
        }
        results
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
                let [[found]] = around.products([&spread], axis, [lag]);
                assert!((found - expected).abs() < 1e-6 * size, "f32 sums of a dozen terms");
            }
            let product = || Products { images: [&spread], scenes: [&around.scene[..spread.len()]] };
            assert_eq!(product().scalar()[0][0].to_bits(), product().dispatch()[0][0].to_bits());
        }
    }
}
