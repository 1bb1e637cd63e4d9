//! Which pixels of a reference say where a body is: not those that saturate, that are no numbers, or that show the
//! dark ground behind it.
//!
//! Ground without light has no texture, yet the edge of a marker against it is a step that no pixel grid samples well, and
//! whatever structure the ground has stays behind when the body moves. It is told from the gaps between speckles by
//! its extent: a square of 11 x 11 px whose mean is below a fifth of the light (black being 0), and whose variance is not
//! far above what its own noise explains; and by going on: a gap between dots that are sprayed on black holds such squares too, but ends within
//! three of them each way. Ground that is brighter is used like any other texture.
//!
//! The pixels next to those are left out as well, since interpolation mixes them.

use chainwave_measurement::Region;

use crate::reference::image::ReferenceImage;

/// Columns and rows of a square of ground.
const GROUND_PX: usize = 11;
/// Columns or rows over which the centres of such squares go on, as ground does beside a body: with the squares around them that is three times
/// the size of one, where dots that are sprayed at random, one on 60 square pixels, leave hardly any gap.
const GROUND_SPAN_PX: usize = 2 * GROUND_PX;
/// Share of the light below which a square may be ground. Speckles that overlap at random leave no such square.
const DARK_SHARE: f64 = 0.2;
/// Variance over that of the noise up to which a square has no texture. The noise is estimated from the square's own
/// fourth differences, to about a third: some 17 of them are independent.
const FLAT_RATIO: f64 = 2.0;
/// Variance that rounding leaves, and once more for a level between two counts, in squares of what is rounded to.
const ROUNDING_VARIANCE: f64 = 0.5;
/// Pixels next to ground that go with it. An edge rings through the prefilter by the power of its pole, 0.5 for the cubic
/// MOMS: at 3, 4 and 5 px from the edges of a marker of 29 px, the bias is 2.3, 1.0 and 0.24 mpx peak to peak, and the
/// standard deviation under noise grows by a seventh with each pixel that the margin is wider.
const GROUND_MARGIN_PX: usize = 4;
/// Pixels next to one that is invalid that go with it. A clipped peak is a kink, and rings less than an edge.
pub(crate) const INVALID_MARGIN_PX: usize = 2;

/// 1 for each pixel that is used and 0 for each that is not, row by row; `None` where all are used. `fourth` are the
/// fourth differences of the pixels along both axes ([`crate::reference::gradient`]).
pub(crate) fn usable_pixels(region: Region, image: &ReferenceImage, fourth: &[f32]) -> Option<Vec<f32>> {
    let near_invalid = dilated(region.width, &image.invalid, INVALID_MARGIN_PX);
    let near_ground = dilated(region.width, &ground(region, image, fourth), GROUND_PX / 2 + GROUND_MARGIN_PX);
    let left_out: Vec<bool> = near_invalid.iter().zip(&near_ground).map(|(a, b)| *a || *b).collect();
    let weights = || left_out.iter().map(|&out| if out { 0.0 } else { 1.0 }).collect();
    left_out.contains(&true).then(weights)
}

/// Whether each pixel is the centre of a square of ground.
fn ground(region: Region, image: &ReferenceImage, fourth: &[f32]) -> Vec<bool> {
    let ReferenceImage { pixels, invalid, quantum, .. } = image;
    let rounding = ROUNDING_VARIANCE * quantum * quantum;
    let valid = pixels.iter().zip(invalid).filter(|(_, invalid)| !**invalid);
    let add = |[sum, square]: [f64; 2], value: f64| [sum + value, square + value * value];
    let [sum, square] = valid.map(|(&pixel, _)| f64::from(pixel)).fold([0.0; 2], add);
    // the mean weighted by light, which is that of the lit pixels however many others there are
    let dark = DARK_SHARE * square / sum;
    let mut is_ground = vec![false; pixels.len()];
    if region.width < GROUND_PX || region.height < GROUND_PX {
        return is_ground;
    }
    let sums = boxes(region, pixels.iter().map(|&pixel| f64::from(pixel)));
    let squares = boxes(region, pixels.iter().map(|&pixel| f64::from(pixel) * f64::from(pixel)));
    let noise = boxes(region, fourth.iter().map(|&value| f64::from(value).powi(2) / (70.0 * 70.0)));
    let n = (GROUND_PX * GROUND_PX) as f64;
    let columns = region.width + 1 - GROUND_PX;
    let of_lines =
        sums.chunks_exact(columns).zip(squares.chunks_exact(columns)).zip(noise.chunks_exact(columns));
    let lines = is_ground.chunks_exact_mut(region.width).skip(GROUND_PX / 2);
    for (line, ((sums, squares), noise)) in lines.zip(of_lines) {
        let line = line[GROUND_PX / 2..].iter_mut();
        for (is_ground, ((sum, square), noise)) in line.zip(sums.iter().zip(squares).zip(noise)) {
            let (mean, variance) = (sum / n, (square - sum * sum / n) / n);
            let flat = variance <= FLAT_RATIO * noise / n + rounding;
            *is_ground = flat & (mean < dark);
        }
    }
    without_gaps(region.width, is_ground)
}

/// Marks without those that hang together, side by side or by a corner, over fewer than [`GROUND_SPAN_PX`] columns and rows: such is a gap
/// between dots.
fn without_gaps(width: usize, mut marked: Vec<bool>) -> Vec<bool> {
    let height = marked.len() / width;
    let mut seen = vec![false; marked.len()];
    // In a smaller image ground can go on no farther than from rim to rim.
    let least = GROUND_SPAN_PX.min(width.max(height).saturating_sub(GROUND_PX));
    for start in 0..marked.len() {
        if !marked[start] || seen[start] {
            continue;
        }
        seen[start] = true;
        let mut together = vec![start];
        let mut k = 0;
        while let Some(&i) = together.get(k) {
            k += 1;
            let (x, y) = (i % width, i / width);
            for row in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for next in row * width + x.saturating_sub(1)..=row * width + (x + 1).min(width - 1) {
                    if marked[next] && !seen[next] {
                        seen[next] = true;
                        together.push(next);
                    }
                }
            }
        }
        let span = |place: fn(usize, usize) -> usize| {
            let places = || together.iter().map(|&i| place(i, width));
            places().max().unwrap_or(0) - places().min().unwrap_or(0)
        };
        if span(|i, width| i % width).max(span(|i, width| i / width)) < least {
            together.iter().for_each(|&i| marked[i] = false);
        }
    }
    marked
}

/// The sums over all squares inside the region, by the place of their first pixel.
fn boxes(region: Region, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let Region { width, height, .. } = region;
    let stride = width + 1;
    let mut table = vec![0.0; stride * (height + 1)];
    let mut values = values;
    for y in 0..height {
        let (above, row) = table[y * stride..(y + 2) * stride].split_at_mut(stride);
        let mut row_sum = 0.0;
        for (x, value) in values.by_ref().take(width).enumerate() {
            row_sum = if x == 0 { value } else { row_sum + value };
            row[x + 1] = above[x + 1] + row_sum;
        }
    }
    let columns = stride - GROUND_PX;
    let mut sums = Vec::with_capacity(columns * (height + 1 - GROUND_PX));
    for y in 0..=height - GROUND_PX {
        let (first, last) = (&table[y * stride..][..stride], &table[(y + GROUND_PX) * stride..][..stride]);
        let (left, right) = (
            first[..columns].iter().zip(&last[..columns]),
            first[GROUND_PX..].iter().zip(&last[GROUND_PX..]),
        );
        sums.extend(
            left.zip(right).map(|((above_left, left), (above, here))| here + above_left - above - left),
        );
    }
    sums
}

/// Whether a marked pixel lies within `radius` columns and rows.
pub(crate) fn dilated(width: usize, marked: &[bool], radius: usize) -> Vec<bool> {
    let height = marked.len() / width;
    let mut along_rows = vec![false; marked.len()];
    let mut both = vec![false; marked.len()];
    for (i, _) in marked.iter().enumerate().filter(|(_, marked)| **marked) {
        let (x, row) = (i % width, i / width * width);
        along_rows[row + x.saturating_sub(radius)..=row + (x + radius).min(width - 1)].fill(true);
    }
    for (i, _) in along_rows.iter().enumerate().filter(|(_, marked)| **marked) {
        let (x, y) = (i % width, i / width);
        (y.saturating_sub(radius)..=(y + radius).min(height - 1)).for_each(|y| both[y * width + x] = true);
    }
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_grow_to_squares() {
        let region = Region { x: 4, y: 5, width: 9, height: 7 };
        let mut marked = vec![false; region.n_pixels()];
        marked[3 * 9 + 1] = true;
        let grown = dilated(region.width, &marked, 2);
        for (i, grown) in grown.into_iter().enumerate() {
            let (x, y) = ((i % 9) as i32, (i / 9) as i32);
            assert_eq!(grown, (x - 1).abs() <= 2 && (y - 3).abs() <= 2, "{x} {y}");
        }
    }

    #[test]
    fn ground_goes_on_and_a_gap_does_not() {
        let width = 60;
        let mut marked = vec![false; width * 40];
        // A gap of 9 x 9, one that goes on by corners over 23 rows, a strip of one row, and one at the rim.
        (3..12).for_each(|y| marked[y * width + 3..y * width + 12].fill(true));
        (3..26).for_each(|y| marked[y * width + 15 + y] = true);
        marked[30 * width..][5..28].fill(true);
        marked[39 * width..][..4].fill(true);
        let kept = without_gaps(width, marked.clone());
        for (i, (kept, marked)) in kept.into_iter().zip(marked).enumerate() {
            let (x, y) = (i % width, i / width);
            let is_gap = (x < 12 && y < 12) || y == 39;
            assert_eq!(kept, marked && !is_gap, "{x} {y}");
        }
    }

    #[test]
    fn sums_over_squares_are_the_plain_ones() {
        let region = Region { x: 0, y: 0, width: 14, height: 12 };
        let value = |i: usize| ((i * 7919) % 101) as f64;
        let found = boxes(region, (0..region.n_pixels()).map(value));
        for (i, found) in found.iter().enumerate() {
            let (x, y) = (i % 4, i / 4);
            let places = (0..GROUND_PX * GROUND_PX).map(|k| (y + k / GROUND_PX) * 14 + x + k % GROUND_PX);
            let expected: f64 = places.map(value).sum();
            assert!((found - expected).abs() < 1e-9, "whole numbers");
        }
        assert_eq!(found.len(), 4 * 2);
    }
}
