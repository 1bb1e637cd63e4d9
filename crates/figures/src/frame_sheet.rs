//! Frames of a recording side by side, each with its number and time.

use crate::colour::Rgb;
use crate::drawing::{Anchor, Columns, Drawing, Raster};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::{FigureError, Style};

/// Frames in gray, in rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameSheet {
    /// Columns and rows of each picture.
    pub picture_px: [usize; 2],
    /// Frames side by side, at least one.
    pub n_columns: usize,
    /// The frames, in the order of reading.
    pub frames: Vec<NamedFrame>,
}

/// A frame and what stands below it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFrame {
    /// Its number and time.
    pub name: String,
    /// Gray levels, row by row from the top.
    pub grays: Vec<u8>,
}

/// Between frames, and around them.
const GAP_MM: f64 = 1.5;
/// The least height of a frame on the page, so that a strip can be seen.
const LEAST_MM: f64 = 2.0;

impl Draw for FrameSheet {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, sheet: &FrameSheet) -> Result<Drawing, FigureError> {
    let [width_px, height_px] = sheet.picture_px;
    let expected = width_px * height_px;
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let n_columns = sheet.n_columns.max(1) as f64;
    let width_mm = (drawing.width_mm - (n_columns + 1.0) * GAP_MM) / n_columns;
    let height_mm = (width_mm * height_px as f64 / width_px.max(1) as f64).max(LEAST_MM);
    let em_mm = drawing.number_mm();
    let row_mm = height_mm + 1.5 * em_mm + GAP_MM;
    for (index, frame) in sheet.frames.iter().enumerate() {
        if frame.grays.len() != expected || expected == 0 {
            let (what, found) = ("gray levels".into(), frame.grays.len());
            return Err(FigureError::Length { figure: "sheet of frames", what, expected, found });
        }
        let [column, row] = [index % sheet.n_columns.max(1), index / sheet.n_columns.max(1)];
        let left = GAP_MM + column as f64 * (width_mm + GAP_MM);
        let place = PageRect::new(left, GAP_MM + row as f64 * row_mm, width_mm, height_mm);
        let pixels = frame.grays.iter().map(|&gray| Rgb(gray, gray, gray)).collect();
        drawing.picture(place, Raster { width_px, height_px, pixels });
        let below = (0.5 * (place.left + place.right), place.bottom + 0.8 * em_mm);
        drawing.text(&frame.name, below, em_mm, Anchor::Middle);
    }
    let n_rows = sheet.frames.len().div_ceil(sheet.n_columns.max(1));
    drawing.extend_to(GAP_MM + n_rows as f64 * row_mm);
    Ok(drawing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(n_frames: usize, picture_px: [usize; 2]) -> FrameSheet {
        let frame = |n: usize| NamedFrame {
            name: format!("frame {n}, {:.3} ms", 0.04 * n as f64),
            grays: vec![(40 * n % 256) as u8; picture_px[0] * picture_px[1]],
        };
        FrameSheet { picture_px, n_columns: 4, frames: (0..n_frames).map(frame).collect() }
    }

    #[test]
    fn every_frame_has_its_name_and_nothing_overlaps() {
        for picture_px in [[320, 60], [200, 200], [1000, 3]] {
            let drawing = layout(&Style::default(), &sheet(10, picture_px)).unwrap();
            drawing.assert_readable();
            assert!(drawing.says("frame 0, 0.000 ms") && drawing.says("frame 9, 0.360 ms"));
        }
    }

    #[test]
    fn a_picture_of_another_size_is_refused_and_no_frame_is_no_failure() {
        let mut wrong = sheet(3, [20, 10]);
        wrong.frames[1].grays.pop();
        assert!(layout(&Style::default(), &wrong).unwrap_err().to_string().contains("expected 200"));
        assert!(layout(&Style::default(), &sheet(0, [20, 10])).is_ok());
    }
}
