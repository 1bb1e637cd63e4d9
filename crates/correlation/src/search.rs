use chainwave_measurement::{ReadError, Recording, Region};

use crate::PreparedSubset;

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
    let Some(region) = region_around(recording, subset, around_px) else { return Ok(None) };
    let mut pixels = vec![0.0; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels)?;
    let level = subset.mean as f32;
    pixels.iter_mut().for_each(|pixel| *pixel -= level);
    let best = best_shift(subset, region.width, &pixels);
    let [x, y] = subset.first_px;
    Ok(best.map(|(column, row)| [(region.x + column) as f64 - x, (region.y + row) as f64 - y]))
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

/// Column and row of the best candidate's first pixel. Of equal ones the first, so the result is the same everywhere.
fn best_shift(subset: &PreparedSubset, width: usize, pixels: &[f32]) -> Option<(usize, usize)> {
    let height = pixels.len() / width;
    let table = SummedArea::new(width, pixels);
    let (columns, rows) = (width - subset.width + 1, height - subset.height + 1);
    let mut best = (0.0, None);
    for row in 0..rows {
        for column in 0..columns {
            let variation = table.variation(column, row, subset.width, subset.height);
            let covariance = correlate(subset, width, &pixels[row * width + column..]);
            let zncc = covariance / variation.sqrt();
            // false for NaN, which a patch without contrast gives
            if zncc > best.0 {
                best = (zncc, Some((column, row)));
            }
        }
    }
    best.1
}

/// Sum of the reference's grey values times the pixels under it.
fn correlate(subset: &PreparedSubset, width: usize, pixels: &[f32]) -> f64 {
    const LANES: usize = 8;
    let mut total = 0.0;
    for (f, g) in subset.intensity.chunks_exact(subset.width).zip(pixels.chunks(width)) {
        let g = &g[..subset.width];
        let (f_lanes, f_rest) = f.as_chunks::<LANES>();
        let (g_lanes, g_rest) = g.as_chunks::<LANES>();
        let mut lanes = [0.0_f32; LANES];
        for (f, g) in f_lanes.iter().zip(g_lanes) {
            for i in 0..LANES {
                lanes[i] += f[i] * g[i];
            }
        }
        let rest: f32 = f_rest.iter().zip(g_rest).map(|(f, g)| f * g).sum();
        total += f64::from(lanes.iter().sum::<f32>() + rest);
    }
    total
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
    let square = |values: &[f32]| values.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>();
    let [k_x, k_y] = [&subset.gradient_x, &subset.gradient_y].map(|g| square(g) / subset.energy);
    let n_independent = subset.n_pixels() as f64 * (k_x * k_y).sqrt() / std::f64::consts::PI;
    (5.5 / (n_independent - 3.0).max(1.0).sqrt()).tanh()
}
