/// A frame under construction, row by row from the top.
pub(crate) struct Canvas {
    pub(crate) width_px: usize,
    pub(crate) values: Vec<f32>,
}

impl Canvas {
    pub(crate) fn new(width_px: usize, height_px: usize) -> Self {
        Self { width_px, values: vec![0.0; width_px * height_px] }
    }

    pub(crate) fn height_px(&self) -> usize {
        self.values.len() / self.width_px
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.width_px..(row + 1) * self.width_px]
    }

    pub(crate) fn rows_mut(&mut self) -> impl Iterator<Item = (usize, &mut [f32])> {
        self.values.chunks_exact_mut(self.width_px).enumerate()
    }
}
