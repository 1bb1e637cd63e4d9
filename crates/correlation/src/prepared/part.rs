//! Where a subset lies in its reference.

use chainwave_measurement::{Region, Subset};

use crate::Reference;
use crate::prepared::outline::is_within;
use crate::reference::pixel_bounds;
use crate::simd::{LANES, padded_length};

/// Where a subset lies in its reference.
pub(crate) struct Part {
    region: Region,
    /// First column and row, counted from the reference's.
    column: usize,
    row: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Part {
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
        let rows = image.chunks_exact(self.region.width).skip(self.row);
        for (to, row) in values.chunks_exact_mut(self.width).zip(rows).take(self.height) {
            // In blocks, for a call of the C library costs more than to copy some dozen values.
            let (blocks, rest) = row[self.column..self.column + self.width].as_chunks::<LANES>();
            let (to_blocks, to_rest) = to.as_chunks_mut::<LANES>();
            to_blocks.iter_mut().zip(blocks).for_each(|(to, block)| *to = *block);
            to_rest.iter_mut().zip(rest).for_each(|(to, value)| *to = *value);
        }
        values
    }

    /// 1 for each of the subset's pixels that is `usable` (`None`: all are) and within its outline, 0 for the others and the padding; and
    /// how many are 1.
    pub(crate) fn weights(&self, usable: Option<&[f32]>, subset: &Subset) -> (Vec<f32>, usize) {
        let mut weights = usable.map_or_else(
            || {
                let mut ones = vec![1.0; self.n_pixels()];
                ones.resize(padded_length(self.n_pixels()), 0.0);
                ones
            },
            |usable| self.padded(usable),
        );
        if !subset.outline_px.is_empty() {
            let [left, top] = self.first_px(subset);
            for (i, weight) in weights.iter_mut().take(self.n_pixels()).enumerate() {
                let place = [left + (i % self.width) as f64, top + (i / self.width) as f64];
                if !is_within(&subset.outline_px, place) {
                    *weight = 0.0;
                }
            }
        }
        let n_used = match usable {
            None if subset.outline_px.is_empty() => self.n_pixels(),
            _ => weights.iter().filter(|&&weight| weight > 0.0).count(),
        };
        (weights, n_used)
    }
}
