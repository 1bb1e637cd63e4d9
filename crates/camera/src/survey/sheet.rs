//! Reduced frames to look at: one, some, and some side by side.

use chainwave_measurement::Recording;

use super::frames::{spread, whole_frame};
use crate::error::CameraError;

/// White between tiles, in pixels.
const GAP_PX: usize = 4;
const WHITE: u8 = 255;
/// Share of the pixels that may turn black, and as many white, so that single bright spots do not darken all others.
const CLIPPED_SHARE: f64 = 0.005;

/// How a contact sheet is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SheetLayout {
    /// Frames at most, evenly spread over the recording.
    pub n_frames: usize,
    /// Frames side by side.
    pub n_columns: usize,
    /// Width of a frame on the sheet, in pixels; frames are made smaller, never larger.
    pub tile_width_px: usize,
}

/// Reduced frames of a recording side by side, row by row, in 8-bit gray for looking at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContactSheet {
    /// Columns of the sheet.
    pub width_px: usize,
    /// Rows of the sheet.
    pub height_px: usize,
    /// Gray levels, row by row from the top.
    pub pixels: Vec<u8>,
    /// The frames shown, in the order of reading.
    pub frames: Vec<usize>,
}

/// One frame, made smaller, in 8-bit gray for looking at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GrayFrame {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Gray levels, row by row from the top.
    pub pixels: Vec<u8>,
}

/// A frame at most `width_px` wide, reduced by averaging; the brightest and the darkest half per cent turn white and black.
///
/// # Errors
/// [`CameraError::Read`] when the frame cannot be read.
pub fn gray_frame(
    recording: &dyn Recording,
    frame: usize,
    width_px: usize,
) -> Result<GrayFrame, CameraError> {
    let info = recording.info();
    let width_px = width_px.clamp(1, info.width_px);
    let height_px = (info.height_px * width_px / info.width_px).max(1);
    let pixels = whole_frame(recording, frame)?;
    let tile = reduced(&pixels, (info.width_px, info.height_px), (width_px, height_px));
    let levels = GrayRange::of(std::slice::from_ref(&tile));
    Ok(GrayFrame { width_px, height_px, pixels: tile.into_iter().map(|count| levels.gray(count)).collect() })
}

/// Some frames, evenly spread over the recording, with their numbers: reduced by averaging, and all with one mapping of counts to gray.
///
/// # Errors
/// [`CameraError::Read`] when a frame cannot be read.
pub fn gray_frames(
    recording: &dyn Recording,
    n_frames: usize,
    width_px: usize,
) -> Result<Vec<(usize, GrayFrame)>, CameraError> {
    let info = recording.info();
    let frames = spread(n_frames, info.n_frames);
    let width_px = width_px.clamp(1, info.width_px);
    let height_px = (info.height_px * width_px / info.width_px).max(1);
    let reduce = |&frame: &usize| {
        let pixels = whole_frame(recording, frame)?;
        Ok(reduced(&pixels, (info.width_px, info.height_px), (width_px, height_px)))
    };
    let tiles: Vec<Vec<f32>> = frames.iter().map(reduce).collect::<Result<_, CameraError>>()?;
    let levels = GrayRange::of(&tiles);
    let gray = |(frame, tile): (usize, Vec<f32>)| {
        let pixels = tile.into_iter().map(|count| levels.gray(count)).collect();
        (frame, GrayFrame { width_px, height_px, pixels })
    };
    Ok(frames.into_iter().zip(tiles).map(gray).collect())
}

/// Draws a contact sheet of [`gray_frames`].
///
/// # Errors
/// [`CameraError::Read`] when a frame cannot be read.
pub fn contact_sheet(recording: &dyn Recording, layout: SheetLayout) -> Result<ContactSheet, CameraError> {
    let tiles = gray_frames(recording, layout.n_frames, layout.tile_width_px)?;
    let (width, height) = tiles.first().map_or((1, 1), |(_, tile)| (tile.width_px, tile.height_px));
    let n_columns = layout.n_columns.clamp(1, tiles.len().max(1));
    let n_rows = tiles.len().div_ceil(n_columns);
    let width_px = n_columns * (width + GAP_PX) + GAP_PX;
    let height_px = n_rows * (height + GAP_PX) + GAP_PX;
    let mut pixels = vec![WHITE; width_px * height_px];
    for (index, (_, tile)) in tiles.iter().enumerate() {
        let left = index % n_columns * (width + GAP_PX) + GAP_PX;
        let top = index / n_columns * (height + GAP_PX) + GAP_PX;
        for (row, grays) in tile.pixels.chunks_exact(width).enumerate() {
            let start = (top + row) * width_px + left;
            pixels[start..start + width].copy_from_slice(grays);
        }
    }
    let frames = tiles.into_iter().map(|(frame, _)| frame).collect();
    Ok(ContactSheet { width_px, height_px, pixels, frames })
}

/// A frame made smaller: each pixel is the mean over the pixels that it covers.
fn reduced(pixels: &[f32], from: (usize, usize), to: (usize, usize)) -> Vec<f32> {
    let edge = |index: usize, n_from: usize, n_to: usize| index * n_from / n_to;
    let mut tile = Vec::with_capacity(to.0 * to.1);
    for row in 0..to.1 {
        let rows = edge(row, from.1, to.1)..edge(row + 1, from.1, to.1);
        for column in 0..to.0 {
            let columns = edge(column, from.0, to.0)..edge(column + 1, from.0, to.0);
            let covered = rows.clone().map(|y| &pixels[y * from.0..][columns.clone()]);
            let sum: f32 = covered.flatten().sum();
            tile.push(sum / (rows.len() * columns.len()) as f32);
        }
    }
    tile
}

/// The counts that become black and white.
struct GrayRange {
    black: f32,
    white: f32,
}

impl GrayRange {
    fn of(tiles: &[Vec<f32>]) -> Self {
        let mut counts = tiles.concat();
        counts.sort_by(f32::total_cmp);
        let n_clipped = (CLIPPED_SHARE * counts.len() as f64) as usize;
        let black = counts.get(n_clipped).copied().unwrap_or(0.0);
        let white = counts.iter().rev().nth(n_clipped).copied().unwrap_or(0.0);
        Self { black, white: white.max(black + 1.0) }
    }

    fn gray(&self, count: f32) -> u8 {
        ((count - self.black) / (self.white - self.black) * 255.0).round().clamp(0.0, 255.0) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reduced_frame_keeps_the_mean_of_what_it_covers() {
        let pixels: Vec<f32> = (0..24).map(|index| index as f32).collect();
        assert_eq!(reduced(&pixels, (6, 4), (3, 2)), [3.5, 5.5, 7.5, 15.5, 17.5, 19.5]);
        assert_eq!(reduced(&pixels, (6, 4), (6, 4)), pixels);
        // Whole pixels only: 6 columns over 4 tiles are 1, 2, 1 and 2 wide.
        assert_eq!(reduced(&pixels[..6], (6, 1), (4, 1)), [0.0, 1.5, 3.0, 4.5]);
    }
}
