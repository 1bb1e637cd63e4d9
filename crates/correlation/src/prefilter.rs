//! From pixels to spline coefficients, by recursive filters along columns and rows: box 2 of M. Unser, Splines: a
//! perfect fit for signal and image processing, IEEE Signal Process. Mag. 16 (1999) 22-38. The image is mirrored at
//! its edges.

use crate::simd::{LANES, sum_of_lanes, vectorised};

/// Rows of `width` values at a distance of `stride`, a multiple of [`LANES`]; zeros fill it up.
pub(crate) struct Rows<'a> {
    pub(crate) values: &'a mut [f32],
    pub(crate) stride: usize,
    pub(crate) width: usize,
}

/// The coefficients of `pixels` less `level`.
pub(crate) fn prefilter(mut rows: Rows<'_>, pixels: &[f32], level: f32, poles: &[f64]) {
    if rows.values.is_empty() {
        return;
    }
    vectorised(
        #[inline(always)]
        || {
            // A filter's gain is 1 for a constant; along a line of one pixel nothing is filtered.
            let (width, height) = (rows.width, rows.values.len() / rows.stride);
            let gain = |pole: f64| (1.0 - pole) * (1.0 - 1.0 / pole);
            let n_axes = i32::from(width > 1) + i32::from(height > 1);
            let gain = poles.iter().map(|&pole| gain(pole).powi(n_axes)).product::<f64>() as f32;
            rows.load(pixels, level, gain);
            for &pole in poles {
                if height > 1 {
                    rows.filter_columns(pole as f32, height);
                }
                if width > 1 {
                    rows.filter_rows(pole as f32);
                }
            }
        },
    );
}

/// Terms after which the start of the recursion is exact to the digits of f32.
#[inline(always)]
fn horizon(pole: f32) -> usize {
    (-17.0 / f64::from(pole).abs().ln()).ceil() as usize
}

/// Index `i` on a line of `n` values that is mirrored at its ends.
#[inline(always)]
fn mirrored(i: usize, n: usize) -> usize {
    if i < n {
        return i;
    }
    let period = (2 * n).saturating_sub(2).max(1);
    let i = i % period;
    if i < n { i } else { period - i }
}

impl Rows<'_> {
    #[inline(always)]
    fn load(&mut self, pixels: &[f32], level: f32, gain: f32) {
        let width = self.width;
        for (row, pixels) in self.values.chunks_exact_mut(self.stride).zip(pixels.chunks_exact(width)) {
            let (inside, padding) = row.split_at_mut(width);
            inside.iter_mut().zip(pixels).for_each(|(value, pixel)| *value = (pixel - level) * gain);
            padding.fill(0.0);
        }
    }

    /// One pole without its gain, down all columns.
    #[inline(always)]
    fn filter_columns(&mut self, z: f32, height: usize) {
        /// Columns side by side, to hide the latency of the recursion.
        const MANY: usize = 4 * LANES;
        let mut column = 0;
        while column + MANY <= self.stride {
            self.filter_strip::<MANY>(column, z, height);
            column += MANY;
        }
        while column < self.stride {
            self.filter_strip::<LANES>(column, z, height);
            column += LANES;
        }
    }

    #[inline(always)]
    fn filter_strip<const N: usize>(&mut self, column: usize, z: f32, height: usize) {
        let stride = self.stride;
        let mut state = [0.0_f32; N];
        let mut weight = 1.0;
        for i in 0..horizon(z) {
            let start = mirrored(i, height) * stride + column;
            let row = &self.values[start..start + N];
            for k in 0..N {
                state[k] += weight * row[k];
            }
            weight *= z;
        }
        let mut above = state;
        for (y, row) in self.values.chunks_exact_mut(stride).enumerate() {
            let row = &mut row[column..column + N];
            above = state;
            if y > 0 {
                for k in 0..N {
                    state[k] = row[k] + z * state[k];
                }
            }
            row.copy_from_slice(&state);
        }
        let last = z / (z * z - 1.0);
        for k in 0..N {
            state[k] = last * (state[k] + z * above[k]);
        }
        for (y, row) in self.values.chunks_exact_mut(stride).enumerate().rev() {
            let row = &mut row[column..column + N];
            if y + 1 < height {
                for k in 0..N {
                    state[k] = z * (state[k] - row[k]);
                }
            }
            row.copy_from_slice(&state);
        }
    }

    /// One pole without its gain, along all rows.
    #[inline(always)]
    fn filter_rows(&mut self, z: f32) {
        let recursion = Recursion::new(z);
        for row in self.values.chunks_exact_mut(self.stride) {
            recursion.filter(row, self.width);
        }
    }
}

/// A recursion along a row that takes [`LANES`] values at once: within them, sums over 2, 4, 8 and 16 values by
/// doubling.
struct Recursion {
    z: f32,
    horizon: usize,
    /// z to the power of 1, 2, 4 and 8.
    squares: [f32; 4],
    /// z to the power of 1 to 16.
    powers: [f32; LANES],
}

impl Recursion {
    #[inline(always)]
    fn new(z: f32) -> Self {
        let mut squares = [z; 4];
        for i in 1..4 {
            squares[i] = squares[i - 1] * squares[i - 1];
        }
        let mut powers = [z; LANES];
        for i in 1..LANES {
            powers[i] = powers[i - 1] * z;
        }
        Self { z, horizon: horizon(z), squares, powers }
    }

    #[inline(always)]
    fn filter(&self, row: &mut [f32], width: usize) {
        let z = self.z;
        row[0] = self.first(row, width);
        let mut before = 0.0;
        for values in row.as_chunks_mut::<LANES>().0 {
            *values = self.forwards(*values, before);
            before = values[LANES - 1];
        }
        let last = z / (z * z - 1.0) * (row[width - 1] + z * row[width - 2]);
        row[width - 1] = -last / z;
        row[width..].fill(0.0);
        let mut after = 0.0;
        for values in row.as_chunks_mut::<LANES>().0.iter_mut().rev() {
            *values = self.backwards(*values, after);
            after = values[0];
        }
    }

    /// The first value of the causal recursion.
    #[inline(always)]
    fn first(&self, row: &[f32], width: usize) -> f32 {
        if width < 2 * LANES || self.horizon > 2 * LANES {
            let (mut sum, mut weight) = (0.0, 1.0);
            for i in 0..self.horizon {
                sum += weight * row[mirrored(i, width)];
                weight *= self.z;
            }
            return sum;
        }
        let (near, far) = (&row[..LANES], &row[LANES..2 * LANES]);
        let mut sums = [0.0; LANES];
        for i in 0..LANES {
            let weight = if i == 0 { 1.0 } else { self.powers[i - 1] };
            sums[i] = weight * (near[i] + self.powers[LANES - 1] * far[i]);
        }
        sum_of_lanes(sums) as f32
    }

    /// The recursion `sum[i] = value[i] + z sum[i - 1]`, that begins with `before`.
    #[inline(always)]
    fn forwards(&self, values: [f32; LANES], before: f32) -> [f32; LANES] {
        let mut sums = add_earlier::<1>(values, self.squares[0]);
        sums = add_earlier::<2>(sums, self.squares[1]);
        sums = add_earlier::<4>(sums, self.squares[2]);
        sums = add_earlier::<8>(sums, self.squares[3]);
        sums.iter_mut().zip(&self.powers).for_each(|(sum, power)| *sum += power * before);
        sums
    }

    /// The recursion `sum[i] = z (sum[i + 1] - value[i])`, that ends with `after`.
    #[inline(always)]
    fn backwards(&self, mut values: [f32; LANES], after: f32) -> [f32; LANES] {
        for value in &mut values {
            *value *= -self.z;
        }
        let mut sums = add_later::<1>(values, self.squares[0]);
        sums = add_later::<2>(sums, self.squares[1]);
        sums = add_later::<4>(sums, self.squares[2]);
        sums = add_later::<8>(sums, self.squares[3]);
        sums.iter_mut().zip(self.powers.iter().rev()).for_each(|(sum, power)| *sum += power * after);
        sums
    }
}

#[inline(always)]
fn add_earlier<const SHIFT: usize>(values: [f32; LANES], factor: f32) -> [f32; LANES] {
    let mut sums = values;
    for (sum, earlier) in sums[SHIFT..].iter_mut().zip(&values) {
        *sum += factor * earlier;
    }
    sums
}

#[inline(always)]
fn add_later<const SHIFT: usize>(values: [f32; LANES], factor: f32) -> [f32; LANES] {
    let mut sums = values;
    for (sum, later) in sums.iter_mut().zip(&values[SHIFT..]) {
        *sum += factor * later;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recursion along a line by its definition, in f64.
    fn plain(line: &mut [f64], pole: f64) {
        let n = line.len();
        let gain = (1.0 - pole) * (1.0 - 1.0 / pole);
        let first: f64 = (0..200).map(|i| pole.powi(i as i32) * line[mirrored(i, n)]).sum();
        line[0] = first;
        for i in 1..n {
            line[i] += pole * line[i - 1];
        }
        line[n - 1] = gain * pole / (pole * pole - 1.0) * (line[n - 1] + pole * line[n - 2]);
        for i in (0..n - 1).rev() {
            line[i] = pole * (line[i + 1] - gain * line[i]);
        }
    }

    #[test]
    fn vectors_do_what_the_plain_recursion_does() {
        let poles = [-0.519_493_853_295_915_7, -0.096_117_967_977_924_31];
        for (width, height) in [(2, 2), (3, 17), (16, 2), (33, 20), (61, 61), (130, 5)] {
            let pixels: Vec<f32> = (0..width * height).map(|i| ((i * 7919) % 4096) as f32).collect();
            let stride = usize::next_multiple_of(width, LANES);
            let mut values = vec![0.0; stride * height];
            prefilter(Rows { values: &mut values, stride, width }, &pixels, 100.0, &poles);
            let mut expected: Vec<f64> = pixels.iter().map(|&pixel| f64::from(pixel) - 100.0).collect();
            for pole in poles {
                for row in expected.chunks_exact_mut(width) {
                    plain(row, pole);
                }
                for x in 0..width {
                    let mut column: Vec<f64> = (0..height).map(|y| expected[y * width + x]).collect();
                    plain(&mut column, pole);
                    (0..height).for_each(|y| expected[y * width + x] = column[y]);
                }
            }
            for (i, expected) in expected.into_iter().enumerate() {
                let found = f64::from(values[i / width * stride + i % width]);
                // coefficients of up to 5e4 counts in f32, after sums whose parts are ten times as large
                assert!((found - expected).abs() < 0.1, "{width} x {height}, {i}: {found} {expected}");
            }
        }
    }
}
