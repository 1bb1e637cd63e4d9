//! Separable filters over a part of a reference, which is mirrored at its edges.

use chainwave_measurement::Region;
use pulp::Simd;

use crate::reference::image::ReferenceImage;
use crate::simd::{InBlocks, LANES};

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

    /// Filters as many values as `result` has room for, `before` of which lie in front of the first; those of the same line
    /// lie at a distance of `spacing`.
    fn apply(&self, values: &[f32], before: usize, spacing: usize, result: &mut [f32]) {
        if result.len() < LANES {
            for (i, result) in result.iter_mut().enumerate() {
                *result = self.one(values, before + i, spacing);
            }
            return;
        }
        Filtering { line: self, values, before, spacing, result }.dispatch();
    }

    /// The filtered value at a place.
    fn one(&self, values: &[f32], at: usize, spacing: usize) -> f32 {
        let mut sum = self.centre * values[at];
        for (k, tap) in self.side.iter().enumerate() {
            let distance = (k + 1) * spacing;
            let pair = self.sign.mul_add(values[at - distance], values[at + distance]);
            sum = tap.mul_add(pair, sum);
        }
        sum
    }
}

/// Filters [`LANES`] values at once, so that their sums stay in registers; the last overlap those before.
struct Filtering<'a> {
    line: &'a Line,
    values: &'a [f32],
    before: usize,
    spacing: usize,
    result: &'a mut [f32],
}

impl InBlocks for Filtering<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) {
        let Self { line, values, before, spacing, result } = self;
        let (centre, sign) = (simd.splat_f32s(line.centre), simd.splat_f32s(line.sign));
        let last = result.len() - LANES;
        for first in (0..last).step_by(LANES).chain([last]) {
            let at = |place: usize| S::as_simd_f32s(&values[place..place + LANES]).0;
            let mut sums = [centre; VECTORS];
            for (sum, &value) in sums.iter_mut().zip(at(before + first)) {
                *sum = simd.mul_f32s(centre, value);
            }
            for (k, &tap) in line.side.iter().enumerate() {
                let (tap, distance) = (simd.splat_f32s(tap), (k + 1) * spacing);
                let (left, right) = (at(before + first - distance), at(before + first + distance));
                for ((sum, &left), &right) in sums.iter_mut().zip(left).zip(right) {
                    *sum = simd.mul_add_f32s(tap, simd.mul_add_f32s(sign, left, right), *sum);
                }
            }
            result[first..first + LANES].copy_from_slice(pulp::bytemuck::cast_slice(&sums));
        }
    }
}

/// The taps of two filters in a row.
pub(crate) fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            result[i + j] += a * b;
        }
    }
    result
}

/// The pixels of `part` (inside the reference), less the reference's level, filtered by `along_x` and `along_y`.
pub(crate) fn filtered(reference: &ReferenceImage, part: Region, along_x: &Line, along_y: &Line) -> Vec<f32> {
    let (before, above) = (along_x.radius(), along_y.radius());
    let level = reference.level as f32;
    let n_rows = part.height + 2 * above;
    let mut by_row = vec![0.0; n_rows * part.width];
    let mut line = vec![0.0; part.width + 2 * before];
    let mut result = vec![0.0; part.n_pixels()];
    for (i, row) in by_row.chunks_exact_mut(part.width).enumerate() {
        let (x, y) = (part.x as i64 - before as i64, (part.y + i) as i64 - above as i64);
        reference.copy_row(x, y, level, &mut line);
        along_x.apply(&line, before, 1, row);
    }
    for (i, row) in result.chunks_exact_mut(part.width).enumerate() {
        along_y.apply(&by_row[i * part.width..], above * part.width, part.width, row);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_their_sums() {
        let region = Region { x: 3, y: 8, width: 40, height: 30 };
        let pixels = (0..region.n_pixels()).map(|i| ((i * 7919) % 512) as f32).collect();
        let reference = ReferenceImage::new(region, pixels, 1);
        let (smooth, slope) = ([0.25, 0.5, 0.25], [-0.1, -0.4, 0.0, 0.4, 0.1]);
        let expected = |x: i64, y: i64| {
            let taps = smooth
                .iter()
                .zip(-1..)
                .flat_map(|(b, j)| slope.iter().zip(-2..).map(move |(a, i)| (a * b, i, j)));
            taps.map(|(tap, i, j)| tap * reference.pixel(x + i, y + j)).sum::<f64>()
        };
        // more and fewer columns than a vector has lanes
        for (width, height) in [(20, 28), (33, 5), (16, 3), (9, 4)] {
            let part = Region { x: 3, y: 10, width, height };
            let found = filtered(&reference, part, &Line::antisymmetric(&slope), &Line::symmetric(&smooth));
            for (i, &found) in found.iter().enumerate() {
                let expected = expected((part.x + i % width) as i64, (part.y + i / width) as i64);
                assert!(
                    (f64::from(found) - expected).abs() < 1e-3,
                    "f32 sums of 512 counts: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn a_line_has_the_same_bits_everywhere() {
        let values: Vec<f32> = (0..60).map(|i| ((i * 7919) % 512) as f32).collect();
        let line = Line::antisymmetric(&[-0.1, -0.4, 0.0, 0.4, 0.1]);
        let [mut plain, mut best] = [[0.0; 50]; 2];
        Filtering { line: &line, values: &values, before: 3, spacing: 1, result: &mut plain }.scalar();
        line.apply(&values, 3, 1, &mut best);
        let one = std::array::from_fn(|i| line.one(&values, 3 + i, 1).to_bits());
        assert_eq!(plain.map(f32::to_bits), one);
        assert_eq!(best.map(f32::to_bits), one);
    }
}
