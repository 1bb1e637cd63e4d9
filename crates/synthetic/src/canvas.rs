//! A frame under construction: tones, row by row from the top, and the rows that are being drawn.

use std::ops::Range;

/// Tones of a frame; while a part of its rows is drawn, the others stay as they are.
pub(crate) struct Canvas {
    pub(crate) width_px: usize,
    pub(crate) values: Vec<f32>,
    rows: Range<usize>,
}

impl Canvas {
    pub(crate) fn new(width_px: usize, height_px: usize) -> Self {
        Self { width_px, values: vec![0.0; width_px * height_px], rows: 0..height_px }
    }

    pub(crate) fn height_px(&self) -> usize {
        self.values.len() / self.width_px
    }

    /// The rows that are being drawn.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// From here on, draws in some rows alone.
    pub(crate) fn draw_in(&mut self, rows: Range<usize>) {
        self.rows = rows;
    }

    /// Those of some rows that are being drawn.
    pub(crate) fn drawn(&self, rows: Range<usize>) -> Range<usize> {
        let start = rows.start.max(self.rows.start);
        start..rows.end.min(self.rows.end).max(start)
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.width_px..(row + 1) * self.width_px]
    }

    /// The rows that are being drawn, with their numbers.
    pub(crate) fn rows_mut(&mut self) -> impl Iterator<Item = (usize, &mut [f32])> {
        let part = self.rows.start * self.width_px..self.rows.end * self.width_px;
        self.rows.clone().zip(self.values[part].chunks_exact_mut(self.width_px))
    }

    /// The tones of the rows that are being drawn.
    pub(crate) fn drawn_mut(&mut self) -> &mut [f32] {
        &mut self.values[self.rows.start * self.width_px..self.rows.end * self.width_px]
    }
}
