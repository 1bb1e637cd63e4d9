//! Where the pixels of a subset lie, from its centre; subsets of one size whose centres lie alike between pixels share them.

use std::sync::Arc;

use crate::simd::padded;

/// Column and row of each pixel of a rectangle whose first is at a place, and 1, row by row, then zeros up to whole vectors.
pub(crate) fn pixel_places([x, y]: [f64; 2], width: usize, height: usize) -> [Arc<[f32]>; 3] {
    let line = |first: f64, n: usize| (0..n).map(move |i| (first + i as f64) as f32);
    let columns = (0..height).flat_map(|_| line(x, width));
    let rows = line(y, height).flat_map(|y| std::iter::repeat_n(y, width));
    let ones = std::iter::repeat_n(1.0, width * height);
    [padded(columns).into(), padded(rows).into(), padded(ones).into()]
}
