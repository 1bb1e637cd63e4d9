//! How the pixels that a subset passes over change, and how they should.

use chainwave_measurement::{Position, Recording, Region, Subset};

use crate::reference::{mean_of_frames, pixel_bounds};
use crate::search::patch::bilinear;
use crate::{CorrelationError, ReferenceFrames};

/// Variance of a pixel over the one that is foretold for it, up to which nothing moves there. A match is off by no more than a part of what it
/// foretells, and a picture that is out of focus to half the contrast has a fourth of it.
const STILL_SHARE: f64 = 0.1;
/// Variance that is foretold over the mean of all pixels from which on it tells something.
const TELLING_SHARE: f64 = 0.1;
/// Variance of a pixel over that of those which are known to keep still, up to which one beside them does so, too: of four frames, noise has as
/// much in one of 30.
const AS_STILL: f64 = 3.0;
/// Pixels beyond the subset whose texture foretells what comes into view: what moves otherwise there, or not at all, is no part of it either.
const AROUND_PX: i64 = 12;
/// Pixels that hang together at least: what is smaller, such as a dead pixel, spoils a few readings by little.
pub(super) const LEAST_PIXELS: usize = 9;

/// Frames that a pixel is seen in at least.
pub(super) const LEAST_FRAMES: usize = 4;

/// What was seen of one pixel, and what was foretold.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    n: usize,
    seen: Moments,
    foretold: Moments,
}

/// Sum and sum of squares.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.squares += value * value;
    }

    fn variance(self, n: usize) -> f64 {
        (self.squares - self.sum * self.sum / n as f64) / (n as f64 - 1.0)
    }
}

/// The pixels that a subset passes over.
pub(super) struct Pixels {
    region: Region,
    /// First and last column, first and last row of the subset in the reference.
    own: [i64; 4],
    pixels: Vec<Pixel>,
}

impl Pixels {
    /// What frames show of a subset that was found there. `None` where they show nothing of it.
    pub(super) fn of(
        recording: &dyn Recording,
        subset: &Subset,
        reference: &ReferenceFrames,
        frames: &[(usize, Position)],
    ) -> Result<Option<Self>, CorrelationError> {
        let info = recording.info();
        let clipped = |[x0, x1, y0, y1]: [i64; 4]| {
            Region::clipped(x0, y0, x1 + 1, y1 + 1, info.width_px, info.height_px)
        };
        let own = pixel_bounds(subset);
        let [x0, x1, y0, y1] = own;
        let around = [x0 - AROUND_PX, x1 + AROUND_PX, y0 - AROUND_PX, y1 + AROUND_PX];
        let (Some(of_reference), Some(region)) = (
            clipped(around),
            clipped(frames.iter().map(|(_, position)| bounds_at(subset, position)).fold(own, joined)),
        ) else {
            return Ok(None);
        };
        let texture = mean_of_frames(recording, of_reference, reference.range())
            .map_err(CorrelationError::Reference)?;
        let texture = Texture { region: of_reference, pixels: &texture };
        let mut found = Self { region, own, pixels: vec![Pixel::default(); region.n_pixels()] };
        for (frame, position) in frames {
            found.look_at(recording, *frame, [subset.x_px, subset.y_px], position, texture);
        }
        Ok(Some(found))
    }

    /// Adds what a frame shows of the subset. One that cannot be read shows nothing.
    fn look_at(
        &mut self,
        recording: &dyn Recording,
        frame: usize,
        centre_px: [f64; 2],
        position: &Position,
        texture: Texture<'_>,
    ) {
        let region = self.region;
        let mut seen = vec![0.0; region.n_pixels()];
        if recording.read_region(frame, region, &mut seen).is_err() {
            return;
        }
        let (sin, cos) = position.theta_rad.map_or(0.0, |theta| theta.value).sin_cos();
        for (i, seen) in seen.into_iter().enumerate() {
            let (x, y) = (region.x + i % region.width, region.y + i / region.width);
            let [dx, dy] = [x as f64 - position.x_px.value, y as f64 - position.y_px.value];
            let source = [centre_px[0] + cos * dx + sin * dy, centre_px[1] - sin * dx + cos * dy];
            if let Some(foretold) = texture.at(source) {
                let pixel = &mut self.pixels[i];
                pixel.n += 1;
                pixel.seen.add(f64::from(seen));
                pixel.foretold.add(foretold);
            }
        }
    }

    /// Columns and rows of the pixels that keep still, and hang together: those that should not, and those beside them that keep as still, such as
    /// the middle of what is so wide that the subset foretells it behind itself.
    pub(super) fn covered(&self) -> Vec<[usize; 2]> {
        let foretold = |pixel: &Pixel| pixel.foretold.variance(pixel.n);
        let known: Vec<&Pixel> = self.pixels.iter().filter(|pixel| pixel.n >= LEAST_FRAMES).collect();
        let mean = known.iter().map(|pixel| foretold(pixel)).sum::<f64>() / known.len() as f64;
        let is_still = |pixel: &Pixel| {
            let foretold = foretold(pixel);
            pixel.n >= LEAST_FRAMES
                && foretold > TELLING_SHARE * mean
                && pixel.seen.variance(pixel.n) < STILL_SHARE * foretold
        };
        let still: Vec<bool> = self.pixels.iter().map(is_still).collect();
        let width = self.region.width;
        let seen = |pixel: &Pixel| pixel.seen.variance(pixel.n);
        let sure = || self.pixels.iter().zip(&still).filter(|(_, is_still)| **is_still);
        let usual = sure().map(|(pixel, _)| seen(pixel)).sum::<f64>() / sure().count() as f64;
        let limit = (AS_STILL * usual).min(STILL_SHARE * mean);
        let may_be = |pixel: &Pixel| pixel.n >= LEAST_FRAMES && seen(pixel) < limit;
        let all: Vec<bool> =
            self.pixels.iter().zip(&still).map(|(pixel, still)| *still || may_be(pixel)).collect();
        let n_sure = |piece: &Vec<usize>| piece.iter().filter(|at| still[**at]).count();
        let place = |i: usize| [self.region.x + i % width, self.region.y + i / width];
        let pieces = pieces(&all, width).into_iter();
        pieces.filter(|piece| n_sure(piece) >= LEAST_PIXELS).flatten().map(place).collect()
    }

    /// The share of the subset's own pixels in the reference that is among some.
    pub(super) fn share_of_subset(&self, covered: &[[usize; 2]]) -> f64 {
        let [x0, x1, y0, y1] = self.own;
        let is_own =
            |[x, y]: &&[usize; 2]| (x0..=x1).contains(&(*x as i64)) && (y0..=y1).contains(&(*y as i64));
        covered.iter().filter(is_own).count() as f64 / ((x1 - x0 + 1) * (y1 - y0 + 1)) as f64
    }
}

/// The pixels of a part of an image.
#[derive(Clone, Copy)]
pub(super) struct Texture<'a> {
    pub(super) region: Region,
    pub(super) pixels: &'a [f32],
}

impl Texture<'_> {
    /// The count at a place of the image, between pixels along straight lines; `None` beyond the part.
    pub(super) fn at(self, [x, y]: [f64; 2]) -> Option<f64> {
        let Self { region, pixels } = self;
        let [column, row] = [x - region.x as f64, y - region.y as f64];
        let is_inside = (0.0..=(region.width - 1) as f64).contains(&column)
            && (0.0..=(region.height - 1) as f64).contains(&row);
        (is_inside && region.width > 1 && region.height > 1)
            .then(|| f64::from(bilinear(pixels, region.width, [column, row])))
    }
}

/// First and last column, first and last row of the pixels that a subset may cover where it was found.
pub(super) fn bounds_at(subset: &Subset, position: &Position) -> [i64; 4] {
    let [half_x, half_y] = [subset.half_width_px, subset.half_height_px].map(|half| half as f64);
    let (sin, cos) = position.theta_rad.map_or(0.0, |theta| theta.value).sin_cos();
    let (reach_x, reach_y) =
        (cos.abs() * half_x + sin.abs() * half_y, sin.abs() * half_x + cos.abs() * half_y);
    let (x, y) = (position.x_px.value, position.y_px.value);
    [(x - reach_x).floor(), (x + reach_x).ceil(), (y - reach_y).floor(), (y + reach_y).ceil()]
        .map(|px| px as i64)
}

pub(super) fn joined(a: [i64; 4], b: [i64; 4]) -> [i64; 4] {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

/// The marked pixels of an image, each piece that hangs together by itself, by their indices.
pub(super) fn pieces(marked: &[bool], width: usize) -> Vec<Vec<usize>> {
    let mut is_open = marked.to_vec();
    let mut pieces = Vec::new();
    for start in 0..marked.len() {
        if !std::mem::take(&mut is_open[start]) {
            continue;
        }
        let mut piece = vec![start];
        let mut next = 0;
        while let Some(&at) = piece.get(next) {
            next += 1;
            let (x, y) = (at % width, at / width);
            for row in y.saturating_sub(1)..(y + 2).min(marked.len() / width) {
                for place in (x.saturating_sub(1)..(x + 2).min(width)).map(|column| row * width + column) {
                    if std::mem::take(&mut is_open[place]) {
                        piece.push(place);
                    }
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}
