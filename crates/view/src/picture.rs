//! A part of a frame as a PNG of 8 bits: read in bands of rows, made smaller by means, counts mapped to grey.

use chainwave_measurement::{ReadError, Recording, Region};

use crate::cut::Cut;

/// Rows that are read at a time, at least: enough that a read costs more than its call, few enough to stay small.
const BAND_ROWS: usize = 32;

/// The grey values of a cut, row by row from the top: `255 (count - low)/(high - low)`, rounded, of the mean count of each square of
/// pixels (those that lie in the region, at its right and lower edge).
///
/// # Errors
/// [`ReadError`] as [`Recording::read_region`].
pub(crate) fn greys(recording: &dyn Recording, cut: &Cut) -> Result<Vec<u8>, ReadError> {
    let Cut { frame, region, scale, window: [low, high] } = *cut;
    let [columns, rows] = cut.size();
    let grey = |count: f64| (255.0 * (count - low) / (high - low)).round() as u8; // casts saturate
    let mut greys = Vec::with_capacity(columns * rows);
    let mut counts = Vec::new();
    let band_rows = scale * (BAND_ROWS / scale).max(1);
    for first in (0..region.height).step_by(band_rows) {
        let height = band_rows.min(region.height - first);
        let band = Region { y: region.y + first, height, ..region };
        counts.resize(band.n_pixels(), 0.0);
        recording.read_region(frame, band, &mut counts)?;
        match scale {
            1 => greys.extend(counts.iter().map(|&count| grey(f64::from(count)))),
            _ => counts.chunks(scale * region.width).for_each(|rows| {
                let means =
                    (0..columns).map(|column| mean_of_square(rows, region.width, column * scale, scale));
                greys.extend(means.map(grey));
            }),
        }
    }
    Ok(greys)
}

/// The mean of a square of pixels whose first column is given; rows lie back to back.
fn mean_of_square(rows: &[f32], width: usize, column: usize, scale: usize) -> f64 {
    let end = (column + scale).min(width);
    let of_row = |row: &[f32]| row[column..end].iter().copied().map(f64::from).sum::<f64>();
    let n_pixels = (rows.len() / width) * (end - column);
    rows.chunks_exact(width).map(of_row).sum::<f64>() / n_pixels as f64
}

/// A PNG of grey values of 8 bits.
///
/// # Errors
/// When the values do not fill the size.
pub(crate) fn png_of(greys: &[u8], [columns, rows]: [usize; 2]) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::with_capacity(greys.len() / 2 + 1024);
    // A frame has at most 2^24 pixels (`Cut`).
    let mut encoder = png::Encoder::new(&mut file, columns as u32, rows as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(greys)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::MemoryRecording;

    fn counting() -> MemoryRecording {
        MemoryRecording::new(5, 8, vec![(0..15).map(|i| i as f32).collect()])
    }

    #[test]
    fn counts_between_black_and_white_become_grey() {
        let cut = Cut {
            frame: 0,
            region: Region { x: 1, y: 1, width: 3, height: 2 },
            scale: 1,
            window: [6.0, 11.0],
        };
        // 6, 7, 8 and 11, 12, 13: 255/5 a count, what is above is white.
        assert_eq!(greys(&counting(), &cut).unwrap(), [0, 51, 102, 255, 255, 255]);
    }

    #[test]
    fn squares_become_their_mean_also_at_the_edges() {
        let cut = Cut { frame: 0, region: Region::whole(5, 3), scale: 2, window: [0.0, 255.0] };
        // (0 + 1 + 5 + 6)/4, (2 + 3 + 7 + 8)/4, (4 + 9)/2; (10 + 11)/2, (12 + 13)/2, 14
        assert_eq!(greys(&counting(), &cut).unwrap(), [3, 5, 7, 11, 13, 14]);
        assert_eq!(cut.size(), [3, 2]);
    }
}
