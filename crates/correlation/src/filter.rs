//! Separable filters over a part of a reference, which is mirrored at its edges.

use chainwave_measurement::Region;

use crate::Reference;
use crate::simd::vectorised;

/// The taps of a filter along a line: that at its centre, and those at the distances 1, 2 and so on, which the other
/// side has with the same sign or the opposite one.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    centre: f32,
    side: Vec<f32>,
    sign: f32,
}

impl Line {
    /// A filter whose two sides are equal, from its odd number of taps.
    pub(crate) fn symmetric(taps: &[f64]) -> Self {
        Self::new(taps, 1.0)
    }

    /// A filter whose sides have opposite signs: it takes a constant to exactly zero.
    pub(crate) fn antisymmetric(taps: &[f64]) -> Self {
        Self::new(taps, -1.0)
    }

    fn new(taps: &[f64], sign: f32) -> Self {
        let radius = taps.len() / 2;
        // A filter that smooths nothing ends in zeros.
        let mut side: Vec<f32> = taps[radius + 1..].iter().map(|&tap| tap as f32).collect();
        while side.last().is_some_and(|tap| tap.abs() < 1e-9) {
            side.pop();
        }
        Self { centre: taps[radius] as f32, side, sign }
    }

    fn radius(&self) -> usize {
        self.side.len()
    }

    /// Filters `n` values at a distance of `spacing` from `values`, of which the first is to become the result's first;
    /// `before` values lie in front of it.
    #[inline(always)]
    fn apply(&self, values: &[f32], before: usize, spacing: usize, result: &mut [f32]) {
        let n = result.len();
        let centre = &values[before..before + n];
        for (result, value) in result.iter_mut().zip(centre) {
            *result = self.centre * value;
        }
        for (k, &tap) in self.side.iter().enumerate() {
            let distance = (k + 1) * spacing;
            let (left, right) = (&values[before - distance..][..n], &values[before + distance..][..n]);
            for ((result, left), right) in result.iter_mut().zip(left).zip(right) {
                *result += tap * (right + self.sign * left);
            }
        }
    }
}

/// The pixels of `part` (inside the reference), less the reference's level, filtered by `along_x` and `along_y`.
pub(crate) fn filtered(reference: &Reference, part: Region, along_x: &Line, along_y: &Line) -> Vec<f32> {
    let (before, above) = (along_x.radius(), along_y.radius());
    let level = reference.level() as f32;
    let n_rows = part.height + 2 * above;
    let mut by_row = vec![0.0; n_rows * part.width];
    let mut line = vec![0.0; part.width + 2 * before];
    let mut result = vec![0.0; part.n_pixels()];
    vectorised(
        #[inline(always)]
        || {
            for (i, row) in by_row.chunks_exact_mut(part.width).enumerate() {
                let (x, y) = (part.x as i64 - before as i64, (part.y + i) as i64 - above as i64);
                reference.copy_row(x, y, &mut line);
                line.iter_mut().for_each(|value| *value -= level);
                along_x.apply(&line, before, 1, row);
            }
            for (i, row) in result.chunks_exact_mut(part.width).enumerate() {
                along_y.apply(&by_row[i * part.width..], above * part.width, part.width, row);
            }
        },
    );
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_their_sums() {
        let region = Region { x: 3, y: 8, width: 40, height: 30 };
        let pixels = (0..region.n_pixels()).map(|i| ((i * 7919) % 512) as f32).collect();
        let reference = Reference::new(region, pixels, 1).unwrap();
        let (smooth, slope) = ([0.25, 0.5, 0.25], [-0.1, -0.4, 0.0, 0.4, 0.1]);
        let part = Region { x: 3, y: 10, width: 20, height: 28 };
        let found = filtered(&reference, part, &Line::antisymmetric(&slope), &Line::symmetric(&smooth));
        for (i, &found) in found.iter().enumerate() {
            let (x, y) = ((part.x + i % part.width) as i64, (part.y + i / part.width) as i64);
            let mut sum = 0.0;
            for (j, b) in smooth.iter().enumerate() {
                for (i, a) in slope.iter().enumerate() {
                    sum += a * b * reference.pixel(x + i as i64 - 2, y + j as i64 - 1);
                }
            }
            assert!((f64::from(found) - sum).abs() < 1e-3, "f32 sums of 512 counts: {found} {sum}");
        }
    }
}
