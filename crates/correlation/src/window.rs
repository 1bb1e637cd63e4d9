//! A part of an image with its spline coefficients, sampled anywhere.

mod cardinal;
pub(crate) mod kernel;
mod prefilter;
pub(crate) mod sample;

use chainwave_measurement::Region;

use crate::simd::LANES;
use crate::window::prefilter::{Pixels, Prefilter, Rows, prefilter};
use crate::{CorrelationError, Interpolation};

/// The spline coefficients of a part of an image, made once and sampled at any place in it.
#[derive(Debug, Clone)]
pub struct Window {
    pub(crate) interpolation: Interpolation,
    /// Where the coefficients lie.
    pub(crate) region: Region,
    /// Where the pixels lie that they are made of.
    pub(crate) source: Region,
    /// Counts, row by row from the top.
    pub(crate) pixels: Vec<f32>,
    /// Row by row from the top, after [`LANES`] zeros and before twice as many, so that a vector of which some values are
    /// not used stays inside.
    pub(crate) coefficients: Vec<f32>,
    /// Coefficients from one row to the next: the width, filled up to whole vectors by zeros.
    pub(crate) stride: usize,
    /// Counts that were taken from every pixel: a spline reproduces a constant, and small numbers keep their digits.
    pub(crate) level: f32,
    /// Counts at and above which a pixel saturates.
    full_scale: f32,
    /// Whether any pixel saturates or is no number, and then, whether each does.
    has_flagged: bool,
    flags: Vec<bool>,
    /// A buffer of the prefilter.
    line: Vec<f32>,
}

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
        Self::saturating_at(region, pixels, interpolation, f64::INFINITY)
    }

    /// As [`Window::new`]; what is matched in the window leaves out the pixels at `full_scale` (counts) and above. Those
    /// that are no numbers are left out in any case.
    ///
    /// # Errors
    /// As [`Window::new`].
    pub fn saturating_at(
        region: Region,
        pixels: &[f32],
        interpolation: Interpolation,
        full_scale: f64,
    ) -> Result<Self, CorrelationError> {
        if pixels.len() != region.n_pixels() {
            return Err(CorrelationError::PixelCount { region, found: pixels.len() });
        }
        let mut window = Self::empty(interpolation);
        window.full_scale = full_scale as f32;
        let middle = pixels.get(pixels.len() / 2).filter(|pixel| pixel.is_finite());
        window.level =
            middle.or_else(|| pixels.iter().find(|pixel| pixel.is_finite())).copied().unwrap_or(0.0);
        window.start(region, [0; 2]).copy_from_slice(pixels);
        window.finish();
        Ok(window)
    }

    /// The kernel of the spline.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// A window without pixels, to be filled again and again.
    pub(crate) fn empty(interpolation: Interpolation) -> Self {
        let region = Region { x: 0, y: 0, width: 0, height: 0 };
        let coefficients = vec![0.0; 3 * LANES];
        let (pixels, line) = (Vec::new(), Vec::new());
        Self {
            interpolation,
            region,
            source: region,
            pixels,
            coefficients,
            stride: 0,
            level: 0.0,
            full_scale: f32::INFINITY,
            has_flagged: false,
            flags: Vec::new(),
            line,
        }
    }

    /// Moves the window to `source` and hands out its pixels to be written; [`Window::finish`] must follow. Of the first
    /// and last columns so many are for the filter alone: no coefficients are made there.
    pub(crate) fn start(&mut self, source: Region, [left, right]: [usize; 2]) -> &mut [f32] {
        self.source = source;
        self.region =
            Region { x: source.x + left, width: source.width.saturating_sub(left + right), ..source };
        self.stride = self.region.width.next_multiple_of(LANES);
        self.pixels.resize(source.n_pixels(), 0.0);
        self.coefficients.resize(self.stride * source.height + 3 * LANES, 0.0);
        &mut self.pixels
    }

    /// A window without pixels, of which those at `full_scale` and above saturate.
    pub(crate) fn empty_of(interpolation: Interpolation, full_scale: f64) -> Self {
        Self { full_scale: full_scale as f32, ..Self::empty(interpolation) }
    }

    /// Turns the pixels into coefficients. One that is no number becomes the window's level, an infinite one full scale where that is known.
    pub(crate) fn finish(&mut self) {
        let full_scale = self.full_scale;
        let usable = |pixel: f32| pixel < full_scale;
        let pixels = &self.pixels;
        self.has_flagged = chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || pixels.iter().fold(false, |flagged, &pixel| flagged | !usable(pixel)),
        );
        if self.has_flagged {
            let full = if full_scale.is_finite() { full_scale } else { self.level };
            let instead = |pixel: f32| if pixel.is_nan() { self.level } else { full };
            self.flags.clear();
            self.flags.extend(self.pixels.iter().map(|&pixel| !usable(pixel)));
            self.pixels
                .iter_mut()
                .filter(|pixel| !pixel.is_finite())
                .for_each(|pixel| *pixel = instead(*pixel));
        }
        let n = self.stride * self.region.height;
        self.coefficients[LANES + n..].fill(0.0);
        let (width, before) = (self.region.width, self.region.x - self.source.x);
        let rows = Rows { values: &mut self.coefficients[LANES..LANES + n], stride: self.stride, width };
        let pixels = Pixels { values: &self.pixels, width: self.source.width, before, level: self.level };
        let filter = Prefilter {
            poles: self.interpolation.poles(),
            response: self.interpolation.prefilter_response(),
        };
        prefilter(rows, pixels, filter, &mut self.line);
    }

    /// Counts at and above which a pixel saturates.
    pub(crate) fn full_scale(&self) -> f64 {
        f64::from(self.full_scale)
    }

    /// The pixels that saturate or are no numbers between two corners, in image coordinates.
    pub(crate) fn flags_within(&self, [low, high]: [[f64; 2]; 2]) -> impl Iterator<Item = [f64; 2]> {
        let Region { x, y, width, height } = self.source;
        let flags: &[bool] = if self.has_flagged { &self.flags } else { &[] };
        let range = |axis: usize, first: usize, n: usize| {
            let place = |at: f64| (at - first as f64).clamp(0.0, n as f64) as usize;
            place(low[axis].floor())..place(high[axis].ceil() + 1.0)
        };
        let (columns, rows) = (range(0, x, width), range(1, y, height));
        let lines = flags.chunks_exact(width.max(1)).enumerate().skip(rows.start).take(rows.len());
        lines.flat_map(move |(row, line)| {
            let flagged = columns.clone().filter(|column| line[*column]);
            flagged.map(move |column| [(x + column) as f64, (y + row) as f64]).collect::<Vec<_>>()
        })
    }

    /// Index of the first coefficient that a point in the pixel at `(column, row)` of the window needs.
    #[inline(always)]
    pub(crate) fn corner<const TAPS: usize>(&self, column: isize, row: isize) -> usize {
        let before = (TAPS / 2 - 1) as isize;
        ((row - before) * self.stride as isize + column - before) as usize + LANES
    }

    /// Whether a point (image coordinates) can be sampled from this window's own pixels.
    pub(crate) fn contains(&self, point: [f64; 2]) -> bool {
        can_sample(self.region, self.interpolation, point)
    }

    /// By how much a rectangle of points (image coordinates) has to be moved so that all of them can be sampled; `None` where it is
    /// too large.
    pub(crate) fn move_inside(&self, [first, last]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
        let spans = sampled(self.region, self.interpolation);
        let mut by = [0.0; 2];
        for axis in 0..2 {
            let [low, high] = spans[axis];
            let (ahead, behind) = ((low - first[axis]).max(0.0), (last[axis] - high).max(0.0));
            if ahead > 0.0 && behind > 0.0 {
                return None;
            }
            by[axis] = ahead - behind;
        }
        Some(by)
    }
}

/// Distance that a point keeps from the first and last place that could be sampled, so that the rounding of its
/// coordinates to f32 does not lead outside.
const ROUNDING_PX: f64 = 1e-3;

/// Whether all the pixels that interpolation at a point needs lie in `region`.
pub(crate) fn can_sample(region: Region, interpolation: Interpolation, [x, y]: [f64; 2]) -> bool {
    let within = |value: f64, [low, high]: [f64; 2]| value >= low && value < high;
    let [columns, rows] = sampled(region, interpolation);
    within(x, columns) && within(y, rows)
}

/// The columns and the rows between which points can be sampled from a region.
fn sampled(region: Region, interpolation: Interpolation) -> [[f64; 2]; 2] {
    let (before, after) = (interpolation.taps_before(), interpolation.taps_after());
    [(region.x, region.width), (region.y, region.height)].map(|(first, n)| {
        [(first + before) as f64 + ROUNDING_PX, (first + n) as f64 - after as f64 - ROUNDING_PX]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::Warp;
    use crate::window::sample::{Lattice, sample};

    fn value(window: &Window, point: [f64; 2]) -> f64 {
        let mut out = [0.0; 1 + LANES];
        let lattice = Lattice { first_px: [0.0; 2], width: 1, height: 1 };
        sample(window, &Warp::at(point), lattice, &mut Vec::new(), &mut out);
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
                // the prefilter's sum is cut off, which changes these waves of 500 counts by up to 5e-3
                let error = (value(&window, [x, y]) - wavy(x, y)).abs();
                assert!(error < 2.5, "{interpolation} at {x}, {y}: {error}");
            }
        }
    }

    #[test]
    fn the_error_falls_with_the_order_of_the_spline() {
        // A wave of angular frequency h per pixel along a column: the error falls as h^(degree + 1).
        for (interpolation, order) in [(Interpolation::Linear, 2.0), (Interpolation::Cubic, 4.0)] {
            let error = |h: f64| {
                let n = 64;
                let region = Region::whole(n, n);
                let pixels: Vec<f32> = (0..n * n).map(|i| 1e3 * (h * (i / n) as f64).sin() as f32).collect();
                let window = Window::new(region, &pixels, interpolation).unwrap();
                let at = |k: usize| 24.0 + 0.37 * k as f64;
                (0..40)
                    .map(|k| (value(&window, [30.0, at(k)]) - 1e3 * (h * at(k)).sin()).powi(2))
                    .sum::<f64>()
                    .sqrt()
            };
            let measured = (error(0.6) / error(0.3)).log2();
            assert!((measured - order).abs() < 0.3, "{interpolation}: order {measured}");
        }
    }

    #[test]
    fn the_margin_keeps_the_start_of_the_recursion_out() {
        for interpolation in Interpolation::ALL {
            let whole = Region::whole(80, 80);
            let all = Window::new(whole, &image(whole, wavy), interpolation).unwrap();
            let margin = interpolation.prefilter_margin_px();
            let part = Region { x: 30, y: 30, width: 30, height: 30 };
            let local = Window::new(part, &image(part, wavy), interpolation).unwrap();
            let at = 30.0 + (margin + interpolation.taps_before()) as f64 + 0.5;
            let error = (value(&local, [at, at]) - value(&all, [at, at])).abs();
            // The mirrored wave of 300 counts has a kink whose effect is below 8e-4 of them.
            assert!(error < 0.24, "{interpolation}: {error} counts");
        }
    }

    #[test]
    fn a_pixel_that_is_no_number_spoils_no_others() {
        let whole = Region::whole(21, 21);
        for bad in [f32::NAN, f32::INFINITY] {
            let mut pixels = image(whole, wavy);
            let middle = pixels.len() / 2;
            pixels[middle] = bad;
            let window = Window::new(whole, &pixels, Interpolation::Cubic).unwrap();
            let error = (value(&window, [5.0, 5.0]) - wavy(5.0, 5.0)).abs();
            // The pixel that stands in for it rings by 0.27 of each pixel's: of a thousand counts, over seven columns and rows.
            assert!(error < 2.5, "{bad}: {error}");
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
