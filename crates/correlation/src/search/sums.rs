//! Cross-correlation of a scene and a template place by place: neighbouring places side by side in vectors.
//!
//! A value of the template meets the scene's pixels of as many places as vectors hold, so that a sum costs no more than its products: a row of
//! a template fills no vector, and nothing is added across lanes. Each place's sum goes over the template row by row, whatever the vectors are.

use pulp::Simd;

use crate::search::fourier::Image;
use crate::simd::{InBlocks, LANES};

/// Blocks of [`LANES`] places that are summed together: as many sums as stay in a processor's registers and hide the time of an addition.
const BLOCKS: usize = 4;

/// The sums of the template's values times those of the scene under it, at every place where it lies inside, row by row.
pub(crate) fn sums(scene: Image<'_>, template: Image<'_>) -> Vec<f32> {
    let columns = scene.width + 1 - template.width;
    if columns < LANES {
        // Places beyond the scene's edge, whose sums are thrown away.
        let width = template.width - 1 + LANES;
        let mut wider = Vec::with_capacity(width * scene.height());
        for row in scene.values.chunks_exact(scene.width) {
            wider.extend_from_slice(row);
            wider.resize(wider.len() + width - scene.width, 0.0);
        }
        let all = sums(Image { width, values: &wider }, template);
        return all.chunks_exact(LANES).flat_map(|row| &row[..columns]).copied().collect();
    }
    SideBySide { scene, template, columns }.dispatch()
}

struct SideBySide<'a> {
    scene: Image<'a>,
    template: Image<'a>,
    columns: usize,
}

impl InBlocks for SideBySide<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> Vec<f32> {
        let Self { scene, template, columns } = self;
        let rows = scene.height() + 1 - template.height();
        let mut sums = vec![0.0; columns * rows];
        for (row, sums) in sums.chunks_exact_mut(columns).enumerate() {
            let under = &scene.values[row * scene.width..];
            let mut first = 0;
            while first < columns {
                if first + BLOCKS * LANES <= columns {
                    block::<S, VECTORS, BLOCKS>(simd, scene.width, under, template, first, sums);
                    first += BLOCKS * LANES;
                } else {
                    // What is left is summed with some places before it once more.
                    let start = first.min(columns - LANES);
                    block::<S, VECTORS, 1>(simd, scene.width, under, template, start, sums);
                    first = start + LANES;
                }
            }
        }
        sums
    }
}

/// The sums at `N` blocks of places from `first` on of a row.
#[inline(always)]
fn block<S: Simd, const VECTORS: usize, const N: usize>(
    simd: S,
    width: usize,
    under: &[f32],
    template: Image<'_>,
    first: usize,
    sums: &mut [f32],
) {
    let mut lanes = [[simd.splat_f32s(0.0); VECTORS]; N];
    for (row, values) in template.values.chunks_exact(template.width).enumerate() {
        let pixels = &under[row * width + first..][..template.width - 1 + N * LANES];
        for (column, &value) in values.iter().enumerate() {
            let value = simd.splat_f32s(value);
            let here = S::as_simd_f32s(&pixels[column..column + N * LANES]).0.as_chunks::<VECTORS>().0;
            for block in 0..N {
                for vector in 0..VECTORS {
                    let sum = &mut lanes[block][vector];
                    *sum = simd.mul_add_f32s(value, here[block][vector], *sum);
                }
            }
        }
    }
    for (block, lanes) in lanes.iter().enumerate() {
        let place = first + block * LANES;
        sums[place..place + LANES].copy_from_slice(pulp::bytemuck::cast_slice(lanes));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_side_by_side_are_the_plain_ones_and_have_the_same_bits_everywhere() {
        let value = |i: usize, k: usize| ((i * k) % 101) as f32 / 50.0 - 1.0;
        for ([width, height], [columns, rows]) in [
            ([40, 31], [7, 9]),
            ([33, 50], [33, 20]),
            ([164, 17], [1, 17]),
            ([150, 9], [9, 4]),
            ([24, 5], [9, 5]),
        ] {
            let scene: Vec<f32> = (0..width * height).map(|i| value(i, 7919)).collect();
            let template: Vec<f32> = (0..columns * rows).map(|i| value(i, 31)).collect();
            let (scene, template) =
                (Image { width, values: &scene }, Image { width: columns, values: &template });
            let found = sums(scene, template);
            let places = (0..=height - rows).flat_map(|y| (0..=width - columns).map(move |x| (x, y)));
            assert_eq!(found.len(), (width + 1 - columns) * (height + 1 - rows));
            for ((x, y), found) in places.zip(&found) {
                let term = |i: usize| {
                    f64::from(template.values[i])
                        * f64::from(scene.values[(y + i / columns) * width + x + i % columns])
                };
                let expected: f64 = (0..columns * rows).map(term).sum();
                assert!((f64::from(*found) - expected).abs() < 1e-3, "f32 of up to 660 terms of 1");
            }
            if width + 1 - columns >= LANES {
                let plain = SideBySide { scene, template, columns: width + 1 - columns }.scalar();
                assert_eq!(found, plain);
            }
        }
    }
}
