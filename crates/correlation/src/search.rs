//! Search for a subset at whole-pixel shifts.

mod deformed;
mod fourier;

pub(crate) use deformed::Patch;

use chainwave_measurement::{ReadError, Recording, Region};

use crate::search::fourier::{Image, correlations};
use crate::simd::{LANES, dot, sum_of_lanes, vectorised};
use crate::warp::Warp;
use crate::{PreparedSubset, Window};

/// Searches around a place for the subset at whole-pixel shifts, by the zero-normalised cross-correlation.
///
/// Returns where the subset's centre lies in the best match inside the frame; `None` when the subset fits nowhere in
/// the searched part of the frame, or nothing there has contrast.
pub(crate) fn search(
    recording: &dyn Recording,
    frame: usize,
    subset: &PreparedSubset,
    around_px: [f64; 2],
) -> Result<Option<[f64; 2]>, ReadError> {
    let scene = SearchArea::read(recording, frame, subset, around_px)?;
    Ok(scene.and_then(|scene| scene.find(&Template::upright(subset))).map(|found| found.place_px))
}

/// As [`search`], for the subset turned by every angle but 0.
pub(crate) fn search_turned(
    recording: &dyn Recording,
    frame: usize,
    subset: &PreparedSubset,
    around_px: [f64; 2],
) -> Result<Option<Warp>, ReadError> {
    Ok(SearchArea::read(recording, frame, subset, around_px)?.and_then(|scene| scene.find_turned(subset)))
}

/// Angles that a turned subset is searched at: neighbours are near enough for an iteration to start from.
const N_ANGLES: usize = 24;

/// The pixels that a subset is searched in.
pub(crate) struct SearchArea {
    region: Region,
    /// Less a level near their mean.
    pixels: Vec<f32>,
    table: SummedArea,
}

/// The best place in a scene.
pub(crate) struct Found {
    /// Where the template's centre lies.
    pub(crate) place_px: [f64; 2],
    pub(crate) zncc: f64,
}

impl SearchArea {
    /// All pixels of a window.
    pub(crate) fn of(window: &Window) -> Self {
        Self::new(window.source, window.pixels.clone(), window.level)
    }

    /// The pixels of a window within some columns and rows of a place; `None` outside of the image.
    pub(crate) fn around(window: &Window, [x, y]: [f64; 2], [columns, rows]: [usize; 2]) -> Option<Self> {
        let Region { x: left, y: top, width, height } = window.source;
        let (x, y) = (x.round() as i64 - left as i64, y.round() as i64 - top as i64);
        let (columns, rows) = (columns as i64, rows as i64);
        let part = Region::clipped(x - columns, y - rows, x + columns + 1, y + rows + 1, width, height)?;
        let lines = window.pixels.chunks_exact(width).skip(part.y).take(part.height);
        let pixels = lines.flat_map(|line| line[part.x..part.x + part.width].iter().copied()).collect();
        let region = Region { x: left + part.x, y: top + part.y, ..part };
        Some(Self::new(region, pixels, window.level))
    }

    /// Number of its pixels.
    pub(crate) fn n_pixels(&self) -> usize {
        self.pixels.len()
    }

    /// A scene from its pixels, row by row.
    pub(crate) fn new(region: Region, mut pixels: Vec<f32>, level: f32) -> Self {
        pixels.iter_mut().for_each(|pixel| *pixel -= level);
        let table = SummedArea::new(region.width, &pixels);
        Self { region, pixels, table }
    }

    fn read(
        recording: &dyn Recording,
        frame: usize,
        subset: &PreparedSubset,
        around_px: [f64; 2],
    ) -> Result<Option<Self>, ReadError> {
        let Some(region) = region_around(recording, subset, around_px) else { return Ok(None) };
        let mut pixels = vec![0.0; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels)?;
        Ok(Some(Self::new(region, pixels, subset.mean as f32)))
    }

    /// The best of all places inside the scene; of equal ones the first, so the result is the same everywhere.
    pub(crate) fn find(&self, template: &Template) -> Option<Found> {
        let columns = (self.region.width + 1).saturating_sub(template.width);
        let rows = (self.region.height + 1).saturating_sub(template.height);
        let directly = |column: usize, row: usize| {
            template.correlate(self.region.width, &self.pixels[row * self.region.width + column..])
        };
        let transformed = self.covariances(template, columns * rows);
        let mut best = (0.0, None);
        for row in 0..rows {
            for column in 0..columns {
                let variation = self.table.variation(column, row, template.width, template.height);
                let covariance = match &transformed {
                    Some(all) => f64::from(all[row * columns + column]),
                    None => directly(column, row),
                };
                let score = covariance / variation.sqrt();
                // false for NaN, which a patch without contrast gives
                if score > best.0 {
                    best = (score, Some([(self.region.x + column) as f64, (self.region.y + row) as f64]));
                }
            }
        }
        let (score, place) = best;
        let [x, y] = template.first_px;
        place.map(|[column, row]| Found {
            place_px: [column - x, row - y],
            zncc: score / template.energy.sqrt(),
        })
    }

    /// The sums of the template times the pixels under it at all `n_places`, row by row, by Fourier transforms where that
    /// takes less work than each sum by itself.
    fn covariances(&self, template: &Template, n_places: usize) -> Option<Vec<f32>> {
        let scene = Image { width: self.region.width, values: &self.pixels };
        let template = Image { width: template.width, values: &template.values };
        // a transform has some 15 N log2 N operations for the two there and the one back, of which vectors take 2 at once,
        // and 8 or more of a sum's
        let n = scene.values.len() as f64;
        let by_sums = n_places as f64 * template.values.len() as f64 / 8.0;
        (by_sums > 15.0 * n * n.log2() / 2.0).then(|| correlations(scene, template))
    }

    /// The correlation where the template's centre lies at a place, on whole pixels of the scene; `None` beyond it.
    pub(crate) fn zncc_at(&self, template: &Template, place_px: [f64; 2]) -> Option<f64> {
        let Region { x, y, width, height } = self.region;
        let index = |axis: usize, first: usize, n: usize, size: usize| {
            let index = (place_px[axis] + template.first_px[axis]).round() - first as f64;
            (index >= 0.0 && index + size as f64 <= n as f64).then_some(index as usize)
        };
        let (column, row) = (index(0, x, width, template.width)?, index(1, y, height, template.height)?);
        let variation = self.table.variation(column, row, template.width, template.height);
        let covariance = template.correlate(width, &self.pixels[row * width + column..]);
        Some(covariance / (variation * template.energy).sqrt())
    }

    /// Where the scene lies, and its pixels less a level.
    #[cfg(feature = "opencv")]
    pub(crate) fn pixels(&self) -> (Region, &[f32]) {
        (self.region, &self.pixels)
    }

    /// The pixels of a rectangle, row by row; `None` where it reaches beyond the scene.
    pub(crate) fn part(&self, [left, top]: [i64; 2], width: usize, height: usize) -> Option<Vec<f32>> {
        let column = usize::try_from(left - self.region.x as i64).ok()?;
        let row = usize::try_from(top - self.region.y as i64).ok()?;
        let inside = column + width <= self.region.width && row + height <= self.region.height;
        let rows = self.pixels.chunks_exact(self.region.width).skip(row).take(height);
        inside.then(|| rows.flat_map(|row| row[column..column + width].iter().copied()).collect())
    }

    /// The best place and angle of the turned subset.
    pub(crate) fn find_turned(&self, subset: &PreparedSubset) -> Option<Warp> {
        let mut best: Option<(f64, Warp)> = None;
        for step in 1..N_ANGLES {
            let angle_rad = std::f64::consts::TAU * step as f64 / N_ANGLES as f64;
            let Some(found) = self.find(&Template::turned(subset, angle_rad)) else { continue };
            if best.is_none_or(|(zncc, _)| found.zncc > zncc) {
                best = Some((found.zncc, Warp::turned(found.place_px, angle_rad)));
            }
        }
        best.map(|(_, warp)| warp)
    }
}

/// The pixels of all the subset's candidates, inside the frame; `None` when there is no candidate.
fn region_around(recording: &dyn Recording, subset: &PreparedSubset, [x, y]: [f64; 2]) -> Option<Region> {
    let info = recording.info();
    let radius = subset.settings.search_radius_px as i64;
    let first = |centre: f64, offset: f64| (centre + offset).round() as i64;
    let (left, top) = (first(x, subset.first_px[0]), first(y, subset.first_px[1]));
    let end = |start: i64, n: usize| start.saturating_add(n as i64).saturating_add(radius);
    let region = Region::clipped(
        left.saturating_sub(radius),
        top.saturating_sub(radius),
        end(left, subset.width),
        end(top, subset.height),
        info.width_px,
        info.height_px,
    )?;
    (region.width >= subset.width && region.height >= subset.height).then_some(region)
}

/// What is searched for: grey values less their mean, row by row.
pub(crate) struct Template {
    width: usize,
    height: usize,
    /// Place of the first pixel, relative to the centre.
    first_px: [f64; 2],
    values: Vec<f32>,
    /// Sum of the squares of `values`.
    energy: f64,
}

impl Template {
    /// The subset as it is.
    pub(crate) fn upright(subset: &PreparedSubset) -> Self {
        let mut values = subset.template.clone();
        remove_mean(&mut values);
        Self::new(subset.width, subset.height, subset.first_px, values)
    }

    /// What lies in the circle around the subset's centre, turned from x towards y; the square in that circle.
    fn turned(subset: &PreparedSubset, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let radius = 0.5 * subset.width.min(subset.height).saturating_sub(2) as f64;
        let half = (radius / std::f64::consts::SQRT_2) as usize;
        let side = 2 * half + 1;
        let value = |i: usize| {
            let (x, y) = ((i % side) as f64 - half as f64, (i / side) as f64 - half as f64);
            bilinear(subset, [cos * x + sin * y, cos * y - sin * x])
        };
        let mut values: Vec<f32> = (0..side * side).map(value).collect();
        remove_mean(&mut values);
        Self::new(side, side, [-(half as f64); 2], values)
    }

    /// Values of a rectangle, row by row.
    pub(crate) fn new(width: usize, height: usize, first_px: [f64; 2], values: Vec<f32>) -> Self {
        let energy = dot(&values, &values);
        Self { width, height, first_px, values, energy }
    }

    /// Sum of the values times the pixels under them.
    pub(crate) fn correlate(&self, width: usize, pixels: &[f32]) -> f64 {
        vectorised(
            #[inline(always)]
            || {
                let mut lanes = [0.0_f32; LANES];
                let mut total = 0.0_f32;
                for (f, g) in self.values.chunks_exact(self.width).zip(pixels.chunks(width)) {
                    let g = &g[..self.width];
                    let (f_lanes, f_rest) = f.as_chunks::<LANES>();
                    let (g_lanes, g_rest) = g.as_chunks::<LANES>();
                    for (f, g) in f_lanes.iter().zip(g_lanes) {
                        for i in 0..LANES {
                            lanes[i] += f[i] * g[i];
                        }
                    }
                    total += f_rest.iter().zip(g_rest).map(|(f, g)| f * g).sum::<f32>();
                }
                f64::from(total) + sum_of_lanes(lanes)
            },
        )
    }
}

fn remove_mean(values: &mut [f32]) {
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    values.iter_mut().for_each(|value| *value -= mean);
}

/// The subset's grey value at a place (from its centre), between its pixels by their weights.
fn bilinear(subset: &PreparedSubset, [x, y]: [f64; 2]) -> f32 {
    let (x, y) = (x - subset.first_px[0], y - subset.first_px[1]);
    let last = |n: usize| n.saturating_sub(2);
    let (column, row) = ((x as usize).min(last(subset.width)), (y as usize).min(last(subset.height)));
    let (t, s) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let at = |i: usize, j: usize| subset.template[(row + j) * subset.width + column + i];
    (1.0 - s) * ((1.0 - t) * at(0, 0) + t * at(1, 0)) + s * ((1.0 - t) * at(0, 1) + t * at(1, 1))
}

/// Sums of pixels and of their squares over any rectangle, in four look-ups.
struct SummedArea {
    stride: usize,
    /// Sum and sum of squares above and to the left of a pixel.
    sums: Vec<[f64; 2]>,
}

impl SummedArea {
    fn new(width: usize, pixels: &[f32]) -> Self {
        let stride = width + 1;
        let mut sums = vec![[0.0; 2]; stride * (pixels.len() / width + 1)];
        for (y, row) in pixels.chunks_exact(width).enumerate() {
            let mut along = [0.0; 2];
            for (x, &pixel) in row.iter().enumerate() {
                let pixel = f64::from(pixel);
                along = [along[0] + pixel, along[1] + pixel * pixel];
                let above = sums[y * stride + x + 1];
                sums[(y + 1) * stride + x + 1] = [above[0] + along[0], above[1] + along[1]];
            }
        }
        Self { stride, sums }
    }

    /// Sum of squared differences from the mean over a rectangle.
    fn variation(&self, x: usize, y: usize, width: usize, height: usize) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * self.stride + x];
        let corners = [at(x + width, y + height), at(x, y), at(x + width, y), at(x, y + height)];
        let [sum, square] = [0, 1].map(|i| corners[0][i] + corners[1][i] - corners[2][i] - corners[3][i]);
        square - sum * sum / (width * height) as f64
    }
}

/// The correlation above which a place found by search is no coincidence.
///
/// Over n independent speckles, atanh(ZNCC) of unrelated patches is normal with variance 1/(n - 3) (R. A. Fisher,
/// 1921); 5.5 standard deviations are passed once in 5e7 candidates. With the autocorrelation of a Gaussian speckle,
/// exp(-(k_x x^2 + k_y y^2)/2), k = mean f_x^2 / mean f^2, a pixel counts sqrt(k_x k_y)/pi.
pub(crate) fn chance_zncc(subset: &PreparedSubset) -> f64 {
    (5.5 / (n_independent(subset) - 3.0).max(1.0).sqrt()).tanh()
}

/// Independent speckles of a subset.
pub(crate) fn n_independent(subset: &PreparedSubset) -> f64 {
    let [k_x, k_y] = [&subset.gradient_x, &subset.gradient_y].map(|g| dot(g, g) / subset.energy);
    subset.n_used as f64 * (k_x * k_y).sqrt() / std::f64::consts::PI
}
