//! The pixels of a reference: where they lie, which are to be used, and what they are beyond the edges.

use chainwave_measurement::Region;

/// The pixels of a part of an image, the mean of some frames.
#[derive(Debug, Clone)]
pub(crate) struct ReferenceImage {
    /// Where they lie in the image.
    pub(crate) region: Region,
    /// Counts, row by row from the top.
    pub(crate) pixels: Vec<f32>,
    /// Frames behind the mean that tell anything of their own: frames that are alike tell as much as one.
    pub(crate) n_averaged: usize,
    /// Whether each pixel saturates or is no number.
    pub(crate) invalid: Vec<bool>,
    /// Mean of the pixels, in counts.
    pub(crate) level: f64,
    /// What pixels were rounded to: a count, or where none is above 1, as in a picture scaled to 0..1, what of it 8 bits tell.
    pub(crate) quantum: f64,
}

/// The step of 8 bits, the coarsest of pictures, scaled to 0..1.
const SCALED_QUANTUM: f64 = 1.0 / 255.0;

impl ReferenceImage {
    /// The pixels of a region, which they fill; one that is no number takes the level of the others, so that filters do not spread it.
    pub(crate) fn new(region: Region, mut pixels: Vec<f32>, n_averaged: usize) -> Self {
        let invalid: Vec<bool> = pixels.iter().map(|pixel| !pixel.is_finite()).collect();
        let n_valid = invalid.iter().filter(|invalid| !**invalid).count().max(1);
        let sum: f64 = pixels.iter().filter(|pixel| pixel.is_finite()).map(|&pixel| f64::from(pixel)).sum();
        let level = sum / n_valid as f64;
        pixels.iter_mut().filter(|pixel| !pixel.is_finite()).for_each(|pixel| *pixel = level as f32);
        let is_in_counts = pixels.iter().any(|&pixel| pixel > 1.0);
        let quantum = if is_in_counts { 1.0 } else { SCALED_QUANTUM };
        // A mean of frames that differ has fractions of a count somewhere.
        let is_one_frame = is_in_counts && pixels.iter().all(|pixel| pixel.fract() == 0.0);
        let n_averaged = if is_one_frame { 1 } else { n_averaged.max(1) };
        Self { region, pixels, n_averaged, invalid, level, quantum }
    }

    /// Copies the pixels of the row `y` from the column `x` on, mirrored beyond the edges, less a level.
    pub(crate) fn copy_row(&self, x: i64, y: i64, level: f32, line: &mut [f32]) {
        let start = mirrored(y - self.region.y as i64, self.region.height) * self.region.width;
        let row = &self.pixels[start..start + self.region.width];
        let first = x - self.region.x as i64;
        let (n, width) = (line.len() as i64, self.region.width as i64);
        let (inside, end) = ((-first).clamp(0, n), (width - first).clamp(0, n));
        let mirror = |i: i64| row[mirrored(first + i, self.region.width)] - level;
        (0..inside).chain(end..n).for_each(|i| line[i as usize] = mirror(i));
        if inside < end {
            let from = &row[(first + inside) as usize..(first + end) as usize];
            let line = line[inside as usize..end as usize].iter_mut();
            line.zip(from).for_each(|(to, from)| *to = from - level);
        }
    }

    /// Whether the reference holds the pixels of columns `x0..=x1` and rows `y0..=y1`.
    pub(crate) fn holds(&self, [x0, x1]: [i64; 2], [y0, y1]: [i64; 2]) -> bool {
        let within =
            |low: i64, high: i64, first: usize, n: usize| low >= first as i64 && high < (first + n) as i64;
        within(x0, x1, self.region.x, self.region.width) && within(y0, y1, self.region.y, self.region.height)
    }

    /// The pixel at a place of the image; beyond the reference, the one that mirrors it at the edge.
    #[cfg(test)]
    pub(crate) fn pixel(&self, x: i64, y: i64) -> f64 {
        let column = mirrored(x - self.region.x as i64, self.region.width);
        let row = mirrored(y - self.region.y as i64, self.region.height);
        f64::from(self.pixels[row * self.region.width + column])
    }
}

fn mirrored(i: i64, n: usize) -> usize {
    let last = n as i64 - 1;
    if (0..=last).contains(&i) {
        return i as usize;
    }
    let folded = i.rem_euclid((2 * last).max(1));
    usize::try_from(folded.min(2 * last - folded)).unwrap_or(0)
}
