use chainwave_measurement::Region;

use crate::{CorrelationError, Interpolation};

/// The B-spline coefficients of a part of an image, made once and sampled at any place in it.
#[derive(Debug, Clone)]
pub struct Window {
    pub(crate) interpolation: Interpolation,
    pub(crate) region: Region,
    /// Row by row from the top, followed by [`PADDING`] zeros so that a vector load at the last pixel stays inside.
    pub(crate) coefficients: Vec<f32>,
    /// Counts that were taken from every pixel: a spline reproduces a constant, and small numbers keep their digits.
    pub(crate) level: f32,
}

/// Values behind the last row, at least the widest vector of [`crate::sample`].
const PADDING: usize = 8;

impl Window {
    /// The coefficients of `pixels` (counts, row by row from the top) in `region` of an image.
    ///
    /// # Errors
    /// [`CorrelationError::PixelCount`] when the pixels do not fill the region.
    pub fn new(
        region: Region,
        pixels: &[f32],
        interpolation: Interpolation,
    ) -> Result<Self, CorrelationError> {
        if pixels.len() != region.n_pixels() {
            return Err(CorrelationError::PixelCount { region, found: pixels.len() });
        }
        let mut window = Self::empty(interpolation);
        window.level = pixels.get(pixels.len() / 2).copied().unwrap_or(0.0);
        window.start(region).copy_from_slice(pixels);
        window.finish();
        Ok(window)
    }

    /// A window without pixels, to be filled again and again.
    pub(crate) fn empty(interpolation: Interpolation) -> Self {
        let region = Region { x: 0, y: 0, width: 0, height: 0 };
        Self { interpolation, region, coefficients: vec![0.0; PADDING], level: 0.0 }
    }

    /// Moves the window to `region` and hands out its pixels to be written; [`Window::finish`] must follow.
    pub(crate) fn start(&mut self, region: Region) -> &mut [f32] {
        self.region = region;
        self.coefficients.resize(region.n_pixels() + PADDING, 0.0);
        &mut self.coefficients[..region.n_pixels()]
    }

    /// Turns the pixels into coefficients, in place.
    pub(crate) fn finish(&mut self) {
        let n_pixels = self.region.n_pixels();
        let (pixels, padding) = self.coefficients.split_at_mut(n_pixels);
        padding.fill(0.0);
        pixels.iter_mut().for_each(|value| *value -= self.level);
        for &pole in self.interpolation.poles() {
            filter_columns(pixels, self.region.width, pole);
            filter_rows(pixels, self.region.width, pole);
        }
    }

    /// Whether a point (image coordinates) can be sampled from this window's own pixels.
    pub(crate) fn contains(&self, point: [f64; 2]) -> bool {
        can_sample(self.region, self.interpolation, point)
    }
}

/// Distance that a point keeps from the first and last place that could be sampled, so that the rounding of its
/// coordinates to f32 does not lead outside.
const ROUNDING_PX: f64 = 1e-3;

/// Whether all the pixels that interpolation at a point needs lie in `region`.
pub(crate) fn can_sample(region: Region, interpolation: Interpolation, [x, y]: [f64; 2]) -> bool {
    let (before, after) = (interpolation.taps_before(), interpolation.taps_after());
    let within = |value: f64, first: usize, n: usize| {
        let (low, high) = ((first + before) as f64, (first + n) as f64 - after as f64);
        value >= low + ROUNDING_PX && value < high - ROUNDING_PX
    };
    within(x, region.x, region.width) && within(y, region.y, region.height)
}

/// Terms after which the start of the recursion is exact to the digits of f32.
fn horizon(pole: f64) -> usize {
    (-17.0 / pole.abs().ln()).ceil() as usize
}

/// Index `i` on a line of `n` values that is mirrored at its ends.
fn mirrored(i: usize, n: usize) -> usize {
    let period = (2 * n).saturating_sub(2).max(1);
    let i = i % period;
    if i < n { i } else { period - i }
}

/// One pole of the prefilter, causal and then anticausal, down all columns at once: box 2 of M. Unser, Splines: a
/// perfect fit for signal and image processing, IEEE Signal Process. Mag. 16 (1999) 22-38.
fn filter_columns(pixels: &mut [f32], width: usize, pole: f64) {
    let height = pixels.len() / width.max(1);
    if height < 2 {
        return;
    }
    let z = pole as f32;
    let mut first = vec![0.0; width];
    let mut weight = 1.0;
    for i in 0..horizon(pole) {
        let row = mirrored(i, height) * width;
        for (sum, value) in first.iter_mut().zip(&pixels[row..row + width]) {
            *sum += weight * value;
        }
        weight *= z;
    }
    pixels[..width].copy_from_slice(&first);
    for y in 1..height {
        let (above, row) = pixels[(y - 1) * width..(y + 1) * width].split_at_mut(width);
        for (value, above) in row.iter_mut().zip(above) {
            *value += z * *above;
        }
    }
    let gain = ((1.0 - pole) * (1.0 - 1.0 / pole)) as f32;
    let last = gain * z / (z * z - 1.0);
    let (above, row) = pixels[(height - 2) * width..].split_at_mut(width);
    for (value, above) in row.iter_mut().zip(above) {
        *value = last * (*value + z * *above);
    }
    for y in (1..height).rev() {
        let (row, below) = pixels[(y - 1) * width..(y + 1) * width].split_at_mut(width);
        for (value, below) in row.iter_mut().zip(below) {
            *value = z * (*below - gain * *value);
        }
    }
}

/// Rows that are filtered side by side, to hide the latency of the recursion.
const ROWS: usize = 8;

/// As [`filter_columns`], along the rows.
fn filter_rows(pixels: &mut [f32], width: usize, pole: f64) {
    if width < 2 {
        return;
    }
    let mut blocks = pixels.chunks_exact_mut(ROWS * width);
    for block in &mut blocks {
        filter_row_block::<ROWS>(block, width, pole);
    }
    for row in blocks.into_remainder().chunks_exact_mut(width) {
        filter_row_block::<1>(row, width, pole);
    }
}

fn filter_row_block<const N: usize>(block: &mut [f32], width: usize, pole: f64) {
    let z = pole as f32;
    let mut state = [0.0; N];
    let mut weight = 1.0;
    for i in 0..horizon(pole) {
        let x = mirrored(i, width);
        for (sum, row) in state.iter_mut().zip(block.chunks_exact(width)) {
            *sum += weight * row[x];
        }
        weight *= z;
    }
    let mut rows = block.chunks_exact_mut(width);
    let mut rows: [&mut [f32]; N] = std::array::from_fn(|_| rows.next().unwrap_or_default());
    for (row, first) in rows.iter_mut().zip(state) {
        row[0] = first;
    }
    for x in 1..width {
        for (row, state) in rows.iter_mut().zip(&mut state) {
            *state = row[x] + z * *state;
            row[x] = *state;
        }
    }
    let gain = ((1.0 - pole) * (1.0 - 1.0 / pole)) as f32;
    let last = gain * z / (z * z - 1.0);
    for (row, state) in rows.iter_mut().zip(&mut state) {
        *state = last * (row[width - 1] + z * row[width - 2]);
        row[width - 1] = *state;
    }
    for x in (0..width - 1).rev() {
        for (row, state) in rows.iter_mut().zip(&mut state) {
            *state = z * (*state - gain * row[x]);
            row[x] = *state;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::sample_row;

    fn value(window: &Window, [x, y]: [f64; 2]) -> f64 {
        let mut out = [0.0];
        sample_row(window, [x, y], [1.0, 0.0], &[0.0], &mut out);
        f64::from(out[0]) + f64::from(window.level)
    }

    fn wavy(x: f64, y: f64) -> f64 {
        1000.0 + 300.0 * (0.7 * x + 0.2 * y).sin() + 200.0 * (0.3 * x - 0.5 * y).cos()
    }

    fn image(region: Region, f: fn(f64, f64) -> f64) -> Vec<f32> {
        let place = |i: usize| ((region.x + i % region.width) as f64, (region.y + i / region.width) as f64);
        (0..region.n_pixels()).map(place).map(|(x, y)| f(x, y) as f32).collect()
    }

    #[test]
    fn the_spline_passes_through_every_pixel() {
        let region = Region { x: 3, y: 5, width: 23, height: 19 };
        for interpolation in Interpolation::ALL {
            let window = Window::new(region, &image(region, wavy), interpolation).unwrap();
            for (x, y) in [(6, 8), (10, 12), (20, 20), (14, 9)] {
                let (x, y) = (x as f64, y as f64);
                // f32 coefficients of about 1000 counts, a sum of up to 36 products
                assert!((value(&window, [x, y]) - wavy(x, y)).abs() < 2e-3, "{interpolation} at {x}, {y}");
            }
        }
    }

    #[test]
    fn the_error_falls_with_the_order_of_the_spline() {
        // A wave of angular frequency h per pixel: the error falls as h^(degree + 1).
        for (interpolation, order) in [(Interpolation::Linear, 2.0), (Interpolation::Cubic, 4.0)] {
            let error = |h: f64| {
                let n = 64;
                let region = Region::whole(n, n);
                let pixels: Vec<f32> = (0..n * n).map(|i| 1e3 * (h * (i % n) as f64).sin() as f32).collect();
                let window = Window::new(region, &pixels, interpolation).unwrap();
                let at = |k: usize| 24.0 + 0.37 * k as f64;
                (0..40)
                    .map(|k| (value(&window, [at(k), 30.0]) - 1e3 * (h * at(k)).sin()).powi(2))
                    .sum::<f64>()
                    .sqrt()
            };
            let measured = (error(0.6) / error(0.3)).log2();
            assert!((measured - order).abs() < 0.3, "{interpolation}: order {measured}");
        }
    }

    #[test]
    fn the_margin_keeps_the_start_of_the_recursion_out() {
        for interpolation in [Interpolation::Cubic, Interpolation::Quintic] {
            let whole = Region::whole(80, 80);
            let all = Window::new(whole, &image(whole, wavy), interpolation).unwrap();
            let margin = interpolation.prefilter_margin_px();
            let part = Region { x: 30, y: 30, width: 30, height: 30 };
            let local = Window::new(part, &image(part, wavy), interpolation).unwrap();
            let at = 30.0 + (margin + interpolation.taps_before()) as f64 + 0.5;
            let error = (value(&local, [at, at]) - value(&all, [at, at])).abs();
            // The mirrored wave of 300 counts has a kink whose effect is below 4e-4 of them.
            assert!(error < 0.12, "{interpolation}: {error} counts");
        }
    }

    #[test]
    fn a_window_of_a_few_pixels_is_no_trouble() {
        for (width, height) in [(1, 1), (2, 1), (1, 2), (3, 2)] {
            let region = Region::whole(width, height);
            for interpolation in Interpolation::ALL {
                let window = Window::new(region, &vec![7.0; width * height], interpolation).unwrap();
                assert!(!window.contains([width as f64, 0.0]));
            }
        }
        assert!(Window::new(Region::whole(2, 2), &[0.0], Interpolation::Cubic).is_err());
    }
}
