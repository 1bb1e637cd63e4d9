//! From pixels to spline coefficients: along columns by the recursive filters of box 2 of M. Unser, Splines: a perfect
//! fit for signal and image processing, IEEE Signal Process. Mag. 16 (1999) 22-38, many columns side by side; along rows,
//! where a recursion would wait for itself, by the sum that it amounts to, cut off where its terms are
//! small ([`crate::Interpolation`]). The image is mirrored at its edges.

use pulp::Simd;

use crate::simd::{InBlocks, LANES};

/// What the prefilter of a kernel consists of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prefilter {
    /// Poles of the recursions, within the unit circle.
    pub(crate) poles: &'static [f64],
    /// Response to an impulse: at its place, and at the distances 1, 2 and so on to both sides. Its sum is 1.
    pub(crate) response: &'static [f32],
}

/// Rows of `width` values at a distance of `stride`, a multiple of [`LANES`].
pub(crate) struct Rows<'a> {
    pub(crate) values: &'a mut [f32],
    pub(crate) stride: usize,
    pub(crate) width: usize,
}

/// The pixels that coefficients are made of, row by row.
#[derive(Clone, Copy)]
pub(crate) struct Pixels<'a> {
    pub(crate) values: &'a [f32],
    /// Pixels in a row.
    pub(crate) width: usize,
    /// Pixels of a row before the one of the first coefficient.
    pub(crate) before: usize,
    /// What is taken from each.
    pub(crate) level: f32,
}

/// The coefficients of `pixels`; `line` is a buffer.
pub(crate) fn prefilter(rows: Rows<'_>, pixels: Pixels<'_>, filter: Prefilter, line: &mut Vec<f32>) {
    if !rows.values.is_empty() {
        line.resize(pixels.width + rows.stride + 2 * filter.response.len().max(1) + LANES, 0.0);
        Filtering { rows, pixels, filter, line }.dispatch();
    }
}

/// Terms after which the start of the recursion is exact to the digits of f32.
#[inline(always)]
fn horizon(pole: f32) -> usize {
    (-17.0 / f64::from(pole).abs().ln()).ceil() as usize
}

/// Index `i` on a line of `n` values that is mirrored at its ends.
#[inline(always)]
fn mirrored(i: isize, n: usize) -> usize {
    let last = n as isize - 1;
    if (0..=last).contains(&i) {
        return i as usize;
    }
    let folded = i.rem_euclid((2 * last).max(1));
    folded.min(2 * last - folded).max(0) as usize
}

struct Filtering<'a> {
    rows: Rows<'a>,
    pixels: Pixels<'a>,
    filter: Prefilter,
    line: &'a mut [f32],
}

impl InBlocks for Filtering<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(mut self, simd: S) {
        let height = self.rows.values.len() / self.rows.stride;
        match (self.pixels.width > 1, self.filter.response.len()) {
            (true, 6) => self.filter_rows::<S, 5, VECTORS>(simd),
            (true, 10) => self.filter_rows::<S, 9, VECTORS>(simd),
            (true, 11) => self.filter_rows::<S, 10, VECTORS>(simd),
            (true, 14) => self.filter_rows::<S, 13, VECTORS>(simd),
            _ => self.filter_rows::<S, 0, VECTORS>(simd),
        }
        // A filter's gain is 1 for a constant; along a column of one pixel nothing is filtered.
        for &pole in self.filter.poles.iter().filter(|_| height > 1) {
            self.rows.filter_columns::<S, VECTORS>(simd, pole, height);
        }
    }
}

impl Filtering<'_> {
    /// Loads the pixels and filters them along rows. The length of the sum is a constant of the compiled loop.
    #[inline(always)]
    fn filter_rows<S: Simd, const RADIUS: usize, const VECTORS: usize>(&mut self, simd: S) {
        let Pixels { values, width, before, level } = self.pixels;
        let mut taps = [0.0; RADIUS];
        taps.iter_mut().zip(self.filter.response.iter().skip(1)).for_each(|(to, tap)| *to = *tap);
        let centre = if RADIUS == 0 { 1.0 } else { self.filter.response[0] };
        // the same places in every row: divisions, which mirroring takes, are made once
        let mirror: [[usize; 2]; RADIUS] = std::array::from_fn(|i| {
            [-1 - i as isize, (width + i) as isize].map(|place| RADIUS + mirrored(place, width))
        });
        let rows = self.rows.values.chunks_exact_mut(self.rows.stride);
        for (row, pixels) in rows.zip(values.chunks_exact(width)) {
            let inside = &mut self.line[RADIUS..RADIUS + width];
            inside.iter_mut().zip(pixels).for_each(|(to, pixel)| *to = pixel - level);
            for (i, [left, right]) in mirror.into_iter().enumerate() {
                self.line[RADIUS - 1 - i] = self.line[left];
                self.line[RADIUS + width + i] = self.line[right];
            }
            for (first, block) in (0..).step_by(LANES).zip(row.as_chunks_mut::<LANES>().0) {
                let near = &self.line[before + first..][..LANES + 2 * RADIUS];
                let at = |i: usize, vector: usize| S::as_simd_f32s(&near[i..i + LANES]).0[vector];
                let out = S::as_mut_simd_f32s(block).0;
                for (vector, out) in out.iter_mut().enumerate().take(VECTORS) {
                    let mut sum = simd.mul_f32s(simd.splat_f32s(centre), at(RADIUS, vector));
                    for (before, &tap) in taps.iter().enumerate() {
                        let both =
                            simd.add_f32s(at(RADIUS - 1 - before, vector), at(RADIUS + 1 + before, vector));
                        sum = simd.mul_add_f32s(simd.splat_f32s(tap), both, sum);
                    }
                    *out = sum;
                }
            }
            row[self.rows.width..].fill(0.0);
        }
    }
}

impl Rows<'_> {
    /// One pole with its gain, down all columns.
    #[inline(always)]
    fn filter_columns<S: Simd, const VECTORS: usize>(&mut self, simd: S, pole: f64, height: usize) {
        let gain = ((1.0 - pole) * (1.0 - 1.0 / pole)) as f32;
        let (z, horizon, stride) = (pole as f32, horizon(pole as f32), self.stride);
        // Columns side by side hide the latency of the recursion; the values are the same in any order.
        for strip in 0..stride.div_ceil(4 * LANES) {
            let column = strip * 4 * LANES;
            let n = (stride - column).min(4 * LANES) / LANES;
            let part = Strip { stride, column, height };
            let pole = Pole { z, gain, horizon };
            match (n, VECTORS) {
                (4, 1) => part.filter::<S, 4>(simd, self.values, pole),
                (3, 1) => part.filter::<S, 3>(simd, self.values, pole),
                (2, 1) => part.filter::<S, 2>(simd, self.values, pole),
                (1, 1) => part.filter::<S, 1>(simd, self.values, pole),
                _ => (0..n).for_each(|i| {
                    let part = Strip { column: column + i * LANES, ..part };
                    part.filter::<S, VECTORS>(simd, self.values, pole);
                }),
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Pole {
    z: f32,
    gain: f32,
    horizon: usize,
}

/// Columns that are filtered side by side.
#[derive(Clone, Copy)]
struct Strip {
    stride: usize,
    column: usize,
    height: usize,
}

impl Strip {
    /// The recursion down and up, for `N` vectors of columns.
    #[inline(always)]
    fn filter<S: Simd, const N: usize>(&self, simd: S, values: &mut [f32], Pole { z, gain, horizon }: Pole) {
        let place = |row: usize| row * self.stride + self.column;
        let mut state = [simd.splat_f32s(0.0); N];
        let mut weight = gain;
        for i in 0..horizon {
            let row = &S::as_simd_f32s(&values[place(mirrored(i as isize, self.height))..]).0[..N];
            for k in 0..N {
                state[k] = simd.mul_add_f32s(simd.splat_f32s(weight), row[k], state[k]);
            }
            weight *= z;
        }
        let (z, gain) = (simd.splat_f32s(z), simd.splat_f32s(gain));
        let mut above = state;
        for y in 0..self.height {
            let row = &mut S::as_mut_simd_f32s(&mut values[place(y)..]).0[..N];
            above = state;
            for k in 0..N {
                if y > 0 {
                    state[k] = simd.mul_add_f32s(z, state[k], simd.mul_f32s(gain, row[k]));
                }
                row[k] = state[k];
            }
        }
        // the sum that goes up starts from z/(z^2 - 1) (c + z times the one above)
        let last = simd.div_f32s(z, simd.sub_f32s(simd.mul_f32s(z, z), simd.splat_f32s(1.0)));
        for k in 0..N {
            state[k] = simd.mul_f32s(last, simd.mul_add_f32s(z, above[k], state[k]));
        }
        for y in (0..self.height).rev() {
            let row = &mut S::as_mut_simd_f32s(&mut values[place(y)..]).0[..N];
            for k in 0..N {
                if y + 1 < self.height {
                    state[k] = simd.mul_f32s(z, simd.sub_f32s(state[k], row[k]));
                }
                row[k] = state[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recursion along a line by its definition, in f64.
    fn plain(line: &mut [f64], pole: f64) {
        let n = line.len();
        let gain = (1.0 - pole) * (1.0 - 1.0 / pole);
        let first: f64 = (0..200_i32).map(|i| pole.powi(i) * line[mirrored(i as isize, n)]).sum();
        line[0] = first;
        for i in 1..n {
            line[i] += pole * line[i - 1];
        }
        line[n - 1] = gain * pole / (pole * pole - 1.0) * (line[n - 1] + pole * line[n - 2]);
        for i in (0..n - 1).rev() {
            line[i] = pole * (line[i + 1] - gain * line[i]);
        }
    }

    /// The sum along a row by its definition, in f64.
    fn plain_sum(line: &[f64], response: &[f32]) -> Vec<f64> {
        let at = |i: isize| line[mirrored(i, line.len())];
        let side = |i: isize| -> f64 {
            let term = |(k, &tap): (usize, &f32)| f64::from(tap) * (at(i - k as isize) + at(i + k as isize));
            response.iter().enumerate().skip(1).map(term).sum()
        };
        (0..line.len() as isize).map(|i| f64::from(response[0]) * at(i) + side(i)).collect()
    }

    #[test]
    fn vectors_do_what_the_plain_loops_do() {
        for interpolation in crate::Interpolation::ALL.into_iter().skip(1) {
            let filter =
                Prefilter { poles: interpolation.poles(), response: interpolation.prefilter_response() };
            for (width, height) in [(2, 2), (3, 17), (16, 2), (33, 20), (61, 61), (130, 5)] {
                let pixels: Vec<f32> = (0..width * height).map(|i| ((i * 7919) % 4096) as f32).collect();
                let stride = usize::next_multiple_of(width, LANES);
                let mut values = vec![0.0; stride * height];
                let source = Pixels { values: &pixels, width, before: 0, level: 100.0 };
                prefilter(Rows { values: &mut values, stride, width }, source, filter, &mut Vec::new());
                let mut expected: Vec<f64> = pixels.iter().map(|&pixel| f64::from(pixel) - 100.0).collect();
                for row in expected.chunks_exact_mut(width) {
                    row.copy_from_slice(&plain_sum(row, filter.response));
                }
                for x in 0..width {
                    let mut column: Vec<f64> = (0..height).map(|y| expected[y * width + x]).collect();
                    filter.poles.iter().for_each(|&pole| plain(&mut column, pole));
                    (0..height).for_each(|y| expected[y * width + x] = column[y]);
                }
                for (i, expected) in expected.into_iter().enumerate() {
                    let found = f64::from(values[i / width * stride + i % width]);
                    // coefficients of up to 5e4 counts in f32, after sums whose parts are ten times as large
                    assert!((found - expected).abs() < 0.1, "{width} x {height}, {i}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_sum_that_is_cut_off_differs_little_from_the_recursion_where_speckles_are() {
        for interpolation in crate::Interpolation::ALL.into_iter().skip(1) {
            let response = interpolation.prefilter_response();
            for frequency in [0.0, 0.3, 0.7, 1.2] {
                let cosine = |k: usize| (frequency * k as f64).cos();
                let side: f64 =
                    response.iter().enumerate().skip(1).map(|(k, &tap)| f64::from(tap) * cosine(k)).sum();
                let found = f64::from(response[0]) + 2.0 * side;
                let pole = |z: &f64| (1.0 - z).powi(2) / (1.0 - 2.0 * z * cosine(1) + z * z);
                let exact: f64 = interpolation.poles().iter().map(pole).product();
                assert!(
                    (found / exact - 1.0).abs() < 3e-3,
                    "{interpolation} at {frequency}: {found} {exact}"
                );
            }
        }
    }
}
