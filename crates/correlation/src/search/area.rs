//! The pixels that are searched, and the places in them that resemble a template.

use chainwave_measurement::Region;

use crate::Window;
use crate::search::fourier::{Image, correlations};
use crate::search::sums::sums;
use crate::search::template::Template;

/// Share of the template's energy that pixels under it must have to be compared with it: a thousandth of its contrast.
const NO_CONTRAST: f64 = 1e-6;

/// The pixels that a subset is searched in.
pub(crate) struct SearchArea {
    pub(crate) region: Region,
    /// Less a level near their mean.
    pub(crate) pixels: Vec<f32>,
    table: SummedArea,
}

/// A place in a scene that resembles a template.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    /// Where the template's centre lies.
    pub(crate) place_px: [f64; 2],
    pub(crate) zncc: f64,
}

impl SearchArea {
    /// A scene from its pixels, row by row; what is no number counts as the level.
    pub(crate) fn new(region: Region, mut pixels: Vec<f32>, level: f32) -> Self {
        let less = |pixel: f32| if pixel.is_finite() { pixel - level } else { 0.0 };
        pixels.iter_mut().for_each(|pixel| *pixel = less(*pixel));
        let table = SummedArea::new(region.width, &pixels);
        Self { region, pixels, table }
    }

    /// All pixels of a window.
    pub(crate) fn of(window: &Window) -> Self {
        Self::new(window.source, window.pixels.clone(), window.level)
    }

    /// The pixels of a window within some columns and rows of a place; `None` outside of the image.
    pub(crate) fn around(window: &Window, place_px: [f64; 2], reach: [usize; 2]) -> Option<Self> {
        let (region, pixels) = within(window.source, &window.pixels, place_px, reach)?;
        Some(Self::new(region, pixels, window.level))
    }

    /// Its own pixels within some columns and rows of a place; `None` outside.
    pub(crate) fn cut(&self, place_px: [f64; 2], reach: [usize; 2]) -> Option<Self> {
        let (region, pixels) = within(self.region, &self.pixels, place_px, reach)?;
        Some(Self::new(region, pixels, 0.0))
    }

    /// Number of its pixels.
    pub(crate) fn n_pixels(&self) -> usize {
        self.pixels.len()
    }

    /// The best of all places inside the scene; of equal ones the first, so the result is the same everywhere.
    pub(crate) fn find(&self, template: &Template) -> Option<Found> {
        let (columns, rows) = self.n_places(template);
        let score = self.scores(template);
        let mut best = (0.0, None);
        for row in 0..rows {
            for column in 0..columns {
                let score = score(column, row);
                if score > best.0 {
                    best = (score, Some([column, row]));
                }
            }
        }
        let (score, place) = best;
        place.map(|place| self.found(template, place, score))
    }

    /// The places that resemble the template more than all their neighbours do, and farther from a place than `own_px`, the best first;
    /// `at_most` so many.
    pub(crate) fn peaks_elsewhere(
        &self,
        template: &Template,
        place_px: [f64; 2],
        own_px: f64,
        at_most: usize,
    ) -> Vec<Found> {
        let (columns, rows) = self.n_places(template);
        let score = self.scores(template);
        let scores: Vec<f64> = (0..columns * rows).map(|i| score(i % columns, i / columns)).collect();
        let is_peak = |column: usize, row: usize| {
            let here = scores[row * columns + column];
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let (above, below) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            here > 0.0
                && (above..=below)
                    .all(|j| (left..=right).all(|i| scores[j * columns + i].total_cmp(&here).is_le()))
        };
        let mut peaks: Vec<Found> = (0..columns * rows)
            .map(|i| [i % columns, i / columns])
            .filter(|&[column, row]| is_peak(column, row))
            .map(|place| self.found(template, place, scores[place[1] * columns + place[0]]))
            .filter(|peak| (peak.place_px[0] - place_px[0]).hypot(peak.place_px[1] - place_px[1]) > own_px)
            .collect();
        peaks.sort_by(|left, right| right.zncc.total_cmp(&left.zncc));
        peaks.truncate(at_most);
        peaks
    }

    /// Columns and rows that the template's first pixel can lie in.
    fn n_places(&self, template: &Template) -> (usize, usize) {
        let along = |n: usize, size: usize| (n + 1).saturating_sub(size);
        match (along(self.region.width, template.width), along(self.region.height, template.height)) {
            (0, _) | (_, 0) => (0, 0),
            places => places,
        }
    }

    fn found(&self, template: &Template, [column, row]: [usize; 2], score: f64) -> Found {
        let [x, y] = template.first_px;
        let first = [(self.region.x + column) as f64, (self.region.y + row) as f64];
        Found { place_px: [first[0] - x, first[1] - y], zncc: score / template.energy.sqrt() }
    }

    /// The correlation times the root of the template's energy, by the template's first column and row in the scene; 0 without
    /// contrast.
    fn scores<'a>(&'a self, template: &'a Template) -> impl Fn(usize, usize) -> f64 + 'a {
        let (columns, rows) = self.n_places(template);
        let covariances = self.covariances(template, columns * rows);
        move |column, row| {
            let variation = self.table.variation(column, row, template.width, template.height);
            let covariance = f64::from(covariances[row * columns + column]);
            // what has no contrast of its own resembles nothing, whatever rounding makes of it
            if variation > NO_CONTRAST * template.energy { covariance / variation.sqrt() } else { 0.0 }
        }
    }

    /// The sums of the template times the pixels under it at all `n_places`, row by row, by Fourier transforms where that
    /// takes less work than each sum by itself.
    fn covariances(&self, template: &Template, n_places: usize) -> Vec<f32> {
        if n_places == 0 {
            return Vec::new();
        }
        let scene = Image { width: self.region.width, values: &self.pixels };
        let template = Image { width: template.width, values: &template.values };
        // a transform has some 15 N log2 N operations for the two there and the one back, of which vectors take 2 at once,
        // and 16 or more of a sum's
        let n = scene.values.len() as f64;
        let by_sums = n_places as f64 * template.values.len() as f64 / 16.0;
        if by_sums > 15.0 * n * n.log2() / 2.0 {
            correlations(scene, template)
        } else {
            sums(scene, template)
        }
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
    pub(crate) fn pixels(&self) -> (Region, &[f32]) {
        (self.region, &self.pixels)
    }

    /// The pixels of a part, counted from the scene's own corner.
    pub(crate) fn cropped(&self, part: Region) -> Vec<f32> {
        cropped(&self.pixels, self.region.width, part)
    }

    /// The pixels of a rectangle, row by row; `None` where it reaches beyond the scene.
    pub(crate) fn part(&self, [left, top]: [i64; 2], width: usize, height: usize) -> Option<Vec<f32>> {
        let x = usize::try_from(left - self.region.x as i64).ok()?;
        let y = usize::try_from(top - self.region.y as i64).ok()?;
        let inside = x + width <= self.region.width && y + height <= self.region.height;
        inside.then(|| self.cropped(Region { x, y, width, height }))
    }
}

/// The pixels of a region within some columns and rows of a place, and where they lie; `None` outside of it.
fn within(
    region: Region,
    pixels: &[f32],
    [x, y]: [f64; 2],
    [columns, rows]: [usize; 2],
) -> Option<(Region, Vec<f32>)> {
    let (x, y) = (x.round() as i64 - region.x as i64, y.round() as i64 - region.y as i64);
    let (columns, rows) = (columns as i64, rows as i64);
    let (width, height) = (region.width, region.height);
    let part = Region::clipped(x - columns, y - rows, x + columns + 1, y + rows + 1, width, height)?;
    let there = Region { x: region.x + part.x, y: region.y + part.y, ..part };
    Some((there, cropped(pixels, width, part)))
}

/// A part of an image, which is `width` pixels wide.
fn cropped(pixels: &[f32], width: usize, part: Region) -> Vec<f32> {
    let lines = pixels.chunks_exact(width).skip(part.y).take(part.height);
    lines.flat_map(|line| line[part.x..part.x + part.width].iter().copied()).collect()
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
