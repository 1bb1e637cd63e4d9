//! Where a subset lies in its reference.

use chainwave_measurement::{Region, Subset};

use crate::Reference;
use crate::prepared::outline::is_within;
use crate::reference::pixel_bounds;
use crate::simd::{LANES, padded, padded_length};

/// Where a subset lies in its reference.
pub(crate) struct SubsetRegion {
    region: Region,
    /// First column and row, counted from the reference's.
    column: usize,
    row: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl SubsetRegion {
    /// `None` when the reference does not hold the subset.
    pub(crate) fn new(reference: &Reference, subset: &Subset) -> Option<Self> {
        let [x0, x1, y0, y1] = pixel_bounds(subset);
        let region = reference.region();
        let from = |value: i64, first: usize| usize::try_from(value - first as i64).unwrap_or(0);
        reference.holds([x0, x1], [y0, y1]).then(|| Self {
            region,
            column: from(x0, region.x),
            row: from(y0, region.y),
            width: 2 * subset.half_width_px + 1,
            height: 2 * subset.half_height_px + 1,
        })
    }

    pub(crate) fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// Place of the first pixel, relative to the subset's centre.
    pub(crate) fn first_px(&self, subset: &Subset) -> [f64; 2] {
        let (column, row) = (self.region.x + self.column, self.region.y + self.row);
        [column as f64 - subset.x_px, row as f64 - subset.y_px]
    }

    /// Column and row of the first pixel in the image.
    pub(crate) fn first_in_image(&self) -> [i64; 2] {
        [(self.region.x + self.column) as i64, (self.region.y + self.row) as i64]
    }

    /// The subset's part of an image of the reference's size, padded to whole vectors by zeros.
    pub(crate) fn padded(&self, image: &[f32]) -> Vec<f32> {
        let mut values = vec![0.0; padded_length(self.n_pixels())];
        let first = self.row * self.region.width + self.column;
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || {
                let rows = image[first..].chunks(self.region.width).take(self.height);
                for (to, row) in values.chunks_exact_mut(self.width).zip(rows) {
                    copy_in_blocks(&row[..self.width], to);
                }
            },
        );
        values
    }

    /// 1 for each of the subset's pixels that is `usable` (`None`: all are) and within its outline, 0 for the others and the padding; `None` where
    /// all are 1.
    pub(crate) fn weights(&self, usable: Option<&[f32]>, subset: &Subset) -> Option<Vec<f32>> {
        if usable.is_none() && subset.outline_px.is_empty() {
            return None;
        }
        let ones = || padded(std::iter::repeat_n(1.0, self.n_pixels()));
        let mut weights = usable.map_or_else(ones, |usable| self.padded(usable));
        if !subset.outline_px.is_empty() {
            let [left, top] = self.first_px(subset);
            for (i, weight) in weights.iter_mut().take(self.n_pixels()).enumerate() {
                let place = [left + (i % self.width) as f64, top + (i / self.width) as f64];
                if !is_within(&subset.outline_px, place) {
                    *weight = 0.0;
                }
            }
        }
        let all_used = weights[..self.n_pixels()].iter().all(|&weight| weight > 0.0);
        (!all_used).then_some(weights)
    }
}

/// Copies a row of pixels in blocks, the last of which overlaps: a call of the C library costs more than to copy some dozen values.
#[inline(always)]
fn copy_in_blocks(row: &[f32], to: &mut [f32]) {
    for (to, block) in to.as_chunks_mut::<LANES>().0.iter_mut().zip(row.as_chunks::<LANES>().0) {
        *to = *block;
    }
    match (to.last_chunk_mut::<LANES>(), row.last_chunk::<LANES>()) {
        (Some(to), Some(block)) => *to = *block,
        _ => to.iter_mut().zip(row).for_each(|(to, value)| *to = *value),
    }
}
